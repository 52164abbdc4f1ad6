//! CRC-64/XZ over postcard bytes, computed while they are made, so that no buffer is needed.

use crc::{CRC_64_XZ, Crc, Digest};
use postcard::ser_flavors::Flavor;
use serde::Serialize;

static CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

struct Hasher(Digest<'static, u64>);

impl Flavor for Hasher {
    type Output = u64;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.update(&[byte]);
        Ok(())
    }

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
