//! Telemetry: samples of the drive loop that the board sends by itself.
//!
//! A sample that finds the queue full is dropped and counted; telemetry never delays a response,
//! and neither delays the drive loop.

use core::ops::BitOr;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::MAX_AXES;
use crate::status::{LimitFlags, State};

/// What telemetry can carry besides tick, state and path time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channels(u8);

impl Channels {
    /// Nothing more.
    pub const NONE: Self = Self(0);
    /// Position set-points in rad.
    pub const SETPOINT_POSITION: Self = Self(1);
    /// Velocity set-points in rad/s.
    pub const SETPOINT_VELOCITY: Self = Self(2);
    /// Torque set-points in N·m.
    pub const SETPOINT_TORQUE: Self = Self(4);
    /// Measured positions in rad.
    pub const MEASURED_POSITION: Self = Self(8);
    /// Measured velocities in rad/s.
    pub const MEASURED_VELOCITY: Self = Self(16);
    /// Limits in force.
    pub const LIMITS: Self = Self(32);
    /// All of them.
    pub const ALL: Self = Self(63);

    /// The channels with values, in the order of [`Telemetry::values`].
    pub const VALUES: [Self; MAX_CHANNELS] = [
        Self::SETPOINT_POSITION,
        Self::SETPOINT_VELOCITY,
        Self::SETPOINT_TORQUE,
        Self::MEASURED_POSITION,
        Self::MEASURED_VELOCITY,
    ];

    /// Whether all of `other` are chosen.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl BitOr for Channels {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Number of channels with values.
pub const MAX_CHANNELS: usize = 5;

/// Enough bytes for a frame of telemetry.
pub const MAX_TELEMETRY_BYTES: usize = 176;

/// Which samples of the drive loop are sent, and what of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TelemetryConfig {
    /// One sample every so many drive ticks; 0 for none.
    pub every_ticks: u16,
    /// What it carries.
    pub channels: Channels,
}

impl TelemetryConfig {
    /// No telemetry.
    pub const OFF: Self = Self {
        every_ticks: 0,
        channels: Channels::NONE,
    };
}

/// One sample of the drive loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Telemetry {
    /// Tick of the drive loop.
    pub tick: u64,
    /// Samples dropped on the board since telemetry was set.
    pub dropped: u32,
    /// State after the tick.
    pub state: State,
    /// Time in the trajectory, in ticks of 0.1 µs.
    pub path_ticks: u32,
    /// Path speed as a part of the planned one, 0 to 1.
    pub path_speed: f32,
    /// What follows.
    pub channels: Channels,
    /// The values of the chosen channels in the order of [`Channels::VALUES`], each axis by axis;
    /// NaN where nothing was measured.
    pub values: Vec<f32, { MAX_CHANNELS * MAX_AXES }>,
    /// Limits in force, axis by axis, if that channel is chosen.
    pub limited: Vec<LimitFlags, MAX_AXES>,
}

impl Telemetry {
    /// Values of one channel, axis by axis; none if it was not chosen.
    pub fn channel(&self, channel: Channels) -> &[f32] {
        let chosen = || {
            Channels::VALUES
                .into_iter()
                .filter(|&one| self.channels.contains(one))
        };
        let (Some(place), count) = (chosen().position(|one| one == channel), chosen().count())
        else {
            return &[];
        };
        let axes = self.values.len().checked_div(count).unwrap_or_default();
        self.values
            .get(place * axes..(place + 1) * axes)
            .unwrap_or_default()
    }
}
