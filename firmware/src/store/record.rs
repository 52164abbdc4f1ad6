//! How sectors and records of the log lie in flash.
//!
//! All words are little-endian. A sector begins with a head of 4 words, which is programmed *last*
//! when the sector is taken into use: it turns everything behind it valid at once.
//!
//! | word | sector | record |
//! |---|---|---|
//! | 0 | [`SECTOR_MAGIC`] | [`RECORD_MAGIC`] in the upper half, kind, format of the data |
//! | 1 | generation: one more than the other sector's | key |
//! | 2 | [`LAYOUT_VERSION`] | length of the data in bytes; [`DELETED`] if the key is deleted |
//! | 3 | CRC-32 of words 0 to 2 | CRC-32 of the data |
//! | 4 | – | CRC-32 of words 0 to 3 |
//!
//! A record's data follow its head, filled up to whole words with ones.

use stillpoint_shared::crc::Crc32;

use super::flash::BLANK;

/// First word of a sector in use: "SPLG".
const SECTOR_MAGIC: u32 = u32::from_le_bytes(*b"SPLG");

/// Version of this layout.
const LAYOUT_VERSION: u32 = 1;

/// Upper half of a record's first word.
const RECORD_MAGIC: u32 = 0x5250_0000;

/// Length that marks a key as deleted.
const DELETED: u32 = BLANK - 1;

/// Bytes of a sector's head.
pub(super) const SECTOR_HEAD_BYTES: usize = 16;

/// Bytes of a record's head.
pub(super) const RECORD_HEAD_BYTES: usize = 20;

/// CRC-32 of words.
fn check_sum(words: &[u32]) -> u32 {
    let mut crc = Crc32::new();
    for word in words {
        crc.update(&word.to_le_bytes());
    }
    crc.sum()
}

/// The words at the beginning of `bytes`; blank where they end.
fn words<const N: usize>(bytes: &[u8]) -> [u32; N] {
    let mut words = [BLANK; N];
    for (word, &four) in words.iter_mut().zip(bytes.as_chunks().0) {
        *word = u32::from_le_bytes(four);
    }
    words
}

/// Words of the head of a sector of this generation.
pub(super) fn sector_head(generation: u32) -> [u32; 4] {
    let [magic, version] = [SECTOR_MAGIC, LAYOUT_VERSION];
    let sum = check_sum(&[magic, generation, version]);
    [magic, generation, version, sum]
}

/// Generation of a sector, if its head is sound.
pub(super) fn generation(sector: &[u8]) -> Option<u32> {
    let head: [_; 4] = words(sector);
    let [_, generation, ..] = head;
    (head == sector_head(generation)).then_some(generation)
}

/// What a record is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Key {
    /// Kind of the data.
    pub(super) kind: u8,
    /// Which one of this kind.
    pub(super) key: u32,
}

/// Head of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordHead {
    /// What it is about.
    pub(super) key: Key,
    /// Version of the data's format.
    pub(super) format: u8,
    /// Length of the data in bytes; none if the key is deleted.
    pub(super) length: Option<u32>,
    /// CRC-32 of the data.
    pub(super) check_sum: u32,
}

/// What lies at a place where a record may begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing yet.
    Blank,
    /// The sound head of a record.
    Record(RecordHead),
    /// A head that was not finished, or is damaged.
    Broken,
}

impl RecordHead {
    /// Its words.
    pub(super) fn to_words(self) -> [u32; 5] {
        let kind = RECORD_MAGIC | u32::from(self.key.kind) << 8 | u32::from(self.format);
        let length = self.length.unwrap_or(DELETED);
        let head = [kind, self.key.key, length, self.check_sum];
        let [a, b, c, d] = head;
        [a, b, c, d, check_sum(&head)]
    }

    /// What lies at the beginning of `bytes`.
    pub(super) fn find(bytes: &[u8]) -> Found {
        let found = words(bytes);
        let [kind, key, length, check_sum, _] = found;
        if found == [BLANK; 5] {
            return Found::Blank;
        }
        let [format, kind, ..] = kind.to_le_bytes();
        let head = Self {
            key: Key { kind, key },
            format,
            length: (length != DELETED).then_some(length),
            check_sum,
        };
        if found == head.to_words() {
            Found::Record(head)
        } else {
            Found::Broken
        }
    }

    /// Bytes of head and data in flash.
    pub(super) fn bytes(self) -> usize {
        RECORD_HEAD_BYTES + padded(self.length.unwrap_or(0) as usize)
    }
}

/// A number of bytes filled up to whole words.
pub(super) fn padded(bytes: usize) -> usize {
    bytes.saturating_add(3) & !3
}
