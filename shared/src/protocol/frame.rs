//! Frames: how messages lie on a stream of bytes.
//!
//! ```text
//! frame   = COBS(payload ‖ CRC-32 of the payload, little-endian) ‖ 0x00
//! payload = postcard(session: u16) ‖ postcard(sequence: u16) ‖ postcard(Request or Message)
//! ```
//!
//! Inside a frame no byte is zero, so a receiver that lost bytes is whole again after the next zero
//! (Cheshire and Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Transactions on Networking 7
//! (1999)). The check sum is CRC-32/ISO-HDLC; up to 11 kB it finds any three wrong bits and any
//! burst of 32.
//!
//! The frame, [`Envelope`] and the two variants of [`Hello`](super::Hello) are the same in every
//! version of the protocol.

use core::fmt;

use cobs::{DecodeResult, DecoderState, EncoderState, PushResult};
use serde::{Deserialize, Serialize};

use crate::crc::Crc32;
use crate::{decode, encode};

/// Most bytes of a payload.
pub const MAX_PAYLOAD_BYTES: usize = 536;

const CRC_BYTES: usize = 4;

/// Most bytes of a frame, the closing zero included.
pub const MAX_FRAME_BYTES: usize =
    MAX_PAYLOAD_BYTES + CRC_BYTES + (MAX_PAYLOAD_BYTES + CRC_BYTES).div_ceil(254) + 1;

/// What stands before every request and message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Envelope {
    /// The session that the board opened at `Hello`; 0 in a `Hello`.
    pub session: u16,
    /// In a request: one more than in the request before, or the same when it is sent again. In a
    /// response: the request's. In telemetry: one more than in the telemetry before.
    pub sequence: u16,
}

/// Why bytes are no message, or a message no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// The stuffing of the zeros is wrong: bytes were lost.
    Stuffing {
        /// Bytes up to there.
        bytes: usize,
    },
    /// The frame is longer than any that is sent.
    TooLong {
        /// Most bytes possible.
        most: usize,
    },
    /// The check sum is wrong, or the frame too short to have one.
    CheckSum {
        /// Bytes of payload and check sum.
        bytes: usize,
    },
    /// The payload is sound but no such message.
    Body {
        /// Bytes of the payload.
        bytes: usize,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Stuffing { bytes } => {
                write!(f, "bytes were lost on the line, after {bytes} of a frame")
            }
            Self::TooLong { most } => {
                write!(
                    f,
                    "a frame is longer than {most} bytes: keep messages shorter, or check who else sends"
                )
            }
            Self::CheckSum { bytes } => {
                write!(
                    f,
                    "a frame of {bytes} bytes was damaged on the line: check cable and rate"
                )
            }
            Self::Body { bytes } => write!(
                f,
                "a message of {bytes} bytes is not understood: use the same version on both sides"
            ),
        }
    }
}

impl core::error::Error for FrameError {}

/// COBS into a buffer; `None` where it is full. Postcard's own has assertions that the compiler
/// cannot see through, and a board's image has no panic in it.
struct Stuffed<'b> {
    state: EncoderState,
    buffer: &'b mut [u8],
    end: usize,
}

impl<'b> Stuffed<'b> {
    fn new(buffer: &'b mut [u8]) -> Option<Self> {
        let mut stuffed = Self {
            state: EncoderState::default(),
            buffer,
            end: 0,
        };
        stuffed.append(0)?;
        Some(stuffed)
    }

    fn push(&mut self, byte: u8) -> Option<()> {
        match self.state.push(byte) {
            PushResult::AddSingle(byte) => self.append(byte),
            PushResult::ModifyFromStartAndSkip((place, code)) => {
                *self.buffer.get_mut(place)? = code;
                self.append(0)
            }
            PushResult::ModifyFromStartAndPushAndSkip((place, code, byte)) => {
                *self.buffer.get_mut(place)? = code;
                self.append(byte)?;
                self.append(0)
            }
        }
    }

