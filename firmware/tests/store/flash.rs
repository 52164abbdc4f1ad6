//! A flash memory that loses power at a chosen moment.

use std::cell::Cell;

use stillpoint_firmware::store::flash::{Flash, FlashError};

pub(crate) const SECTORS: usize = 4;

/// SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Debug, Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub(crate) fn below(&mut self, most: usize) -> usize {
        (self.bits() % most as u64) as usize
    }
}

/// Flash whose power goes in the middle of an operation.
#[derive(Debug, Clone)]
pub(crate) struct CutFlash {
    sectors: Vec<Vec<u8>>,
    /// Operations left before the one that is cut; none for no cut.
    pub(crate) left: Option<usize>,
    /// What a cut leaves.
    pub(crate) random: Random,
    /// Operations begun so far.
    pub(crate) operations: usize,
    pub(crate) erases: usize,
    /// A word that cannot be programmed.
    pub(crate) worn: Option<(u8, usize)>,
    dark: Cell<bool>,
}

impl CutFlash {
    pub(crate) fn new(bytes: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        // As it may come: whatever was there before.
        let sectors = (0..SECTORS)
            .map(|_| (0..bytes).map(|_| random.bits() as u8).collect())
            .collect();
        Self {
            sectors,
            left: None,
            random,
            operations: 0,
            erases: 0,
            worn: None,
            dark: Cell::new(false),
        }
    }

    /// The same content with power, without a cut to come.
    pub(crate) fn powered(mut self) -> Self {
        self.left = None;
        self.dark.set(false);
        self
    }

    pub(crate) fn is_dark(&self) -> bool {
        self.dark.get()
    }

    /// Whether this operation is cut; none if the power is gone already.
    fn begin(&mut self) -> Option<bool> {
        if self.dark.get() {
            return None;
        }
        self.operations += 1;
        let cut = self.left == Some(0);
        self.left = self.left.and_then(|left| left.checked_sub(1));
        self.dark.set(cut);
        Some(cut)
    }
}

impl Flash for CutFlash {
    fn sector_bytes(&self) -> usize {
        self.sectors[0].len()
    }

    fn sector(&self, sector: u8) -> &[u8] {
        self.sectors
            .get(usize::from(sector))
            .map_or(&[], Vec::as_slice)
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        let dark = FlashError { sector, offset: 0 };
        let cut = self.begin().ok_or(dark)?;
        self.erases += 1;
        let progress = if cut { self.random.below(5) } else { 4 };
        for byte in &mut self.sectors[usize::from(sector)] {
            // From untouched over random bits to almost done.
            let random = self.random.bits() as u8;
            *byte = match progress {
                0 => *byte,
                1 => *byte | random,
                2 => random,
                3 => !(1 << (random & 7)),
                _ => 0xff,
            };
        }
        if cut { Err(dark) } else { Ok(()) }
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        let dark = FlashError { sector, offset };
        let cut = self.begin().ok_or(dark)?;
        assert_eq!(offset % 4, 0);
        let place = &mut self.sectors[usize::from(sector)][offset..offset + 4];
        let before = u32::from_le_bytes((&*place).try_into().unwrap());
        assert_eq!(
            before,
            u32::MAX,
            "sector {sector}, offset {offset}: programmed twice"
        );
        let mut after = before & word;
        if cut {
            // Not at all, in part, or just so.
            after |= match self.random.below(4) {
                0 => u32::MAX,
                1 => 0,
                _ => self.random.bits() as u32,
            };
        }
        if self.worn == Some((sector, offset)) {
            after = u32::MAX;
        }
        place.copy_from_slice(&after.to_le_bytes());
        if cut { Err(dark) } else { Ok(()) }
    }
}
