//! The timer of the drive loop: SysTick, at 4 kHz.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use stillpoint_firmware::loop_time::PERIOD_COUNTS;

/// Starts the timer.
pub fn start(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD_COUNTS - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Counts of the core clock since the timer's latest interrupt was due.
pub fn elapsed_counts() -> u16 {
    // Both at most 2²⁴ by hardware, here below 2¹⁶.
    (SYST::get_reload() - SYST::get_current()) as u16
}

/// Counts since the tick that is running was due.
#[cfg(feature = "f405")]
pub fn since_due_counts() -> u32 {
    let later = if cortex_m::peripheral::SCB::is_pendst_pending() {
        PERIOD_COUNTS
    } else {
        0
    };
    u32::from(elapsed_counts()) + later
}
