//! Why a command was refused.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{Command, ConfigError, FaultCause, Rejection, State};
use crate::assembly::AssemblyError;
use crate::{TrajectoryError, ordinal};

/// Why a command was refused; nothing has changed then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// The command is not taken in this state.
    WrongState {
        /// The command.
        command: Command,
        /// The state the executor is in.
        state: State,
    },
    /// The trajectory is not acceptable.
    Rejected(Rejection),
    /// There is no feedback from the drives.
    NoFeedback,
    /// The feedback of an axis cannot be believed.
    Feedback(FaultCause),
    /// A drive is not enabled yet.
    NotEnabled {
        /// Axis, from 0.
        axis: u8,
    },
    /// An axis does not stand at the first node.
    NotAtStart {
        /// Axis, from 0.
        axis: u8,
        /// Measured position in rad.
        measured_rad: f32,
        /// Position of the first node in rad.
        first_rad: f32,
        /// The greatest distance allowed, in rad.
        tolerance_rad: f32,
    },
    /// The set-point of an axis is still on its way from where the axis stood to the first node.
    Approaching {
        /// Axis, from 0.
        axis: u8,
        /// Distance left, in rad.
        distance_rad: f32,
    },
    /// The executor has no limits yet.
    NotConfigured,
    /// The upload does not fit together.
    Upload(AssemblyError),
    /// What was sent is no trajectory, or not the one that was announced.
    Trajectory(TrajectoryError),
    /// Another trajectory is meant than the one that is loaded.
    OtherTrajectory {
        /// Content hash that was quoted.
        quoted: u64,
        /// Content hash of the loaded one.
        loaded: u64,
    },
    /// Other limits are meant than the machine's.
    OtherLimits {
        /// Hash that was quoted.
        quoted: u64,
        /// Hash of the machine's limits.
        machine: u64,
    },
    /// An override beyond 100 %.
    Override {
        /// What was asked for, in per cent.
        percent: u8,
    },
    /// A policy for lost communication needs a time to wait.
    NoCommsTimeout,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The configuration is impossible.
    Configuration(ConfigError),
}

impl From<ConfigError> for Refusal {
    fn from(error: ConfigError) -> Self {
        Self::Configuration(error)
    }
}

impl From<AssemblyError> for Refusal {
    fn from(error: AssemblyError) -> Self {
        Self::Upload(error)
    }
}

impl From<TrajectoryError> for Refusal {
    fn from(error: TrajectoryError) -> Self {
        Self::Trajectory(error)
    }
}

impl From<Rejection> for Refusal {
    fn from(rejection: Rejection) -> Self {
        Self::Rejected(rejection)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::WrongState { command, state } => {
                write!(
                    f,
                    "{command:?} is not possible in state {state:?}, only in {:?}",
                    command.allowed_in()
                )
            }
            Self::Rejected(rejection) => rejection.fmt(f),
            Self::NoFeedback => write!(
                f,
                "the drives send no feedback: check the bus and the configuration of the drives"
            ),
            Self::Feedback(cause) => cause.fmt(f),
            Self::NotEnabled { axis } => write!(
                f,
                "the drive of axis {axis} is not enabled yet: wait, then try again",
                axis = ordinal(axis)
            ),
            Self::NotAtStart {
                axis,
                measured_rad,
                first_rad,
                tolerance_rad,
            } => write!(
                f,
                "axis {axis} stands at {measured_rad} rad, the move starts at {first_rad} rad, {tolerance_rad} rad are allowed: \
                 bring it there first",
                axis = ordinal(axis)
            ),
            Self::Approaching { axis, distance_rad } => {
                write!(
                    f,
                    "axis {axis} is still {distance_rad} rad from the first node: wait, then try again",
                    axis = ordinal(axis)
                )
            }
            Self::NotConfigured => write!(
                f,
                "the board does not know the machine's limits: send them with `stillpoint device config --move MOVE.toml`, or \
                 `run` with `--move MOVE.toml`"
            ),
            Self::Upload(error) => error.fmt(f),
            Self::Trajectory(error) => error.fmt(f),
            Self::OtherTrajectory { quoted, loaded } => write!(
                f,
                "trajectory {quoted:016x} was meant, {loaded:016x} is loaded: upload the one that is meant"
            ),
            Self::OtherLimits { quoted, machine } => write!(
                f,
                "limits {quoted:016x} were meant, the machine has {machine:016x}: \
                 plan with the machine's limits or configure the board"
            ),
            Self::Override { percent } => {
                write!(f, "an override of {percent} % was asked for: give 0 to 100")
            }
            Self::NoCommsTimeout => write!(
                f,
                "the policy for lost communication needs a time to wait: give one tick at least"
            ),
            Self::EmergencyStop => write!(
                f,
                "the emergency stop is pressed: release it, then try again"
            ),
            Self::Configuration(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Refusal {}
