//! Flash of the emulated board: RAM that a reset leaves alone.

use core::arch::asm;
use core::mem::MaybeUninit;

use stillpoint_firmware::store::Layout;
use stillpoint_firmware::store::flash::RamFlash;

/// Four sectors, smaller than the real board's.
pub type Sectors = &'static mut RamFlash<4, { 16 * 1024 }>;

/// What is where.
pub const LAYOUT: Layout = Layout {
    moves: [0, 1],
    config: [2, 3],
};

#[unsafe(link_section = ".uninit.flash")]
static mut FLASH: MaybeUninit<RamFlash<4, { 16 * 1024 }>> = MaybeUninit::uninit();

/// The sectors as the last run left them, or anything after power-up.
///
/// # Safety
/// To be called once.
pub unsafe fn sectors() -> Sectors {
    let mut flash = (&raw mut FLASH).cast();
    // SAFETY: as in retained.rs; the sectors are bytes.
    unsafe {
        asm!("/* {} */", inout(reg) flash, options(nostack, preserves_flags));
        &mut *flash
    }
}
