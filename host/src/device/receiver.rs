//! Frames out of the bytes that arrive.

use super::transport::{Transport, TransportError};
use std::collections::VecDeque;
use std::time::Duration;
use stillpoint_shared::protocol::{Envelope, FrameDecoder, Message, Telemetry, frame};

/// Most samples of telemetry that are kept for a program that does not ask for them.
const MOST_KEPT: usize = 100_000;

/// Counters of what arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// Messages that were understood.
    pub messages: u64,
    /// Frames that were damaged.
    pub damaged: u64,
    /// Sound frames that were not understood.
    pub not_understood: u64,
    /// Responses that nobody waited for: late ones, repetitions.
    pub late: u64,
}

/// A sample of telemetry with its place in the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// The sample.
    pub telemetry: Telemetry,
    /// Samples lost on the line just before this one.
    pub lost: u16,
}

/// Puts messages together and keeps telemetry for later.
#[derive(Debug, Default)]
pub(super) struct Receiver {
    decoder: FrameDecoder,
    bytes: VecDeque<u8>,
    pub(super) telemetry: VecDeque<Received>,
    last_sequence: Option<u16>,
    pub(super) reception: Reception,
}

impl Receiver {
    /// Forgets what belongs to an earlier session.
    pub(super) fn restart(&mut self) {
        self.decoder = FrameDecoder::new();
        self.bytes.clear();
        self.telemetry.clear();
        self.last_sequence = None;
    }

    /// Waits until `deadline` for a message; telemetry of this session is put aside and not returned, but ends the
    /// wait if `for_telemetry`.
    pub(super) fn next(
        &mut self,
        transport: &mut impl Transport,
        session: u16,
        deadline: Duration,
        for_telemetry: bool,
    ) -> Result<Option<(Envelope, Message)>, TransportError> {
        loop {
            while let Some(byte) = self.bytes.pop_front() {
                let Some(payload) = self.decoder.feed(byte) else {
                    continue;
                };
                let opened = payload.and_then(frame::open);
                let Ok((envelope, body)) = opened else {
                    self.reception.damaged += 1;
                    continue;
                };
                match frame::read(body) {
                    Err(_) => self.reception.not_understood += 1,
                    Ok(Message::Telemetry(telemetry)) => {
                        self.reception.messages += 1;
                        if envelope.session == session {
                            self.keep(envelope.sequence, telemetry);
                            if for_telemetry {
                                return Ok(None);
                            }
                        }
                    }
                    Ok(message) => {
                        self.reception.messages += 1;
                        return Ok(Some((envelope, message)));
                    }
                }
            }
            let now = transport.now();
            if now >= deadline {
                return Ok(None);
            }
            let mut buffer = [0; 4096];
            let count = transport.receive(&mut buffer, deadline - now)?;
            self.bytes.extend(&buffer[..count]);
        }
    }

    fn keep(&mut self, sequence: u16, telemetry: Telemetry) {
        let expected = self
            .last_sequence
            .map_or(sequence, |last| last.wrapping_add(1));
        let lost = sequence.wrapping_sub(expected);
        // One that was overtaken on the line is no gap of 65,535.
        let lost = if lost > u16::MAX / 2 { 0 } else { lost };
        self.last_sequence = Some(sequence);
        if self.telemetry.len() == MOST_KEPT {
            self.telemetry.pop_front();
        }
        self.telemetry.push_back(Received { telemetry, lost });
    }
}
