//! Configuration of the executor, apart from its state: it crosses the wire and is stored.

use crate::status::{ConfigError, ConfigField};
use crate::time::DRIVE_PERIOD_TICKS;
use serde::{Deserialize, Serialize};

/// How an executor plays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Period of the tick in time ticks of 0.1 µs.
    pub period_ticks: u32,
    /// Speed in rad/s at which an armed axis creeps from where it stands to the first node.
    pub approach_speed_rad_per_s: f32,
    /// Measured speed in rad/s below which an axis stands: then a hold is reported done.
    pub standstill_speed_rad_per_s: f32,
    /// Shortest time in s from full path speed to none and back; most moves need longer, see
    /// the firmware's `pace`. A quick stop takes [`QUICK_STOP_RAMP_S`] where this is more.
    pub ramp_s: f32,
    /// What a trajectory is checked for.
    pub accept: AcceptConfig,
    /// What the feedback is watched for.
    pub monitor: MonitorConfig,
}

/// Greatest `ramp_s` of a quick stop, in s.
pub const QUICK_STOP_RAMP_S: f32 = 0.02;

impl Default for Config {
    /// 4 kHz; creeping at 0.05 rad/s, standing below 0.1 rad/s, ramps of 20 ms.
    fn default() -> Self {
        Self {
            period_ticks: DRIVE_PERIOD_TICKS,
            approach_speed_rad_per_s: 0.05,
            standstill_speed_rad_per_s: 0.1,
            ramp_s: QUICK_STOP_RAMP_S,
            accept: AcceptConfig::default(),
            monitor: MonitorConfig::default(),
        }
    }
}

/// Shortest ramp in s: in less, rounding leaves nothing of a change of path speed.
pub(crate) const LEAST_RAMP_S: f32 = 1e-3;

impl Config {
    /// Nothing is set: all bytes are zero, for an executor that waits for its configuration.
    pub const UNSET: Self = Self {
        period_ticks: 0,
        approach_speed_rad_per_s: 0.0,
        standstill_speed_rad_per_s: 0.0,
        ramp_s: 0.0,
        accept: AcceptConfig {
            start_tolerance_rad: 0.0,
            torque_free_ends: false,
        },
        monitor: MonitorConfig {
            following_at_rest_rad: 0.0,
            following_lag_s: 0.0,
            feedback_age_ticks: 0,
            busy_limit_ticks: 0,
        },
    };

    /// Whether an executor can play like this, and whether it is watched: what is allowed has a
    /// bound, far above what a machine needs, beyond which a monitor would see nothing any more.
    pub fn check(&self) -> Result<(), ConfigError> {
        use ConfigField as Field;
        let Self {
            period_ticks,
            accept,
            monitor,
            ..
        } = self;
        let period = *period_ticks as f32;
        for (field, value, most) in [
            (Field::PeriodTicks, period, 100_000.0),
            (Field::ApproachSpeed, self.approach_speed_rad_per_s, 1.0),
            (Field::StandstillSpeed, self.standstill_speed_rad_per_s, 1.0),
            (Field::RampTime, self.ramp_s, 1.0),
            (Field::StartTolerance, accept.start_tolerance_rad, 0.1),
            (Field::FollowingAtRest, monitor.following_at_rest_rad, 1.0),
            (Field::FollowingLag, monitor.following_lag_s, 0.1),
            (
                Field::FeedbackAge,
                f32::from(monitor.feedback_age_ticks),
                20.0,
            ),
            (Field::BusyLimit, monitor.busy_limit_ticks as f32, period),
        ] {
            if !(value >= field.least() && value <= most) {
                return Err(ConfigError::Value { field, value, most });
            }
        }
        Ok(())
    }
}

/// What acceptance can be told.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AcceptConfig {
    /// Largest distance of the measured position from the first node, in rad.
    pub start_tolerance_rad: f32,
    /// Whether the torque must be zero at both ends: true unless a load, such as gravity, is held
    /// there.
    pub torque_free_ends: bool,
}

impl Default for AcceptConfig {
    /// 1 mrad, and no torque at the ends.
    fn default() -> Self {
        Self {
            start_tolerance_rad: 1e-3,
            torque_free_ends: true,
        }
    }
}

/// What the monitor allows drives that answer in every tick. What a bus needs is added by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MonitorConfig {
    /// Following error allowed at rest, in rad.
    pub following_at_rest_rad: f32,
    /// Following error allowed per commanded speed, in rad per rad/s: the lag of the drives in
    /// seconds. The lag of a bus comes on top.
    pub following_lag_s: f32,
    /// Greatest age of feedback, in drive ticks. On a bus, where not every tick brings an answer:
    /// answers that may be lost in a row. See [`Cycle::monitor`](crate::drive_config::Cycle::monitor).
    pub feedback_age_ticks: u16,
    /// Longest duration of a tick during a move, in time ticks of 0.1 µs.
    pub busy_limit_ticks: u32,
}

impl Default for MonitorConfig {
    /// 10 mrad at rest and 2 ms of lag; two lost messages; 200 µs, four fifths of the usual period.
    fn default() -> Self {
        Self {
            following_at_rest_rad: 0.01,
            following_lag_s: 2e-3,
            feedback_age_ticks: 2,
            busy_limit_ticks: 2_000,
        }
    }
}
