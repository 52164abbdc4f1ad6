//! Reads the fault record, piece by piece.

use super::error::DeviceError;
use super::session::Session;
use super::transport::Transport;
use stillpoint_shared::protocol::{FaultHead, FaultSample, Request, Response};

/// The last second before a fault.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultReport {
    /// What the record is about.
    pub head: FaultHead,
    /// The samples, oldest first.
    pub samples: Vec<FaultSample>,
}

impl<T: Transport> Session<T> {
    /// Reads the fault record, if there is a fault in it.
    ///
    /// # Errors
    /// As [`Session::ask`].
    pub fn fault_report(&mut self) -> Result<Option<FaultReport>, DeviceError> {
        let head = match self.ask(&Request::GetFault)? {
            Response::Fault(Some(head)) => head,
            Response::Fault(None) => return Ok(None),
            _ => {
                return Err(DeviceError::Unexpected {
                    request: "GetFault",
                });
            }
        };
        let mut samples = Vec::new();
        while samples.len() < usize::from(head.samples) {
            let first = samples.len() as u16;
            match self.ask(&Request::GetFaultSamples { first })? {
                Response::FaultSamples(piece) if !piece.is_empty() => samples.extend(piece),
                _ => {
                    let request = "GetFaultSamples";
                    return Err(DeviceError::Unexpected { request });
                }
            }
        }
        Ok(Some(FaultReport { head, samples }))
    }
}
