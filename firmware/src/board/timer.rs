//! The timer of the drive loop: SysTick, at 4 kHz.

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use stillpoint_firmware::{DriveGroup, Feedback, Setpoint};
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

/// Time ticks of 0.1 µs in counts of the core clock, for some periods at most.
pub fn time_ticks(counts: u32) -> u32 {
    const MHZ: u32 = 1_000_000;
    counts * (TIME_TICKS_PER_SECOND / MHZ) / (CORE_HZ / MHZ)
}

/// Measures a tick from its beginning, and not from when it was due: in the emulator, whose time is
/// the host's while it waits, it may begin late.
#[derive(Debug)]
pub struct Stopwatch(u32);

impl Stopwatch {
    /// The tick begins. Should the next one be due already, it is left out.
    pub fn start() -> Self {
        SCB::clear_pendst();
        Self(elapsed_counts().into())
    }

    /// Counts since the beginning, less than two periods.
    pub fn counts(&self) -> u32 {
        let later = if SCB::is_pendst_pending() {
            PERIOD_COUNTS
        } else {
            0
        };
        (u32::from(elapsed_counts()) + later).saturating_sub(self.0)
    }
}

/// Drives, and when they were last reached.
#[derive(Debug)]
pub struct Watched<D> {
    /// The drives.
    pub group: D,
    /// [`elapsed_counts`] when the latest set-points were handed over.
    pub reached_counts: u16,
}

impl<D> Watched<D> {
    pub fn new(group: D) -> Self {
        Self {
            group,
            reached_counts: 0,
        }
    }
}

impl<const N: usize, D: DriveGroup<N>> DriveGroup<N> for Watched<D> {
    type Error = D::Error;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], D::Error> {
        self.reached_counts = elapsed_counts();
        self.group.exchange(setpoints)
    }

    fn observe(&mut self) -> Result<[Feedback; N], D::Error> {
        self.group.observe()
    }

    fn safe(&mut self) {
        self.group.safe();
    }
}
