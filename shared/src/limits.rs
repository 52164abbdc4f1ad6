//! What each axis may do, at the joint (reducer output).

use core::fmt;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::{MAX_AXES, hash, ordinal};

/// Limits of one axis at the joint.
///
/// The torque–speed curve is flat at `torque_nm` up to the knee and falls with `slope_nm_s_per_rad`
/// beyond it, to zero at the least; it bounds |torque| whether the axis drives or brakes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisLimits {
    /// Largest |torque| in N·m.
    pub torque_nm: f32,
    /// Largest |torque rate| in N·m/s.
    pub torque_rate_nm_per_s: f32,
    /// Largest |speed| in rad/s.
    pub speed_rad_per_s: f32,
    /// Speed in rad/s from which the torque available falls.
    pub knee_speed_rad_per_s: f32,
    /// Fall of the torque available beyond the knee, in N·m per rad/s; 0 for a flat curve.
    pub slope_nm_s_per_rad: f32,
}

impl AxisLimits {
    /// Torque in N·m available at a speed in rad/s: the torque–speed curve. Never negative.
    #[inline]
    pub fn available_torque_nm(&self, speed_rad_per_s: f32) -> f32 {
        let beyond_knee = speed_rad_per_s.abs() - self.knee_speed_rad_per_s;
        if beyond_knee > 0.0 {
            let available = self.torque_nm - self.slope_nm_s_per_rad * beyond_knee;
            if available > 0.0 { available } else { 0.0 }
        } else {
            self.torque_nm
        }
    }

    fn named(&self) -> [(LimitName, f32, bool); 5] {
        [
            (LimitName::Torque, self.torque_nm, true),
            (LimitName::TorqueRate, self.torque_rate_nm_per_s, true),
            (LimitName::Speed, self.speed_rad_per_s, true),
            (LimitName::KneeSpeed, self.knee_speed_rad_per_s, false),
            (LimitName::Slope, self.slope_nm_s_per_rad, false),
        ]
    }
}

/// A field of [`AxisLimits`]; its `Display` is the field's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LimitName {
    /// `torque_nm`
    Torque,
    /// `torque_rate_nm_per_s`
    TorqueRate,
    /// `speed_rad_per_s`
    Speed,
    /// `knee_speed_rad_per_s`
    KneeSpeed,
    /// `slope_nm_s_per_rad`
    Slope,
}

impl fmt::Display for LimitName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Torque => "torque_nm",
            Self::TorqueRate => "torque_rate_nm_per_s",
            Self::Speed => "speed_rad_per_s",
            Self::KneeSpeed => "knee_speed_rad_per_s",
            Self::Slope => "slope_nm_s_per_rad",
        })
    }
}

/// Limits of all axes of a machine: 1 to [`MAX_AXES`], every number finite and of the right sign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(try_from = "Vec<AxisLimits, MAX_AXES>")]
pub struct Limits {
    axes: Vec<AxisLimits, MAX_AXES>,
}

impl Limits {
    /// Limits of a machine, axis by axis.
    pub fn new(axes: &[AxisLimits]) -> Result<Self, LimitsError> {
        let axes = Vec::from_slice(axes).map_err(|_| LimitsError::Axes { axes: axes.len() })?;
        Self::try_from(axes)
    }

    /// The axes' limits, in the order of the trajectory's axes.
    pub fn axes(&self) -> &[AxisLimits] {
        &self.axes
    }

    /// CRC-64/XZ of the postcard bytes. A trajectory carries the hash of the limits it was planned
    /// for.
    pub fn hash(&self) -> u64 {
        hash::of(self)
    }
}

impl TryFrom<Vec<AxisLimits, MAX_AXES>> for Limits {
    type Error = LimitsError;

    fn try_from(axes: Vec<AxisLimits, MAX_AXES>) -> Result<Self, LimitsError> {
        if axes.is_empty() {
            return Err(LimitsError::Axes { axes: 0 });
        }
        for (axis, limits) in axes.iter().enumerate() {
            for (name, value, zero_is_wrong) in limits.named() {
                let in_range = value >= 0.0 && !(zero_is_wrong && value == 0.0);
                if !(value.is_finite() && in_range) {
                    return Err(LimitsError::Value { axis, name, value });
                }
            }
        }
        Ok(Self { axes })
    }
}

/// Why a set of limits is refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LimitsError {
    /// No axes, or more than [`MAX_AXES`].
    Axes {
        /// Number of axes given.
        axes: usize,
    },
    /// A limit is not finite, negative, or zero where it must be positive.
    Value {
        /// Axis, from 0.
        axis: usize,
        /// Field of [`AxisLimits`].
        name: LimitName,
        /// Its value.
        value: f32,
    },
}

impl fmt::Display for LimitsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { axes } => write!(
                f,
                "limits for {axes} axes were given: give them for 1 to {MAX_AXES}"
            ),
            Self::Value { axis, name, value } => {
                write!(
                    f,
                    "{name} of axis {axis} is {value}: give a finite positive number (knee and slope may be zero)",
                    axis = ordinal(axis)
                )
            }
        }
    }
}

impl core::error::Error for LimitsError {}
