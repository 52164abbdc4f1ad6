//! Between the joint's SI units and the drive's increments and thousandths.
//!
//! counts = home + s (θ − θ_home) N / 2π and permille = s τ / (i τ_rated) · 1000, with N increments
//! per turn of the joint, gear ratio i and s = ±1. In f64: a joint can have 10⁸ increments per
//! turn, more than f32 counts exactly, and the set-point of every cycle is one soft multiplication.

use core::f64::consts::TAU;

use stillpoint_shared::AxisDrive;

/// Conversion of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    home_counts: i32,
    home_rad: f64,
    counts_per_rad: f64,
    rad_per_count: f64,
    permille_per_nm: f32,
    torque_limit_permille: f32,
}

/// A value for the drive, and whether it had to be cut to fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fitted<T> {
    /// The value.
    pub value: T,
    /// Whether it was cut.
    pub saturated: bool,
}

impl Units {
    /// Conversion for a drive of a checked configuration.
    pub fn new(drive: &AxisDrive) -> Self {
        let sign = if drive.reversed { -1.0 } else { 1.0 };
        let motor_torque_nm = f64::from(drive.gear_ratio) * f64::from(drive.rated_torque_nm);
        Self {
            home_counts: drive.home_counts,
            home_rad: f64::from(drive.home_rad),
            counts_per_rad: sign * drive.counts_per_turn / TAU,
            rad_per_count: sign * TAU / drive.counts_per_turn,
            permille_per_nm: (sign * 1000.0 / motor_torque_nm) as f32,
            torque_limit_permille: f32::from(drive.torque_limit_permille),
        }
    }

    /// Increments at an angle in rad; `None` if it is no finite number.
    pub fn counts(&self, angle_rad: f32) -> Option<Fitted<i32>> {
        let counts = f64::from(self.home_counts)
            + (f64::from(angle_rad) - self.home_rad) * self.counts_per_rad;
        // Rounded to nearest, halves away from zero; `as` saturates.
        let rounded = counts + if counts < 0.0 { -0.5 } else { 0.5 };
        angle_rad.is_finite().then_some(Fitted {
            value: rounded as i32,
            saturated: !(-RANGE..RANGE).contains(&rounded),
        })
    }

    /// Angle in rad at a number of increments.
    pub fn angle_rad(&self, counts: i32) -> f32 {
        let from_home = i64::from(counts) - i64::from(self.home_counts);
        (self.home_rad + from_home as f64 * self.rad_per_count) as f32
    }

    /// Speed in rad/s of so many increments in a time in s.
    pub fn speed_rad_per_s(&self, counts: i32, time_s: f32) -> f32 {
        (f64::from(counts) * self.rad_per_count) as f32 / time_s
    }

    /// Torque offset in thousandths of the rated torque; `None` if the torque in N·m
    /// is no finite number.
    pub fn torque_permille(&self, torque_nm: f32) -> Option<Fitted<i16>> {
        let permille = torque_nm * self.permille_per_nm;
        let limit = self.torque_limit_permille;
        let (value, saturated) = if permille > limit {
            (limit, true)
        } else if permille < -limit {
            (-limit, true)
        } else {
            (permille + if permille < 0.0 { -0.5 } else { 0.5 }, false)
        };
        torque_nm.is_finite().then_some(Fitted {
            value: value as i16,
            saturated,
        })
    }
}

/// Increments are in −2³¹ ≤ counts < 2³¹.
const RANGE: f64 = 2_147_483_648.0;
