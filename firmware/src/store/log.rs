//! A log of records in two sectors of flash, whole after a loss of power at any moment.
//!
//! A record is appended behind the last one; the newest of a key counts. When the sector is full,
//! the records that count are copied into the other sector, the new one among them, and the head of
//! that sector is programmed last. Until then the old sector holds all it held; from then on the new
//! one has the greater generation. So an update is seen by a mount afterwards either whole or not
//! at all:
//!
//! - A head or data that were cut off have a wrong check sum. Behind a broken head nothing is
//!   written any more: the next record moves to the other sector.
//! - An erase that was cut off hits only the sector that does not count, and is done again.
//!
//! Most updates erase nothing, which would stop the board for up to 2 s.

use heapless::Vec;
use stillpoint_shared::Trajectory;
use stillpoint_shared::crc::Crc32;
use stillpoint_shared::protocol::{MAX_STORED, StoreError};

use super::flash::{BLANK, Flash, FlashError};
use super::record::{self, Found, Key, RECORD_HEAD_BYTES, RecordHead, SECTOR_HEAD_BYTES, padded};

/// A record that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) head: RecordHead,
    offset: usize,
}

/// A log with at most [`MAX_STORED`] keys.
#[derive(Debug, Clone)]
pub(super) struct Log {
    sectors: [u8; 2],
    /// Index of the sector that counts and its generation; none if neither is in use.
    active: Option<(usize, u32)>,
    /// Where the next record goes; none if it has to move to the other sector.
    end: Option<usize>,
    entries: Vec<Entry, MAX_STORED>,
}

/// Data of a record to be written.
#[derive(Debug, Clone, Copy)]
pub(super) enum Data<'a> {
    Bytes(&'a [u8]),
    Move(&'a Trajectory),
}

impl Data<'_> {
    /// Writes the bytes into a sink piece by piece, each time the same, until it takes no more.
    #[inline(never)]
    fn write(self, sink: &mut dyn FnMut(&[u8]) -> bool) {
        match self {
            Self::Bytes(bytes) => _ = sink(bytes),
            Self::Move(trajectory) => _ = trajectory.encode_into(sink),
        }
    }
}

impl From<FlashError> for Stop {
    fn from(FlashError { sector, offset }: FlashError) -> Self {
        Self(StoreError::Flash {
            sector,
            offset: offset as u32,
        })
    }
}

/// An error on the way, so that `?` takes those of the flash.
struct Stop(StoreError);

impl Log {
    /// Reads what is there. The work is one check sum over the sector that counts.
    pub(super) fn mount<F: Flash>(flash: &F, sectors: [u8; 2]) -> Self {
        let generations = sectors.map(|sector| record::generation(flash.sector(sector)));
        let active = match generations {
            [Some(first), Some(second)] if second > first => Some((1, second)),
            [Some(first), _] => Some((0, first)),
            [None, Some(second)] => Some((1, second)),
            [None, None] => None,
        };
        let mut log = Self {
            sectors,
            active,
            end: None,
            entries: Vec::new(),
        };
        log.scan(flash);
        log
    }

    /// Goes through the records of the sector that counts. Each takes 20 bytes at least, so the
    /// loop is bounded by the sector.
    fn scan<F: Flash>(&mut self, flash: &F) {
        let Some(sector) = self.active_sector() else {
            return;
        };
        let bytes = flash.sector(sector);
        let mut offset = SECTOR_HEAD_BYTES;
        while let Some(rest) = bytes.get(offset..) {
            let head = match RecordHead::find(rest) {
                Found::Record(head) => head,
                Found::Blank => {
                    // What a cut head would have left further on is not overwritten.
                    let (words, last) = rest.as_chunks::<4>();
                    let blank = words.iter().all(|&word| u32::from_ne_bytes(word) == BLANK)
                        && last.iter().all(|&byte| byte == 0xff);
                    self.end = blank.then_some(offset);
                    return;
                }
                Found::Broken => return,
            };
            let entry = Entry { head, offset };
            let sound = match entry.data(bytes) {
                Some(data) => Crc32::of(data) == head.check_sum,
                None => head.length.is_none(),
            };
            if sound {
                self.note(entry);
            }
            offset = offset.saturating_add(head.bytes());
        }
    }

    fn active_sector(&self) -> Option<u8> {
        self.sectors.get(self.active?.0).copied()
    }

    /// Lets a record count in place of an older one. One key too many cannot come: none is
    /// written.
    fn note(&mut self, entry: Entry) {
        self.entries
            .retain(|other| other.head.key != entry.head.key);
        if entry.head.length.is_some() {
            let _ = self.entries.push(entry);
        }
    }

