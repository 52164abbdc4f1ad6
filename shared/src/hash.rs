//! CRC-64/XZ over postcard bytes, computed while they are made, so that no buffer is needed; and the
//! CRC-32 of frames and of the store.

use crc::{CRC_32_ISO_HDLC, CRC_64_XZ, Crc};
use serde::Serialize;

use crate::encode::encode;

static CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// CRC-32/ISO-HDLC, for frames and for what is stored. One table for both: 1 kB of a board's flash.
pub static CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-64/XZ of `value`'s postcard bytes.
///
/// Only a type without a known length can fail to serialise here; it would hash to 0.
pub fn of<T: Serialize + ?Sized>(value: &T) -> u64 {
    let mut digest = CRC.digest();
    let whole = encode(value, &mut |piece| {
        digest.update(piece);
        true
    });
    if whole { digest.finalize() } else { 0 }
}

/// CRC-64/XZ of bytes.
pub fn of_bytes(bytes: &[u8]) -> u64 {
    CRC.checksum(bytes)
}
