//! What the machine must never exceed.

use super::error::{Fault, Problem};
use super::section::Section;
use serde::Deserialize;
use std::f64::consts::TAU;

/// Limits of every axis and of the machine's outputs.
///
/// Torque, torque rate and slope hold at the reducer output, speeds at the motor, as drive catalogues give them.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Largest torque up to the knee speed, N·m at the reducer output.
    pub torque_nm: f64,
    /// Largest torque rate, N·m/s at the reducer output.
    pub torque_rate_nm_per_s: f64,
    /// Largest motor speed.
    pub motor_speed_rpm: f64,
    /// Motor speed from which the torque limit falls.
    pub torque_speed_knee_rpm: f64,
    /// How fast it falls: N·m at the reducer output per rpm of the motor.
    pub torque_speed_slope_nm_per_rpm: f64,
    /// Largest magnitude of each of the machine's outputs, in their order and units; `None` is unlimited.
    pub outputs: Vec<Option<f64>>,
}

/// Radians per second of one revolution per minute.
const RPM: f64 = TAU / 60.0;

impl Limits {
    /// Largest joint speed behind a reducer, rad/s.
    #[must_use]
    pub fn joint_speed_rad_per_s(&self, reducer_ratio: f64) -> f64 {
        self.motor_speed_rpm * RPM / reducer_ratio
    }

    /// Joint speed from which the torque limit falls, rad/s.
    #[must_use]
    pub fn knee_rad_per_s(&self, reducer_ratio: f64) -> f64 {
        self.torque_speed_knee_rpm * RPM / reducer_ratio
    }

    /// How fast it falls there, N·m·s/rad.
    #[must_use]
    pub fn slope_nm_s_per_rad(&self, reducer_ratio: f64) -> f64 {
        self.torque_speed_slope_nm_per_rpm * reducer_ratio / RPM
    }

    /// Whether the torque limit falls at all below the largest speed.
    #[must_use]
    pub fn torque_falls_with_speed(&self) -> bool {
        self.torque_speed_slope_nm_per_rpm > 0.0
            && self.torque_speed_knee_rpm < self.motor_speed_rpm
    }

    /// Torque limit at a joint speed of either sign, N·m: m_peak − k0 (n − n0) beyond the knee, never below zero.
    #[must_use]
    pub fn torque_at_joint_speed(&self, joint_speed_rad_per_s: f64, reducer_ratio: f64) -> f64 {
        let beyond = joint_speed_rad_per_s.abs() - self.knee_rad_per_s(reducer_ratio);
        (self.torque_nm - self.slope_nm_s_per_rad(reducer_ratio) * beyond.max(0.0)).max(0.0)
    }
}

/// The keys that hold for every axis of every machine.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisLimits {
    pub(super) torque_nm: f64,
    pub(super) torque_rate_nm_per_s: f64,
    pub(super) motor_speed_rpm: f64,
    pub(super) torque_speed_knee_rpm: f64,
    pub(super) torque_speed_slope_nm_per_rpm: f64,
}

impl AxisLimits {
    pub(super) fn with_outputs(self, outputs: Vec<Option<f64>>) -> Limits {
        Limits {
            torque_nm: self.torque_nm,
            torque_rate_nm_per_s: self.torque_rate_nm_per_s,
            motor_speed_rpm: self.motor_speed_rpm,
            torque_speed_knee_rpm: self.torque_speed_knee_rpm,
            torque_speed_slope_nm_per_rpm: self.torque_speed_slope_nm_per_rpm,
            outputs,
        }
    }
}

/// Every limit is a finite number with room on both sides of zero; only knee and slope may be zero.
pub(super) fn check_limits(section: &Section<'_>) -> Result<(), Box<Fault>> {
    const MAY_BE_ZERO: [&str; 2] = ["torque_speed_knee_rpm", "torque_speed_slope_nm_per_rpm"];
    for (key, value, bytes) in section.numbers() {
        let rule = if !value.is_finite() {
            "a limit must be a finite number; leave the key out if there is none"
        } else if value < 0.0 {
            "limits hold in both directions and are written as positive numbers"
        } else if value == 0.0 && !MAY_BE_ZERO.contains(&key.as_str()) {
            "a limit of zero leaves no room to move"
        } else {
            continue;
        };
        let rule = rule.to_owned();
        return Err(Fault::new(bytes, Problem::Value { key, value, rule }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Limits;

    #[test]
    fn motor_and_joint_units() {
        let limits = Limits {
            torque_nm: 150.0,
            torque_rate_nm_per_s: 2e4,
            motor_speed_rpm: 6000.0,
            torque_speed_knee_rpm: 4750.0,
            torque_speed_slope_nm_per_rpm: 0.12,
            outputs: vec![],
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs(), "{a} {b}");
        let top = limits.joint_speed_rad_per_s(20.0);
        close(top, 10.0 * std::f64::consts::PI);
        assert!(limits.torque_falls_with_speed());
        close(limits.torque_at_joint_speed(0.0, 20.0), 150.0);
        close(
            limits.torque_at_joint_speed(-limits.knee_rad_per_s(20.0), 20.0),
            150.0,
        );
        // 1250 rpm beyond the knee: the curve meets zero at the top speed.
        assert!(limits.torque_at_joint_speed(-top, 20.0) < 1e-9);
        close(
            limits.torque_at_joint_speed(0.9 * top, 20.0),
            150.0 - 0.12 * 650.0,
        );
        assert_eq!(limits.torque_at_joint_speed(2.0 * top, 20.0), 0.0);
    }
}
