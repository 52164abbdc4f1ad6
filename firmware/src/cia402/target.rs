//! What a drive is to move to, in its units; set-points that do not fit are counted.

use stillpoint_shared::AxisDrive;

use super::units::Units;
use crate::Setpoint;

/// Target position (607Ah) and torque offset (60B2h) of one axis.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub(super) units: Units,
    counts: i32,
    /// Set-points whose torque was cut.
    pub(super) torque_saturated: u32,
    /// Set-points whose position was cut, or was no number.
    pub(super) position_saturated: u32,
}

impl Target {
    pub(super) fn new(drive: &AxisDrive) -> Self {
        Self {
            units: Units::new(drive),
            counts: 0,
            torque_saturated: 0,
            position_saturated: 0,
        }
    }

    /// Stay at so many increments, without torque offset.
    pub(super) fn stay(&mut self, counts: i32) -> (i32, i16) {
        self.counts = counts;
        (counts, 0)
    }

    /// Move to a set-point. One that is no number leaves the target where it was.
    pub(super) fn follow(&mut self, setpoint: &Setpoint) -> (i32, i16) {
        let counts = self.units.counts(setpoint.position_rad);
        let permille = self.units.torque_permille(setpoint.torque_nm);
        if counts.is_none_or(|counts| counts.saturated) {
            self.position_saturated = self.position_saturated.saturating_add(1);
        }
        if permille.is_none_or(|permille| permille.saturated) {
            self.torque_saturated = self.torque_saturated.saturating_add(1);
        }
        if let Some(counts) = counts {
            self.counts = counts.value;
        }
        (self.counts, permille.map_or(0, |permille| permille.value))
    }
}
