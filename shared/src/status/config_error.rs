//! Why an executor's configuration is impossible.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::config::LEAST_RAMP_S;

/// A number of the executor's configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigField {
    /// Period of the tick.
    PeriodTicks,
    /// Speed at which an armed axis creeps to the first node.
    ApproachSpeed,
    /// Speed below which an axis stands.
    StandstillSpeed,
    /// Shortest time from full path speed to none.
    RampTime,
    /// Largest distance from the first node at start.
    StartTolerance,
    /// Following error allowed at rest.
    FollowingAtRest,
    /// Following error allowed per speed.
    FollowingLag,
    /// Greatest age of feedback.
    FeedbackAge,
    /// Longest duration of a tick.
    BusyLimit,
}

impl ConfigField {
    /// The smallest number that is allowed.
    pub(crate) const fn least(self) -> f32 {
        match self {
            Self::PeriodTicks => 1.0,
            Self::RampTime => LEAST_RAMP_S,
            _ => 0.0,
        }
    }
}

impl fmt::Display for ConfigField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PeriodTicks => "period_ticks",
            Self::ApproachSpeed => "approach_speed_rad_per_s",
            Self::StandstillSpeed => "standstill_speed_rad_per_s",
            Self::RampTime => "ramp_s",
            Self::StartTolerance => "accept.start_tolerance_rad",
            Self::FollowingAtRest => "monitor.following_at_rest_rad",
            Self::FollowingLag => "monitor.following_lag_s",
            Self::FeedbackAge => "monitor.feedback_age_ticks",
            Self::BusyLimit => "monitor.busy_limit_ticks",
        })
    }
}

/// Why an executor cannot be configured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The limits are of another number of axes.
    Axes {
        /// Axes of the limits.
        limits: u8,
        /// Axes of the executor.
        executor: u8,
    },
    /// A number is not finite, too small or too large.
    Value {
        /// Which.
        field: ConfigField,
        /// Its value.
        value: f32,
        /// The largest that is allowed.
        most: f32,
    },
    /// The board's drive loop has another period.
    Period {
        /// Period given, in time ticks of 0.1 µs.
        given_ticks: u32,
        /// Period of the board, in time ticks of 0.1 µs.
        board_ticks: u32,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { limits, executor } => {
                write!(
                    f,
                    "the limits are of {limits} axes, the board runs exactly {executor}: \
                     use a move file of {executor} axes, or a board built for {limits}"
                )
            }
            Self::Value { field, value, most } => write!(
                f,
                "{field} is {value}: give a number from {} to {most}",
                field.least()
            ),
            Self::Period {
                given_ticks,
                board_ticks,
            } => write!(
                f,
                "a period of {} µs was given, the board's is {} µs: it cannot be changed",
                f64::from(given_ticks) / 10.0,
                f64::from(board_ticks) / 10.0
            ),
        }
    }
}

impl core::error::Error for ConfigError {}
