//! The timer of the drive loop: SysTick, at 4 kHz.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use stillpoint_shared::time::{DRIVE_PERIOD_TICKS, TIME_TICKS_PER_SECOND};

/// Ticks per second.
const TICK_HZ: u32 = TIME_TICKS_PER_SECOND / DRIVE_PERIOD_TICKS;

/// Core clock, which is SysTick's.
pub const CORE_HZ: u32 = 168_000_000;

/// Counts of the core clock in a period.
pub const PERIOD_COUNTS: u32 = CORE_HZ / TICK_HZ;

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

/// Ticks left out, by the cycles from one tick to the next.
#[cfg(feature = "f405")]
pub fn missed_ticks(cycles: u32) -> u16 {
    let periods = (cycles.saturating_add(PERIOD_COUNTS / 2)) / PERIOD_COUNTS;
    periods.saturating_sub(1) as u16
}

/// Time ticks of 0.1 µs in counts of the core clock, for some periods at most.
pub fn time_ticks(counts: u32) -> u32 {
    const MHZ: u32 = 1_000_000;
    counts * (TIME_TICKS_PER_SECOND / MHZ) / (CORE_HZ / MHZ)
}