    fn extend(&mut self, bytes: &[u8]) -> Option<()> {
        for &byte in bytes {
            self.push(byte)?;
        }
        Some(())
    }

    fn append(&mut self, byte: u8) -> Option<()> {
        *self.buffer.get_mut(self.end)? = byte;
        self.end += 1;
        Some(())
    }

    fn finish(mut self) -> Option<&'b mut [u8]> {
        self.append(0)?;
        let (place, code) = self.state.finalize();
        *self.buffer.get_mut(place)? = code;
        self.buffer.get_mut(..self.end)
    }
}

/// Writes a frame into `buffer` and returns the part used; [`MAX_FRAME_BYTES`] are enough.
pub fn encode<'b, T: Serialize>(
    envelope: Envelope,
    body: &T,
    buffer: &'b mut [u8],
) -> Result<&'b mut [u8], FrameError> {
    let too_long = FrameError::TooLong {
        most: buffer.len().min(MAX_FRAME_BYTES),
    };
    let mut stuffed = Stuffed::new(buffer).ok_or(too_long)?;
    let mut crc = Crc32::new();
    let mut room = MAX_PAYLOAD_BYTES;
    let fits = encode::encode(&(envelope, body), &mut |piece| {
        crc.update(piece);
        let rest = room.checked_sub(piece.len());
        rest.is_some_and(|rest| {
            room = rest;
            stuffed.extend(piece).is_some()
        })
    });
    let check_sum = crc.sum().to_le_bytes();
    if !fits || stuffed.extend(&check_sum).is_none() {
        return Err(too_long);
    }
    stuffed.finish().ok_or(too_long)
}

/// Reads the envelope of a payload and returns the bytes of the body. Cannot fail on a payload that
/// [`encode()`] made.
pub fn open(payload: &[u8]) -> Result<(Envelope, &[u8]), FrameError> {
    let bytes = payload.len();
    decode::take(payload).map_err(|_| FrameError::Body { bytes })
}

/// Reads a body; no byte may be left over.
pub fn read<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, FrameError> {
    let bytes = body.len();
    match decode::take(body) {
        Ok((body, [])) => Ok(body),
        _ => Err(FrameError::Body { bytes }),
    }
}

/// Finds frames in a stream of bytes, one byte at a time.
#[derive(Debug)]
pub struct FrameDecoder {
    state: DecoderState,
    bytes: [u8; MAX_PAYLOAD_BYTES + CRC_BYTES],
    length: usize,
    overlong: bool,
}

impl Default for FrameDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameDecoder {
    /// A decoder that waits for a frame.
    pub const fn new() -> Self {
        Self {
            state: DecoderState::Idle,
            bytes: [0; MAX_PAYLOAD_BYTES + CRC_BYTES],
            length: 0,
            overlong: false,
        }
    }

    /// Takes a byte; at the end of a frame returns its payload, or what is wrong with it.
    ///
    /// Zeros between frames are no frames. The work for a byte is bounded, with one check sum at
    /// the end of a frame.
    pub fn feed(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(byte)) => {
                match self.bytes.get_mut(self.length) {
                    Some(place) => {
                        *place = byte;
                        self.length += 1;
                    }
                    None => self.overlong = true,
                }
                return None;
            }
            Ok(DecodeResult::DataComplete) => {}
            Err(_) => {
                let bytes = self.length;
                self.restart();
                return Some(Err(FrameError::Stuffing { bytes }));
            }
        }
        let (length, overlong) = (self.length, self.overlong);
        self.restart();
        if overlong {
            let most = MAX_FRAME_BYTES;
            return Some(Err(FrameError::TooLong { most }));
        }
        let whole = self.bytes.get(..length).unwrap_or_default();
        let damaged = FrameError::CheckSum { bytes: length };
        Some(match whole.split_last_chunk() {
            Some((payload, check_sum)) if Crc32::of(payload) == u32::from_le_bytes(*check_sum) => {
                Ok(payload)
            }
            _ => Err(damaged),
        })
    }

    fn restart(&mut self) {
        self.length = 0;
        self.overlong = false;
    }
}
