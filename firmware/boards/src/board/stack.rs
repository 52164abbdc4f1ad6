//! How much stack has been used: paint it at the start, look later how far the paint is gone.

use core::ptr;

const PAINT: u32 = 0xc5c5_c5c5;

/// Kept free of paint below the stack pointer at the start, for the painter itself.
const MARGIN_BYTES: usize = 256;

unsafe extern "C" {
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

fn bottom() -> *mut u32 {
    &raw mut _stack_end
}

fn top() -> *mut u32 {
    &raw mut _stack_start
}

/// Paints what is unused. Called once, at the start, with the interrupts off.
pub fn paint() {
    let mut word = bottom();
    let end = (cortex_m::register::msp::read() as usize).saturating_sub(MARGIN_BYTES);
    while (word as usize) < end {
        // SAFETY: between the end of the statics and the stack in use there is nothing.
        unsafe {
            ptr::write_volatile(word, PAINT);
            word = word.add(1);
        }
    }
}

/// Most bytes in use since [`paint`], and the bytes there are. Takes long: for the idle loop.
pub fn usage() -> (u32, u32) {
    let mut word = bottom();
    // SAFETY: this is RAM, which any value is valid in, up to the last painted word at most.
    while word < top() && unsafe { ptr::read_volatile(word) } == PAINT {
        word = word.wrapping_add(1);
    }
    let (bottom, top) = (bottom() as u32, top() as u32);
    (top - word as u32, top - bottom)
}
