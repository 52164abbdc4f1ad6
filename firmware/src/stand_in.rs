//! The drive loop while the executor is busy.
//!
//! Checking a trajectory takes tens of milliseconds, and so does storing one; both happen at rest
//! only. The drive loop goes on meanwhile: the drives are told again what they were told last, until
//! one of them is lost, and the emergency stop works.

use crate::{DriveGroup, DriveStatus, Feedback, Setpoint, TickInputs};

/// What N drives were told last, to tell them again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandIn<const N: usize> {
    /// What they were told; `None` if it was to be safe.
    told: Option<[Setpoint; N]>,
    /// Which of them followed.
    enabled: [bool; N],
    stopped: bool,
}

impl<const N: usize> Default for StandIn<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> StandIn<N> {
    /// Nothing was told yet.
    pub const fn new() -> Self {
        Self {
            told: None,
            enabled: [false; N],
            stopped: false,
        }
    }

    /// The drives for a tick of the executor, which leaves here what they are told.
    #[inline]
    pub fn watching<'a, D: ?Sized>(&'a mut self, drives: &'a mut D) -> Watched<'a, D, N> {
        Watched {
            stand_in: self,
            drives,
        }
    }

    /// A tick without the executor, instead of one of its own.
    pub fn tick<D: DriveGroup<N>>(&mut self, drives: &mut D, inputs: &TickInputs) {
        self.stopped |= inputs.emergency_stop;
        match &self.told {
            // The executor looks at the feedback when it is back, too late for a drive that is
            // lost: it would be brought back first.
            Some(setpoints) if !self.stopped => {
                let lost = drives.exchange(setpoints).is_ok_and(|feedback| {
                    let mut axes = self.enabled.iter().zip(&feedback);
                    axes.any(|(&enabled, now)| enabled && now.status != DriveStatus::Enabled)
                });
                if lost {
                    self.told = None;
                    drives.safe();
                }
            }
            _ => {
                drives.safe();
                let _ = drives.observe();
            }
        }
    }

    /// Adds to what the executor is told with its first tick afterwards: that the emergency stop
    /// was pressed meanwhile, even if it is not any more.
    #[inline]
    pub fn hand_back(&mut self, inputs: &mut TickInputs) {
        inputs.emergency_stop |= self.stopped;
        self.stopped = false;
    }
}

/// Drives whose stand-in listens.
#[derive(Debug)]
pub struct Watched<'a, D: ?Sized, const N: usize> {
    stand_in: &'a mut StandIn<N>,
    drives: &'a mut D,
}

impl<D: DriveGroup<N> + ?Sized, const N: usize> DriveGroup<N> for Watched<'_, D, N> {
    type Error = D::Error;

    #[inline]
    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], D::Error> {
        self.stand_in.told = Some(*setpoints);
        let answer = self.drives.exchange(setpoints);
        if let Ok(feedback) = &answer {
            for (enabled, now) in self.stand_in.enabled.iter_mut().zip(feedback) {
                *enabled = now.status == DriveStatus::Enabled;
            }
        }
        answer
    }

    fn observe(&mut self) -> Result<[Feedback; N], D::Error> {
        self.drives.observe()
    }

    fn safe(&mut self) {
        self.stand_in.told = None;
        self.drives.safe();
    }

    fn reset_faults(&mut self) {
        self.drives.reset_faults();
    }
}
