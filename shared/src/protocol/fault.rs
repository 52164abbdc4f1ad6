//! The fault record: the last second before a fault, kept over a reset.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::MAX_AXES;
use crate::status::{Fault, LimitFlags, State};

/// Most samples in a response.
pub const MAX_FAULT_SAMPLES: usize = 5;

/// What a fault record is about.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultHead {
    /// The first cause, and when.
    pub fault: Fault,
    /// Build of the firmware that recorded.
    pub build_id: u64,
    /// Content hash of the trajectory that was loaded.
    pub trajectory_hash: u64,
    /// Period of the drive loop, in ticks of 0.1 µs.
    pub period_ticks: u32,
    /// Number of samples.
    pub samples: u16,
}

/// One moment before a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultSample {
    /// Tick of the drive loop, its lower 32 bits.
    pub tick: u32,
    /// Time in the trajectory, in ticks of 0.1 µs.
    pub path_ticks: u32,
    /// State after the tick, if it is one of this version's.
    pub state: Option<State>,
    /// Limits in force on any axis.
    pub limited: LimitFlags,
    /// Path speed in 256ths of the planned one; 255, too, for the planned one.
    pub path_speed: u8,
    /// Age of the oldest feedback in drive ticks, 255 or more; 255, too, if none came.
    pub age_ticks: u8,
    /// The axes.
    pub axes: Vec<FaultAxis, MAX_AXES>,
}

/// One axis in one moment before a fault, to three digits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultAxis {
    /// Set-point minus measured position, in rad.
    pub following_error_rad: f32,
    /// Measured velocity in rad/s.
    pub velocity_rad_per_s: f32,
    /// Torque set-point in N·m.
    pub torque_nm: f32,
}
