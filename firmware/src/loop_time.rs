//! The drive loop's time, by counts of the core clock.

use stillpoint_shared::time::{DRIVE_PERIOD_TICKS, TIME_TICKS_PER_SECOND};

/// Core clock of the boards.
pub const CORE_HZ: u32 = 168_000_000;

/// Ticks per second.
const TICK_HZ: u32 = TIME_TICKS_PER_SECOND / DRIVE_PERIOD_TICKS;

/// Counts of the core clock in a period.
pub const PERIOD_COUNTS: u32 = CORE_HZ / TICK_HZ;

// A period that were no whole number of counts would drift.
const _: () = assert!(PERIOD_COUNTS * TICK_HZ == CORE_HZ);

/// Ticks left out, by the counts from one tick to the next: the nearest whole number, since both
/// begin a little late.
pub fn missed_ticks(counts: u32) -> u16 {
    let periods = counts.saturating_add(PERIOD_COUNTS / 2) / PERIOD_COUNTS;
    // A u32 holds some 100,000 periods.
    let missed = periods.saturating_sub(1);
    if missed > u16::MAX.into() {
        u16::MAX
    } else {
        missed as u16
    }
}

/// Time ticks of 0.1 µs in counts of the core clock, rounded down; for 2.5 s at most.
pub fn time_ticks(counts: u32) -> u32 {
    const MHZ: u32 = 1_000_000;
    counts.saturating_mul(TIME_TICKS_PER_SECOND / MHZ) / (CORE_HZ / MHZ)
}
