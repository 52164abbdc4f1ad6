//! What the store asks of a flash memory, and one in RAM.

/// Value of a word that is erased.
pub const BLANK: u32 = u32::MAX;

/// A flash memory in sectors of one size, mapped into memory.
///
/// Erasing sets all bits of a sector to 1, programming a word sets some to 0; nothing else can be
/// written. Each may be cut off by a loss of power at any moment: a word is then programmed in
/// part, a sector erased in part, to any bits.
///
/// On a part with a single bank, reading code from flash waits while it is erased or programmed, up
/// to 2 s for 128 KiB (STM32F405 data sheet, "Flash memory characteristics"): no drive loop runs
/// meanwhile, so the link asks the executor first.
pub trait Flash {
    /// Number of bytes in every sector, a multiple of 4.
    fn sector_bytes(&self) -> usize;

    /// Content of a sector; empty if there is none of this number.
    fn sector(&self, sector: u8) -> &[u8];

    /// Erases a sector.
    fn erase(&mut self, sector: u8) -> Result<(), FlashError>;

    /// Programs the word at `offset`, a multiple of 4, little-endian. It has been blank until now.
    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError>;
}

impl<F: Flash + ?Sized> Flash for &mut F {
    fn sector_bytes(&self) -> usize {
        (**self).sector_bytes()
    }

    fn sector(&self, sector: u8) -> &[u8] {
        (**self).sector(sector)
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        (**self).erase(sector)
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        (**self).program(sector, offset, word)
    }
}

/// The flash did not erase or program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FlashError {
    /// Sector.
    pub sector: u8,
    /// Offset in the sector, in bytes.
    pub offset: usize,
}

/// SECTORS sectors of BYTES bytes in RAM, blank at first: for boards without a flash to write, and
/// for simulation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RamFlash<const SECTORS: usize, const BYTES: usize> {
    sectors: [[u8; BYTES]; SECTORS],
}

impl<const SECTORS: usize, const BYTES: usize> Default for RamFlash<SECTORS, BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const SECTORS: usize, const BYTES: usize> RamFlash<SECTORS, BYTES> {
    /// A blank flash.
    pub const fn new() -> Self {
        Self {
            sectors: [[0xff; BYTES]; SECTORS],
        }
    }
}

impl<const SECTORS: usize, const BYTES: usize> Flash for RamFlash<SECTORS, BYTES> {
    fn sector_bytes(&self) -> usize {
        BYTES
    }

    fn sector(&self, sector: u8) -> &[u8] {
        self.sectors
            .get(usize::from(sector))
            .map_or(&[], <[u8; BYTES]>::as_slice)
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        let place = self.sectors.get_mut(usize::from(sector));
        let place = place.ok_or(FlashError { sector, offset: 0 })?;
        place.fill(0xff);
        Ok(())
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        let place = self.sectors.get_mut(usize::from(sector));
        let place = place.and_then(|sector| sector.get_mut(offset..)?.first_chunk_mut());
        let place: &mut [u8; 4] = place.ok_or(FlashError { sector, offset })?;
        *place = (u32::from_le_bytes(*place) & word).to_le_bytes();
        Ok(())
    }
}
