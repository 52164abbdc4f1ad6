//! CRC-64/XZ over postcard bytes, computed while they are made, so that no buffer is needed.

use serde::Serialize;

use crate::crc::Crc64;
use crate::encode::encode;

/// CRC-64/XZ of `value`'s postcard bytes.
///
/// Only a type without a known length can fail to serialise here; it would hash to 0.
pub fn of<T: Serialize + ?Sized>(value: &T) -> u64 {
    let mut crc = Crc64::new();
    let whole = encode(value, &mut |piece| {
        crc.update(piece);
        true
    });
    if whole { crc.sum() } else { 0 }
}

/// CRC-64/XZ of bytes.
pub fn of_bytes(bytes: &[u8]) -> u64 {
    let mut crc = Crc64::new();
    crc.update(bytes);
    crc.sum()
}
