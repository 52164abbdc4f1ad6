//! SDO client for objects of up to four bytes (expedited transfer), one request at a time.
//!
//! | byte 0 | 1, 2 | 3 | 4 to 7 | meaning |
//! |---|---|---|---|---|
//! | 2Fh, 2Bh, 27h, 23h | index | sub-index | value | write 1, 2, 3, 4 bytes |
//! | 40h | index | sub-index | 0 | read |
//! | 60h | index | sub-index | 0 | answer: written |
//! | 4Fh, 4Bh, 47h, 43h | index | sub-index | value | answer: read 1, 2, 3, 4 bytes |
//! | 80h | index | sub-index | code | answer: refused |
//!
//! Multi-byte values are little-endian. Source: CiA 301, 7.2.4.3.

use super::abort::AbortCode;

/// An entry of the object dictionary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl core::fmt::Display for Object {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:04X}h:{:02X}h", self.index, self.sub)
    }
}

/// A value to be written, with its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Value {
    /// One byte.
    U8(u8),
    /// Two bytes.
    U16(u16),
    /// Four bytes.
    U32(u32),
}

/// What a request came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Answer {
    /// It is written.
    Written,
    /// The value that was read.
    Read(u32),
    /// The drive refuses.
    Refused(AbortCode),
    /// No answer came in time.
    Silent,
}

/// One SDO client.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Client {
    pending: Option<(Object, bool)>,
    waited_ticks: u16,
}

impl Client {
    /// Whether a request is waiting for its answer.
    pub(super) fn is_busy(&self) -> bool {
        self.pending.is_some()
    }

    /// Forgets the request.
    pub(super) fn abandon(&mut self) {
        self.pending = None;
    }

    /// The object that was asked for last and has not been answered.
    pub(super) fn pending(&self) -> Option<Object> {
        self.pending.map(|(object, _)| object)
    }

    /// A write request's eight bytes.
    pub(super) fn write(&mut self, object: Object, value: Value) -> [u8; 8] {
        let (command, value) = match value {
            Value::U8(value) => (0x2f, u32::from(value)),
            Value::U16(value) => (0x2b, u32::from(value)),
            Value::U32(value) => (0x23, value),
        };
        self.request(object, false, command, value)
    }

    /// A read request's eight bytes.
    pub(super) fn read(&mut self, object: Object) -> [u8; 8] {
        self.request(object, true, 0x40, 0)
    }

    fn request(&mut self, object: Object, read: bool, command: u8, value: u32) -> [u8; 8] {
        self.pending = Some((object, read));
        self.waited_ticks = 0;
        bytes(command, object, value)
    }

    /// Takes a message of the server; `None` if it does not answer the pending request.
    pub(super) fn receive(&mut self, data: &[u8]) -> Option<Answer> {
        let (pending, read) = self.pending?;
        let &[command, low, high, sub, b4, b5, b6, b7] = data else {
            return None;
        };
        let index = u16::from_le_bytes([low, high]);
        if (Object { index, sub }) != pending {
            return None;
        }
        let value = u32::from_le_bytes([b4, b5, b6, b7]);
        let answer = match (command, read) {
            (0x60, false) => Answer::Written,
            // What is beyond the size need not be 0.
            (0x43, true) => Answer::Read(value),
            (0x47, true) => Answer::Read(value & 0xff_ffff),
            (0x4b, true) => Answer::Read(value & 0xffff),
            (0x4f, true) => Answer::Read(value & 0xff),
            (0x80, _) => Answer::Refused(AbortCode(value)),
            // A longer object, which is none of those asked for.
            (0x41, true) => Answer::Refused(AbortCode::LENGTH),
            _ => return None,
        };
        self.pending = None;
        Some(answer)
    }

    /// One tick of waiting; `Silent` when it has been `timeout_ticks`.
    pub(super) fn tick(&mut self, timeout_ticks: u16) -> Option<Answer> {
        self.pending?;
        self.waited_ticks = self.waited_ticks.saturating_add(1);
        (self.waited_ticks >= timeout_ticks).then(|| {
            self.pending = None;
            Answer::Silent
        })
    }
}

fn bytes(command: u8, object: Object, value: u32) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [b4, b5, b6, b7] = value.to_le_bytes();
    [command, low, high, object.sub, b4, b5, b6, b7]
}
