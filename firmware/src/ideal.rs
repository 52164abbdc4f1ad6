//! Drives without dynamics: every set-point is reached at once.

use core::convert::Infallible;

use nalgebra::SVector;

use crate::{DriveGroup, DriveStatus, Feedback, Setpoint};

/// N drives that stand exactly where they were told to.
#[derive(Debug, Clone, PartialEq)]
pub struct IdealDrives<const N: usize> {
    feedback: [Feedback; N],
}

impl<const N: usize> IdealDrives<N> {
    /// Disabled drives that stand still at a position in rad.
    pub fn at(position_rad: &SVector<f32, N>) -> Self {
        let mut drives = Self {
            feedback: [AT_ZERO; N],
        };
        for (feedback, position_rad) in drives.feedback.iter_mut().zip(position_rad) {
            feedback.position_rad = *position_rad;
        }
        drives
    }
}

const AT_ZERO: Feedback = Feedback {
    position_rad: 0.0,
    velocity_rad_per_s: 0.0,
    age_ticks: 0,
    status: DriveStatus::Disabled,
};

impl<const N: usize> DriveGroup<N> for IdealDrives<N> {
    type Error = Infallible;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], Infallible> {
        self.feedback = setpoints.map(|setpoint| Feedback {
            position_rad: setpoint.position_rad,
            velocity_rad_per_s: setpoint.velocity_rad_per_s,
            age_ticks: 0,
            status: DriveStatus::Enabled,
        });
        Ok(self.feedback)
    }

    fn observe(&mut self) -> Result<[Feedback; N], Infallible> {
        Ok(self.feedback)
    }

    fn safe(&mut self) {
        for feedback in &mut self.feedback {
            feedback.velocity_rad_per_s = 0.0;
            feedback.status = DriveStatus::Disabled;
        }
    }
}
