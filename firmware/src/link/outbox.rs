//! Frames on their way to the host.

use stillpoint_shared::protocol::{Envelope, MAX_FRAME_BYTES, Message};

/// Room for a response while another one, or telemetry, is being sent.
const BYTES: usize = 2 * MAX_FRAME_BYTES;

/// Bytes to be sent, in order.
#[derive(Debug)]
pub(super) struct Outbox {
    bytes: [u8; BYTES],
    start: usize,
    end: usize,
}

impl Outbox {
    pub(super) const fn new() -> Self {
        Self {
            bytes: [0; BYTES],
            start: 0,
            end: 0,
        }
    }

    /// Bytes that can be added. The place of what is sent is free again when all is.
    pub(super) fn room(&self) -> usize {
        BYTES.saturating_sub(self.end)
    }

    /// Adds a frame; false, and nothing is added, if it does not fit.
    pub(super) fn push(&mut self, envelope: Envelope, message: &Message) -> bool {
        let free = self.bytes.get_mut(self.end..).unwrap_or_default();
        match message.encode(envelope, free) {
            Ok(frame) => {
                self.end += frame.len();
                true
            }
            Err(_) => false,
        }
    }

    /// The bytes to be sent next.
    pub(super) fn pending(&self) -> &[u8] {
        self.bytes.get(self.start..self.end).unwrap_or_default()
    }

    /// Takes the first `count` of them as sent.
    pub(super) fn sent(&mut self, count: usize) {
        self.start = self.start.saturating_add(count);
        if self.start >= self.end {
            (self.start, self.end) = (0, 0);
        }
    }
}
