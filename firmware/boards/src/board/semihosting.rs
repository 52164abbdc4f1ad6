//! Log frames to the emulator's console by semihosting, and the end of the emulator.

use core::arch::asm;

const SYS_OPEN: u32 = 0x01;
const SYS_WRITE: u32 = 0x05;
const SYS_EXIT: u32 = 0x18;
const RUN_TIME_ERROR: u32 = 0x2_0023;

/// SAFETY: `argument` must be what `operation` asks for: a number, or a pointer to its block.
unsafe fn call(operation: u32, argument: u32) -> u32 {
    let result;
    // SAFETY: the emulator, which is the only place this image runs in, answers the breakpoint.
    unsafe {
        asm!("bkpt 0xab", inlateout("r0") operation => result, in("r1") argument, options(nostack, preserves_flags));
    }
    result
}

/// Writes to the console. Takes no time on the emulated board.
pub fn write(bytes: &[u8]) {
    static CONSOLE: &[u8; 4] = b":tt\0";
    const MODE_WRITE: u32 = 4;
    let block = [CONSOLE.as_ptr() as u32, MODE_WRITE, 3];
    // SAFETY: a block of name, mode and length of the name. Opening the console again gives the
    // same handle.
    let handle = unsafe { call(SYS_OPEN, block.as_ptr() as u32) };
    let block = [handle, bytes.as_ptr() as u32, bytes.len() as u32];
    // SAFETY: a block of handle, bytes and their number.
    unsafe { call(SYS_WRITE, block.as_ptr() as u32) };
}

pub fn end_of_frame() {}

/// Ends the emulator, with exit status 1.
pub fn fail() -> ! {
    loop {
        // SAFETY: this operation takes a number.
        unsafe { call(SYS_EXIT, RUN_TIME_ERROR) };
    }
}
