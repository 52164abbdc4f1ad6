//! Memory that the start-up code leaves as it is: the fault record, and a count of starts.

use core::arch::asm;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU16, Ordering};

use super::serve::AXES;
use stillpoint_firmware::FaultRecord;

#[unsafe(link_section = ".uninit.fault_record")]
static mut RECORD: MaybeUninit<FaultRecord<AXES>> = MaybeUninit::uninit();

/// The record as the last run left it, or garbage after power-up.
///
/// # Safety
/// To be called once.
pub unsafe fn fault_record() -> &'static mut FaultRecord<AXES> {
    let mut record = (&raw mut RECORD).cast::<FaultRecord<AXES>>();
    // SAFETY: the record consists of integers, for which any bytes are valid; that they are some
    // bytes at all, left in RAM by whoever, is what the compiler is made to believe by passing
    // the address through an instruction that might have written them. Called once, so there is no
    // other reference.
    unsafe {
        asm!("/* {} */", inout(reg) record, options(nostack, preserves_flags));
        &mut *record
    }
}

#[unsafe(link_section = ".uninit.starts")]
static STARTS: AtomicU16 = AtomicU16::new(0);

/// A number that is another one after every start; the first one after power-up is any.
pub fn count_start() -> u16 {
    STARTS.fetch_add(1, Ordering::Relaxed)
}
