//! Starts that wait for the drives.

use super::error::DeviceError;
use super::session::Session;
use super::transport::Transport;
use std::time::Duration;
use stillpoint_shared::protocol::{Denial, Request};
use stillpoint_shared::status::{Refusal, StartRequest};

/// Time between two attempts to start.
const BETWEEN: Duration = Duration::from_millis(50);
/// Longest time for the drives to switch on and the axes to creep to the start.
const PATIENCE: Duration = Duration::from_secs(60);

impl<T: Transport> Session<T> {
    /// Starts an armed move as soon as the drives are on and the axes stand at its start.
    ///
    /// # Errors
    /// As [`Session::order`]: another refusal, or the same one still after a minute.
    pub fn start(&mut self, request: &StartRequest) -> Result<(), DeviceError> {
        let deadline = self.transport().now() + PATIENCE;
        loop {
            let error = match self.order(&Request::Start(*request)) {
                Ok(()) => return Ok(()),
                Err(error) => error,
            };
            let on_its_way = matches!(
                error,
                DeviceError::Denied(Denial::Executor(
                    Refusal::NotEnabled { .. }
                        | Refusal::Approaching { .. }
                        | Refusal::NotAtStart { .. }
                ))
            );
            if !on_its_way || self.transport().now() >= deadline {
                return Err(error);
            }
            self.wait(BETWEEN)?;
        }
    }
}