    /// The records that count, oldest first.
    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Data of a record that counts.
    pub(super) fn data<'f, F: Flash>(&self, flash: &'f F, entry: &Entry) -> Option<&'f [u8]> {
        entry.data(flash.sector(self.active_sector()?))
    }

    /// Writes a record in place of the one with its key.
    pub(super) fn put<F: Flash>(
        &mut self,
        flash: &mut F,
        key: Key,
        format: u8,
        data: Data<'_>,
    ) -> Result<(), StoreError> {
        let mut crc = Crc32::new();
        let mut length = 0;
        data.write(&mut |piece| {
            crc.update(piece);
            length += piece.len();
            true
        });
        let head = RecordHead {
            key,
            format,
            length: Some(length as u32),
            check_sum: crc.sum(),
        };
        if self.entries.is_full() && !self.entries.iter().any(|entry| entry.head.key == key) {
            return Err(StoreError::TooMany {
                most: MAX_STORED as u8,
            });
        }
        self.update(flash, head, data)
    }

    /// Deletes a key, if it is there.
    pub(super) fn delete<F: Flash>(&mut self, flash: &mut F, key: Key) -> Result<(), StoreError> {
        if !self.entries.iter().any(|entry| entry.head.key == key) {
            return Ok(());
        }
        let head = RecordHead {
            key,
            format: 0,
            length: None,
            check_sum: Crc32::of(&[]),
        };
        self.update(flash, head, Data::Bytes(&[]))
    }

    /// Bytes for records in a sector.
    fn capacity<F: Flash>(flash: &F) -> usize {
        flash.sector_bytes().saturating_sub(SECTOR_HEAD_BYTES)
    }

    fn update<F: Flash>(
        &mut self,
        flash: &mut F,
        head: RecordHead,
        data: Data<'_>,
    ) -> Result<(), StoreError> {
        let done = match (self.active_sector(), self.end) {
            (Some(sector), Some(offset))
                if offset.saturating_add(head.bytes()) <= flash.sector_bytes() =>
            {
                // Whatever happens, nothing else is appended behind what is begun here.
                self.end = None;
                program_record(flash, sector, offset, head, data).map(|()| {
                    self.note(Entry { head, offset });
                    self.end = Some(offset + head.bytes());
                })
            }
            _ => self.move_over(flash, head, data),
        };
        done.map_err(|Stop(error)| error)
    }

    /// Copies what counts into the other sector, with the new record in place of the old one.
    fn move_over<F: Flash>(
        &mut self,
        flash: &mut F,
        head: RecordHead,
        data: Data<'_>,
    ) -> Result<(), Stop> {
        let others = || {
            let entries = self.entries.iter();
            entries.filter(|entry| entry.head.key != head.key)
        };
        let used = others().map(|entry| entry.head.bytes()).sum();
        let available = Self::capacity(flash).saturating_sub(used);
        if head.bytes() > available {
            return Err(Stop(StoreError::NoRoom {
                needed: head.bytes() as u32,
                available: available as u32,
            }));
        }

        let (to_index, generation) = match self.active {
            Some((index, generation)) => (1 - index.min(1), generation.saturating_add(1)),
            None => (0, 1),
        };
        let [first, second] = self.sectors;
        let (from, to) = if to_index == 0 {
            (second, first)
        } else {
            (first, second)
        };
        flash.erase(to)?;
        let mut moved = Vec::<Entry, MAX_STORED>::new();
        let mut offset = SECTOR_HEAD_BYTES;
        for entry in others() {
            for word in (0..entry.head.bytes()).step_by(4) {
                let found = word_at(flash.sector(from), entry.offset + word);
                program(flash, to, offset + word, found)?;
            }
            let head = entry.head;
            let _ = moved.push(Entry { head, offset });
            offset += head.bytes();
        }
        if head.length.is_some() {
            program_record(flash, to, offset, head, data)?;
            let _ = moved.push(Entry { head, offset });
            offset += head.bytes();
        }
        for (word, value) in record::sector_head(generation).into_iter().enumerate() {
            program(flash, to, 4 * word, value)?;
        }
        self.active = Some((to_index, generation));
        self.entries = moved;
        self.end = Some(offset);
        Ok(())
    }
}

impl Entry {
    /// Its data in the bytes of its sector; none if the key is deleted or it ends beyond.
    fn data<'f>(&self, sector: &'f [u8]) -> Option<&'f [u8]> {
        let data = sector.get(self.offset.checked_add(RECORD_HEAD_BYTES)?..)?;
        data.get(..self.head.length? as usize)
    }
}

/// The word at an offset; blank beyond the end.
fn word_at(sector: &[u8], offset: usize) -> u32 {
    let bytes = sector.get(offset..).and_then(<[u8]>::first_chunk);
    bytes.map_or(BLANK, |&four| u32::from_le_bytes(four))
}

/// Programs a word and reads it back.
fn program<F: Flash>(
    flash: &mut F,
    sector: u8,
    offset: usize,
    word: u32,
) -> Result<(), FlashError> {
    flash.program(sector, offset, word)?;
    if word_at(flash.sector(sector), offset) == word {
        Ok(())
    } else {
        Err(FlashError { sector, offset })
    }
}

/// Programs head and data.
fn program_record<F: Flash>(
    flash: &mut F,
    sector: u8,
    mut offset: usize,
    head: RecordHead,
    data: Data<'_>,
) -> Result<(), Stop> {
    for word in head.to_words() {
        program(flash, sector, offset, word)?;
        offset += 4;
    }
    let end = offset + padded(head.length.unwrap_or(0) as usize);
    let mut result = Ok(());
    let (mut word, mut filled) = ([0xff; 4], 0);
    data.write(&mut |piece| {
        for &byte in piece {
            if let Some(place) = word.get_mut(filled) {
                *place = byte;
            }
            filled += 1;
            if filled == word.len() && offset < end {
                result = program(flash, sector, offset, u32::from_le_bytes(word));
                (word, filled) = ([0xff; 4], 0);
                offset += 4;
            }
            if result.is_err() {
                return false;
            }
        }
        true
    });
    result?;
    if filled > 0 && offset < end {
        program(flash, sector, offset, u32::from_le_bytes(word))?;
    }
    Ok(())
}
