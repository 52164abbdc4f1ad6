//! The drive loop while the executor is busy.
//!
//! Checking a trajectory takes tens of milliseconds, and so does storing one; both happen at rest
//! only. The drive loop goes on meanwhile: the drives are told again what they were told last, until
//! one of them is lost, and the emergency stop works.

use crate::{DriveGroup, DriveStatus, Feedback, Setpoint, TickInputs};

/// Drives that can be told again what they were told last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandIn<D, const N: usize> {
    drives: D,
    /// What they were told; `None` if it was to be safe.
    told: Option<[Setpoint; N]>,
    /// Which of them followed.
    enabled: [bool; N],
    stopped: bool,
}

impl<D: DriveGroup<N>, const N: usize> StandIn<D, N> {
    /// Drives that were told nothing yet.
    pub const fn new(drives: D) -> Self {
        Self {
            drives,
            told: None,
            enabled: [false; N],
            stopped: false,
        }
    }

    /// The drives.
    pub fn drives(&self) -> &D {
        &self.drives
    }

    /// The drives.
    pub fn drives_mut(&mut self) -> &mut D {
        &mut self.drives
    }

    /// A tick without the executor, instead of one of its own.
    pub fn tick(&mut self, inputs: &TickInputs) {
        self.stopped |= inputs.emergency_stop;
        match &self.told {
            // The executor looks at the feedback when it is back, too late for a drive that is
            // lost: it would be brought back first.
            Some(setpoints) if !self.stopped => {
                let lost = self.drives.exchange(setpoints).is_ok_and(|feedback| {
                    let mut axes = self.enabled.iter().zip(&feedback);
                    axes.any(|(&enabled, now)| enabled && now.status != DriveStatus::Enabled)
                });
                if lost {
                    self.safe();
                }
            }
            _ => {
                self.drives.safe();
                let _ = self.drives.observe();
            }
        }
    }

    /// Adds to what the executor is told with its first tick afterwards: that the emergency stop
    /// was pressed meanwhile, even if it is not any more.
    pub fn hand_back(&mut self, inputs: &mut TickInputs) {
        inputs.emergency_stop |= self.stopped;
        self.stopped = false;
    }
}

impl<D: DriveGroup<N>, const N: usize> DriveGroup<N> for StandIn<D, N> {
    type Error = D::Error;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], D::Error> {
        self.told = Some(*setpoints);
        let answer = self.drives.exchange(setpoints);
        if let Ok(feedback) = &answer {
            for (enabled, now) in self.enabled.iter_mut().zip(feedback) {
                *enabled = now.status == DriveStatus::Enabled;
            }
        }
        answer
    }

    fn observe(&mut self) -> Result<[Feedback; N], D::Error> {
        self.drives.observe()
    }

    fn safe(&mut self) {
        self.told = None;
        self.drives.safe();
    }

    fn reset_faults(&mut self) {
        self.drives.reset_faults();
    }
}
