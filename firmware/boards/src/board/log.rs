//! Logging by defmt, from thread mode (start and idle loop) only.
//!
//! There is one thread, so frames cannot collide and no interrupt is ever held off, let alone the
//! drive loop's. What an interrupt logs is dropped. defmt's own loggers lock the interrupts for a
//! whole frame, the one over RTT even until a debugger has made room, and panic if called twice.

use core::cell::UnsafeCell;

use defmt::Encoder;

use super::sink;

#[defmt::global_logger]
struct Logger;

struct Frame(UnsafeCell<Encoder>);

// SAFETY: used in thread mode only, of which there is one.
unsafe impl Sync for Frame {}

static FRAME: Frame = Frame(UnsafeCell::new(Encoder::new()));

/// Runs `then` on the encoder in thread mode, else does nothing.
fn in_thread_mode(then: impl FnOnce(&mut Encoder)) {
    let exception: u32;
    // SAFETY: reads a register.
    unsafe {
        core::arch::asm!("mrs {}, IPSR", out(reg) exception, options(nomem, nostack, preserves_flags));
    }
    if exception == 0 {
        // SAFETY: this is the only thread, and no reference outlives a call of this function, which
        // `then` does not call.
        then(unsafe { &mut *FRAME.0.get() });
    }
}

// SAFETY: calls of these functions cannot interleave, as only those of the single thread do
// anything.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        in_thread_mode(|encoder| encoder.start_frame(sink::write));
    }

    unsafe fn flush() {}

    unsafe fn release() {
        in_thread_mode(|encoder| {
            encoder.end_frame(sink::write);
            sink::end_of_frame();
        });
    }

    unsafe fn write(bytes: &[u8]) {
        in_thread_mode(|encoder| encoder.write(bytes, sink::write));
    }
}
