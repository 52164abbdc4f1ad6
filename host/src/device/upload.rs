//! Uploads: blocks in a window, from where the last attempt ended.

use super::error::DeviceError;
use super::session::Session;
use super::transport::Transport;
use std::time::Duration;
use stillpoint_shared::Trajectory;
use stillpoint_shared::assembly::{self, Arrived, AssemblyError, Outline};
use stillpoint_shared::protocol::{Block, Denial, Request, Response};
use stillpoint_shared::status::Refusal;

/// How far an upload is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Blocks that have arrived.
    pub arrived: u32,
    /// Blocks of the trajectory.
    pub blocks: u32,
}

/// What an upload took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uploaded {
    /// Blocks of the trajectory.
    pub blocks: u32,
    /// Blocks sent, repetitions included.
    pub sent: u32,
    /// Times the session was opened anew.
    pub reconnects: u32,
    /// From the first request to the last response.
    pub time: Duration,
}

/// A block that has not been answered yet.
struct Flight {
    sequence: u16,
    block: u8,
    deadline: Duration,
    attempts: u32,
}

impl<T: Transport> Session<T> {
    /// Uploads a trajectory: afterwards it is the one that is loaded, or the board has refused it and nothing has
    /// changed.
    ///
    /// Where the session is lost the upload goes on in a new one, with the blocks that have not arrived yet.
    ///
    /// # Errors
    /// [`DeviceError`], with the board's own words where it refuses.
    pub fn upload(
        &mut self,
        trajectory: &Trajectory,
        mut progress: impl FnMut(Progress),
    ) -> Result<Uploaded, DeviceError> {
        let outline = Outline::of(trajectory);
        let began = self.line.transport.now();
        let mut uploaded = Uploaded {
            blocks: 0,
            sent: 0,
            reconnects: 0,
            time: Duration::ZERO,
        };
        loop {
            let result = self.upload_once(trajectory, &outline, &mut uploaded, &mut progress);
            let Err(error) = result else {
                uploaded.time = self.line.transport.now() - began;
                return Ok(uploaded);
            };
            let again =
                uploaded.reconnects < self.line.settings.reconnects && is_of_the_line(&error);
            if !again {
                return Err(error);
            }
            uploaded.reconnects += 1;
            // The commit may have come through while its answer was lost.
            let identity = self.reconnect()?;
            if uploaded.sent > 0 && identity.loaded == Some(outline.content_hash) {
                uploaded.time = self.line.transport.now() - began;
                return Ok(uploaded);
            }
        }
    }

    fn upload_once(
        &mut self,
        trajectory: &Trajectory,
        outline: &Outline,
        uploaded: &mut Uploaded,
        progress: &mut impl FnMut(Progress),
    ) -> Result<(), DeviceError> {
        let begin = Request::UploadBegin(outline.clone());
        let Response::Upload(arrived) = self.ask(&begin)? else {
            return Err(DeviceError::Unexpected { request: "Upload" });
        };
        uploaded.blocks = u32::from(arrived.blocks);
        self.send_blocks(trajectory, outline, arrived, uploaded, progress)?;
        self.order(&Request::UploadCommit {
            content_hash: outline.content_hash,
        })
    }

    /// Sends all blocks that have not arrived, with as many unanswered as the board allows.
    fn send_blocks(
        &mut self,
        trajectory: &Trajectory,
        outline: &Outline,
        mut arrived: Arrived,
        uploaded: &mut Uploaded,
        progress: &mut impl FnMut(Progress),
    ) -> Result<(), DeviceError> {
        let tag = outline.tag();
        let window = usize::from(self.identity().capacities.window).max(1);
        let timeout = self.line.settings.response_timeout;
        let mut flights: Vec<Flight> = Vec::new();
        let mut next = 0u8;
        loop {
            self.line.check_interrupt()?;
            progress(Progress {
                arrived: u32::from(arrived.blocks).saturating_sub(arrived.missing()),
                blocks: u32::from(arrived.blocks),
            });
            while flights.len() < window && next < arrived.blocks {
                let block = next;
                next += 1;
                if !arrived.has(block) {
                    let sequence = self.line.next_sequence();
                    self.send_block(sequence, tag, block, trajectory, uploaded)?;
                    let deadline = self.line.transport.now() + timeout;
                    let attempts = 1;
                    flights.push(Flight {
                        sequence,
                        block,
                        deadline,
                        attempts,
                    });
                }
            }
            let Some(deadline) = flights.iter().map(|flight| flight.deadline).min() else {
                return Ok(());
            };
            match self.line.receive(deadline, false)? {
                Some((sequence, response)) => {
                    let Some(index) = flights.iter().position(|f| f.sequence == sequence) else {
                        self.line.receiver.reception.late += 1;
                        continue;
                    };
                    match response {
                        Response::Upload(now) if now.tag == tag => {
                            arrived.bits |= now.bits;
                            flights.remove(index);
                        }
                        Response::Upload(_) => {
                            return Err(DeviceError::Unexpected { request: "Upload" });
                        }
                        Response::Denied(denial) => return Err(DeviceError::Denied(denial)),
                        _ => self.line.receiver.reception.late += 1,
                    }
                }
                None => {
                    let now = self.line.transport.now();
                    for flight in flights.iter_mut().filter(|flight| flight.deadline <= now) {
                        if flight.attempts >= self.line.settings.attempts {
                            return Err(DeviceError::Unanswered {
                                attempts: flight.attempts,
                                waited: timeout * flight.attempts,
                            });
                        }
                        flight.attempts += 1;
                        flight.deadline = now + timeout;
                        self.send_block(flight.sequence, tag, flight.block, trajectory, uploaded)?;
                    }
                }
            }
        }
    }

    fn send_block(
        &mut self,
        sequence: u16,
        tag: u32,
        block: u8,
        trajectory: &Trajectory,
        uploaded: &mut Uploaded,
    ) -> Result<(), DeviceError> {
        let values = assembly::block(trajectory, block).iter();
        let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
        uploaded.sent += 1;
        let values = &bytes;
        self.line.send(
            sequence,
            &Request::UploadBlock(Block { tag, block, values }),
        )
    }
}

/// Whether an error says nothing about the trajectory, so that the upload can be taken up again: the line failed, the
/// board was restarted, or another upload came in between.
fn is_of_the_line(error: &DeviceError) -> bool {
    match error {
        DeviceError::Transport(_)
        | DeviceError::Unanswered { .. }
        | DeviceError::SessionLost { .. }
        | DeviceError::Denied(Denial::Session { .. } | Denial::Overtaken { .. }) => true,
        DeviceError::Denied(Denial::Executor(Refusal::Upload(error))) => matches!(
            error,
            AssemblyError::NothingBegun
                | AssemblyError::OtherTag { .. }
                | AssemblyError::Missing(_)
        ),
        _ => false,
    }
}
