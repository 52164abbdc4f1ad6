//! The check sums against another implementation of the same standards.

use crc::{CRC_32_ISO_HDLC, CRC_64_XZ, Crc};
use proptest::prelude::*;
use stillpoint_shared::crc::Crc32;
use stillpoint_shared::hash;

proptest! {
    #[test]
    fn the_check_sums_are_the_standards(bytes: Vec<u8>, cut in 0usize..100) {
        let expected = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes);
        let (first, second) = bytes.split_at(cut.min(bytes.len()));
        let mut crc = Crc32::new();
        crc.update(first);
        crc.update(second);
        prop_assert_eq!((crc.sum(), Crc32::of(&bytes)), (expected, expected));
        let expected = Crc::<u64>::new(&CRC_64_XZ).checksum(&bytes);
        prop_assert_eq!(hash::of_bytes(&bytes), expected);
    }
}
