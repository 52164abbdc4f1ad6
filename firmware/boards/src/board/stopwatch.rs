//! How long things take on the emulated board, whose instructions all last equally long.

use cortex_m::peripheral::SCB;
use stillpoint_firmware::{DriveGroup, Feedback, Setpoint};

use super::timer::{PERIOD_COUNTS, elapsed_counts};

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

    /// Counts from the beginning to a reading of [`elapsed_counts`] in the same period.
    pub fn until(&self, elapsed_counts: u16) -> u16 {
        u32::from(elapsed_counts).saturating_sub(self.0) as u16
    }
}

/// Drives, and when they were last told something.
#[derive(Debug)]
pub struct Watched<D> {
    /// The drives.
    pub group: D,
    /// [`elapsed_counts`] when the latest set-points were handed over.
    pub reached_counts: u16,
    /// Counts until the drives had answered.
    pub answer_counts: u16,
}

impl<D> Watched<D> {
    pub fn new(group: D) -> Self {
        Self {
            group,
            reached_counts: 0,
            answer_counts: 0,
        }
    }
}

impl<const N: usize, D: DriveGroup<N>> DriveGroup<N> for Watched<D> {
    type Error = D::Error;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], D::Error> {
        self.reached_counts = elapsed_counts();
        let answer = self.group.exchange(setpoints);
        self.answer_counts = elapsed_counts().saturating_sub(self.reached_counts);
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
