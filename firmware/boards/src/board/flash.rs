//! The store's sectors of the internal flash: RM0090, section 3.6.
//!
//! There is one bank: while it is erased (1 to 2 s for a sector) or programmed (16 to 100 µs for a
//! word) the core stands still as soon as it needs an instruction.

use core::slice;

use stillpoint_firmware::store::Layout;
use stillpoint_firmware::store::flash::{Flash, FlashError};
use stm32f4::stm32f405::FLASH;

use super::watchdog::{self, Patience};

/// Sectors 8 to 11 are the store's; memory.x keeps code out of them.
pub const LAYOUT: Layout = Layout {
    moves: [10, 11],
    config: [8, 9],
};

const FIRST: u8 = 8;
const LAST: u8 = 11;
const FIRST_ADDRESS: usize = 0x0808_0000;
const SECTOR_BYTES: usize = 128 * 1024;

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// The store's sectors.
#[derive(Debug)]
pub struct Sectors(FLASH);

impl Sectors {
    /// Takes the flash controller.
    pub fn new(controller: FLASH) -> Self {
        Self(controller)
    }

    fn address(sector: u8) -> Option<usize> {
        let index = usize::from(sector.checked_sub(FIRST)?);
        (sector <= LAST).then_some(FIRST_ADDRESS + index * SECTOR_BYTES)
    }

    /// Runs `operation` with the controller unlocked and waits for its end.
    fn unlocked(&mut self, operation: impl FnOnce(&FLASH)) -> bool {
        let Self(controller) = self;
        for key in KEYS {
            // SAFETY: the keys of the manual.
            controller.keyr().write(|w| unsafe { w.key().bits(key) });
        }
        let done = ready(controller) && {
            // Ones clear the errors of earlier operations.
            controller.sr().write(|w| {
                w.eop().clear_bit_by_one();
                w.operr().clear_bit_by_one();
                w.wrperr().clear_bit_by_one();
                w.pgaerr().clear_bit_by_one();
                w.pgperr().clear_bit_by_one();
                w.pgserr().clear_bit_by_one()
            });
            operation(controller);
            cortex_m::asm::dsb();
            ready(controller)
        };
        let status = controller.sr().read();
        let failed = status.operr().bit()
            || status.wrperr().bit()
            || status.pgaerr().bit()
            || status.pgperr().bit()
            || status.pgserr().bit();
        controller.cr().write(|w| w.lock().set_bit());
        // The data cache may hold what was there before; it can be emptied while it is off only.
        controller.acr().modify(|_, w| w.dcen().clear_bit());
        controller.acr().modify(|_, w| w.dcrst().set_bit());
        controller.acr().modify(|_, w| w.dcrst().clear_bit());
        controller.acr().modify(|_, w| w.dcen().set_bit());
        done && !failed
    }
}

/// Waits for the end of an operation: far longer than the 2 s that one takes at most.
fn ready(controller: &FLASH) -> bool {
    (0..200_000_000).any(|_: u32| !controller.sr().read().bsy().bit())
}

impl Flash for Sectors {
    fn sector_bytes(&self) -> usize {
        SECTOR_BYTES
    }

    fn sector(&self, sector: u8) -> &[u8] {
        match Self::address(sector) {
            // SAFETY: this is flash that is mapped into memory and holds no statics. It changes by
            // `erase` and `program` only, which nobody can call while the slice is borrowed.
            Some(address) => unsafe { slice::from_raw_parts(address as *const u8, SECTOR_BYTES) },
            None => &[],
        }
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        let error = FlashError { sector, offset: 0 };
        Self::address(sector).ok_or(error)?;
        watchdog::wait_for(Patience::Erasing);
        let erased = self.unlocked(|controller| {
            controller.cr().write(|w| {
                w.psize().psize32();
                w.ser().set_bit();
                // SAFETY: one of the sectors 8 to 11.
                unsafe { w.snb().bits(sector) };
                w.strt().set_bit()
            });
        });
        watchdog::wait_for(Patience::Running);
        if erased { Ok(()) } else { Err(error) }
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        let error = FlashError { sector, offset };
        let address = Self::address(sector).ok_or(error)?;
        if offset > SECTOR_BYTES - 4 || !offset.is_multiple_of(4) {
            return Err(error);
        }
        let programmed = self.unlocked(|controller| {
            controller.cr().write(|w| {
                w.psize().psize32();
                w.pg().set_bit()
            });
            // SAFETY: a word of the store's sectors, which hold no code and no statics.
            unsafe { core::ptr::write_volatile((address + offset) as *mut u32, word) };
        });
        if programmed { Ok(()) } else { Err(error) }
    }
}
