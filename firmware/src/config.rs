//! Configuration of the executor, apart from its state.

use core::fmt;

use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

use crate::accept::AcceptConfig;
use crate::monitor::MonitorConfig;

/// How an executor plays.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Period of the tick in time ticks of 0.1 µs.
    pub period_ticks: u32,
    /// Speed in rad/s at which an armed axis creeps from where it stands to the first node.
    pub approach_speed_rad_per_s: f32,
    /// What a trajectory is checked for.
    pub accept: AcceptConfig,
    /// What the feedback is watched for.
    pub monitor: MonitorConfig,
}

impl Default for Config {
    /// 4 kHz and 0.05 rad/s.
    fn default() -> Self {
        Self {
            period_ticks: DRIVE_PERIOD_TICKS,
            approach_speed_rad_per_s: 0.05,
            accept: AcceptConfig::default(),
            monitor: MonitorConfig::default(),
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        if self.period_ticks == 0 {
            return Err(ConfigError::Value {
                name: "period_ticks",
                value: 0.0,
            });
        }
        for (name, value) in [
            ("approach_speed_rad_per_s", self.approach_speed_rad_per_s),
            (
                "accept.start_tolerance_rad",
                self.accept.start_tolerance_rad,
            ),
            (
                "monitor.following_at_rest_rad",
                self.monitor.following_at_rest_rad,
            ),
            ("monitor.following_lag_s", self.monitor.following_lag_s),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ConfigError::Value { name, value });
            }
        }
        Ok(())
    }
}

/// Why an executor cannot be made.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The limits are of another number of axes.
    Axes {
        /// Axes of the limits.
        limits: usize,
        /// Axes of the executor.
        executor: usize,
    },
    /// A number of the configuration is not finite, negative, or a period of zero.
    Value {
        /// Name of the field of [`Config`].
        name: &'static str,
        /// Its value.
        value: f32,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { limits, executor } => {
                write!(
                    f,
                    "the limits are of {limits} axes, the executor of {executor}: give one set per axis"
                )
            }
            Self::Value { name, value } => write!(
                f,
                "{name} is {value}: give a finite number that is not negative"
            ),
        }
    }
}

impl core::error::Error for ConfigError {}
