//! CRC-64/XZ over postcard bytes, computed while they are made, so that no buffer is needed; and the
//! CRC-32 of frames and of the store.

use crc::{CRC_32_ISO_HDLC, CRC_64_XZ, Crc, Digest};
use postcard::ser_flavors::Flavor;
use serde::Serialize;

static CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// CRC-32/ISO-HDLC, for frames and for what is stored. One table for both: 1 kB of a board's flash.
pub static CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

struct Hasher(Digest<'static, u64>);

impl Flavor for Hasher {
    type Output = u64;

    // Once in the image, and not at each of some dozen calls.
    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.update(&[byte]);
        Ok(())
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.0.update(bytes);
        Ok(())
    }

    fn finalize(self) -> postcard::Result<u64> {
        Ok(self.0.finalize())
    }
}

/// CRC-64/XZ of `value`'s postcard bytes.
///
/// Only a type without a known length can fail to serialise here; it would hash to 0.
pub fn of<T: Serialize + ?Sized>(value: &T) -> u64 {
    postcard::serialize_with_flavor(value, Hasher(CRC.digest())).unwrap_or_default()
}

/// CRC-64/XZ of bytes.
pub fn of_bytes(bytes: &[u8]) -> u64 {
    CRC.checksum(bytes)
}
