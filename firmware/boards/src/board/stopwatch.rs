//! How long things take on the emulated board, whose instructions all last equally long.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use stillpoint_firmware::loop_time::PERIOD_COUNTS;
use stillpoint_firmware::{DriveGroup, Feedback, Setpoint};

use super::timer::elapsed_counts;

/// Measures a tick from its beginning, and not from when it was due: in the emulator, whose time is
/// the host's while it waits, it may begin late.
#[derive(Debug)]
pub struct Stopwatch(u32);

/// Counts in interrupts of the tick, which are none of its work.
static AWAY_COUNTS: AtomicU32 = AtomicU32::new(0);

/// Does what an interrupt of the tick does, with every stopwatch halted.
pub fn away(act: impl FnOnce()) {
    let begun_counts = elapsed_counts();
    act();
    // Where the next period begins meanwhile, nothing is taken off.
    let counts = elapsed_counts().saturating_sub(begun_counts);
    let before = AWAY_COUNTS.load(Ordering::Relaxed);
    AWAY_COUNTS.store(before.wrapping_add(counts.into()), Ordering::Relaxed);
}

/// A reading of the timer from which no interrupt of the tick takes anything; only differences mean anything.
fn own_counts() -> u32 {
    u32::from(elapsed_counts()).wrapping_sub(AWAY_COUNTS.load(Ordering::Relaxed))
}

/// Counts from one reading to another less than a period later, whose timer may have begun anew.
fn between(earlier: u32, later: u32) -> u32 {
    let counts = later.wrapping_sub(earlier);
    if counts < PERIOD_COUNTS {
        counts
    } else {
        counts.wrapping_add(PERIOD_COUNTS)
    }
}

impl Stopwatch {
    /// The tick begins. Should the next one be due already, it is left out.
    pub fn start() -> Self {
        SCB::clear_pendst();
        Self(own_counts())
    }

    /// Counts since the beginning, less than two periods.
    pub fn counts(&self) -> u32 {
        let later = if SCB::is_pendst_pending() {
            PERIOD_COUNTS
        } else {
            0
        };
        own_counts().wrapping_add(later).wrapping_sub(self.0)
    }

    /// Counts from the beginning to when the drives were told something.
    pub fn until<D>(&self, drives: &Timed<D>) -> u16 {
        between(self.0, drives.reached_counts) as u16
    }
}

/// Drives, and when they were last told something.
#[derive(Debug)]
pub struct Timed<D> {
    /// The drives.
    pub group: D,
    /// [`own_counts`] when the latest set-points were handed over.
    reached_counts: u32,
    /// Counts until the drives had answered.
    pub answer_counts: u32,
}

impl<D> Timed<D> {
    pub fn new(group: D) -> Self {
        Self {
            group,
            reached_counts: 0,
            answer_counts: 0,
        }
    }
}

impl<const N: usize, D: DriveGroup<N>> DriveGroup<N> for Timed<D> {
    type Error = D::Error;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], D::Error> {
        self.reached_counts = own_counts();
        let answer = self.group.exchange(setpoints);
        self.answer_counts = between(self.reached_counts, own_counts());
        answer
    }

    fn observe(&mut self) -> Result<[Feedback; N], D::Error> {
        self.group.observe()
    }

    fn safe(&mut self) {
        self.group.safe();
    }

    fn reset_faults(&mut self) {
        self.group.reset_faults();
    }
}
