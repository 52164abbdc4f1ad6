//! States of the executor, the commands it takes, and why it refuses one.

use core::fmt;

use crate::{FaultCause, Rejection};

/// Where the executor is.
///
/// | state | drives | left by |
/// |---|---|---|
/// | `Idle` | off | `load` → `Ready` |
/// | `Ready` | off | `arm` → `Armed` |
/// | `Armed` | on, at the first node | `start` → `Running`, `disarm` → `Ready` |
/// | `Running` | on | the end → `Done` |
/// | `Done` | on, at the last node | `load` → `Armed`, `disarm` → `Ready` |
/// | `Fault` | off | `clear` → `Ready`, or `Idle` if nothing is loaded |
///
/// Every state goes to `Fault` by a [`FaultCause`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum State {
    /// Nothing is loaded.
    Idle,
    /// A trajectory is loaded.
    Ready,
    /// The drives hold the first node.
    Armed,
    /// The trajectory plays.
    Running,
    /// The drives hold the last node.
    Done,
    /// The torque is off until `clear`.
    Fault,
}

impl State {
    /// All states.
    pub const ALL: [Self; 6] = [
        Self::Idle,
        Self::Ready,
        Self::Armed,
        Self::Running,
        Self::Done,
        Self::Fault,
    ];

    /// Whether the drives are commanded.
    pub const fn is_energised(self) -> bool {
        matches!(self, Self::Armed | Self::Running | Self::Done)
    }
}

/// What the executor can be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Command {
    /// Take a trajectory.
    Load,
    /// Energise the drives at the first node.
    Arm,
    /// Play.
    Start,
    /// Switch the drives off at rest.
    Disarm,
    /// Leave `Fault`.
    Clear,
}

impl Command {
    /// The states in which the command is taken.
    pub const fn allowed_in(self) -> &'static [State] {
        match self {
            Self::Load => &[State::Idle, State::Ready, State::Armed, State::Done],
            Self::Arm => &[State::Ready],
            Self::Start => &[State::Armed],
            Self::Disarm => &[State::Armed, State::Done],
            Self::Clear => &[State::Fault],
        }
    }
}

/// Why a command was refused; nothing has changed then.
#[derive(Debug, Clone, Copy, PartialEq)]
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
            Self::NoFeedback => write!(f, "the drives send no feedback: check the bus"),
            Self::Feedback(cause) => cause.fmt(f),
            Self::NotEnabled { axis } => write!(
                f,
                "the drive of axis {axis} is not enabled yet: wait, then try again"
            ),
            Self::NotAtStart {
                axis,
                measured_rad,
                first_rad,
                tolerance_rad,
            } => write!(
                f,
                "axis {axis} stands at {measured_rad} rad, the move starts at {first_rad} rad, {tolerance_rad} rad are allowed: \
                 bring it there first"
            ),
            Self::Approaching { axis, distance_rad } => {
                write!(
                    f,
                    "axis {axis} is still {distance_rad} rad from the first node: wait, then try again"
                )
            }
        }
    }
}

impl core::error::Error for Refusal {}
