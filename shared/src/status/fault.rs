//! Faults: reasons to take the torque away, latched with the first one.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::{drive_error, ordinal};

/// The first cause since the last `clear`, and when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fault {
    /// What happened.
    pub cause: FaultCause,
    /// Tick of the drive loop in which it was seen.
    pub tick: u64,
}

/// Why the executor took the torque away.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FaultCause {
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The bus to the drives failed as a whole.
    ExchangeFailed,
    /// A drive stopped by itself, or the board sees that it cannot be used.
    DriveFault {
        /// Axis, from 0.
        axis: u8,
        /// The drive's own code, or one of [`drive_error::seen`].
        code: u16,
    },
    /// A drive stopped following its set-points without saying why.
    DriveDisabled {
        /// Axis, from 0.
        axis: u8,
    },
    /// A measured position or velocity is no finite number.
    FeedbackNotFinite {
        /// Axis, from 0.
        axis: u8,
    },
    /// A measurement is too old.
    FeedbackStale {
        /// Axis, from 0.
        axis: u8,
        /// Its age in drive ticks.
        age_ticks: u16,
        /// The greatest age allowed, in drive ticks.
        limit_ticks: u16,
    },
    /// An axis is too far from its set-point.
    FollowingError {
        /// Axis, from 0.
        axis: u8,
        /// Set-point minus measured position, in rad.
        error_rad: f32,
        /// The greatest distance allowed at the commanded speed, in rad.
        limit_rad: f32,
    },
    /// There was nothing to play.
    NothingLoaded,
    /// A quick stop was asked for.
    QuickStop,
    /// Nothing was heard from the host, and the policy chosen at start is a quick stop.
    CommsLost {
        /// Drive ticks since something was heard.
        silent_ticks: u32,
        /// The longest silence allowed, in drive ticks.
        limit_ticks: u32,
    },
    /// The previous tick took too long.
    LoopOverrun {
        /// Its duration in time ticks of 0.1 µs.
        duration_ticks: u32,
        /// The longest duration allowed, in time ticks of 0.1 µs.
        limit_ticks: u32,
    },
    /// Ticks of the drive loop were left out during a move.
    TicksMissed {
        /// How many.
        missed: u16,
    },
    /// The board started anew while the drives were on; found afterwards in the fault record.
    Restart,
    /// An armed axis that was not enabled yet moved away from the first node.
    LeftStart {
        /// Axis, from 0.
        axis: u8,
        /// First node minus measured position, in rad.
        distance_rad: f32,
        /// The greatest distance allowed, in rad.
        tolerance_rad: f32,
    },
    /// A drive was armed and is not enabled.
    NotEnabled {
        /// Axis, from 0.
        axis: u8,
        /// Drive ticks since it was armed.
        waited_ticks: u32,
        /// The longest wait allowed, in drive ticks.
        limit_ticks: u32,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (tick {})", self.cause, self.tick)
    }
}

impl fmt::Display for FaultCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::EmergencyStop => {
                write!(f, "the emergency stop is pressed: release it, then clear")
            }
            Self::ExchangeFailed => write!(
                f,
                "the bus to the drives failed: check cabling and supply, then clear"
            ),
            Self::DriveFault { axis, code } => {
                write!(
                    f,
                    "the drive of axis {axis} is in fault {code:04X}h, {}; {}",
                    drive_error::words(code),
                    drive_error::cure(code),
                    axis = ordinal(axis)
                )
            }
            Self::DriveDisabled { axis } => {
                write!(
                    f,
                    "the drive of axis {axis} stopped following: check its supply and enable input, then clear",
                    axis = ordinal(axis)
                )
            }
            Self::FeedbackNotFinite { axis } => {
                write!(
                    f,
                    "the position or velocity of axis {axis} is no number: check its encoder, then clear",
                    axis = ordinal(axis)
                )
            }
            Self::FeedbackStale {
                axis,
                age_ticks,
                limit_ticks,
            } => write!(
                f,
                "the feedback of axis {axis} is {age_ticks} ticks old, {limit_ticks} are allowed: check the bus, then clear",
                axis = ordinal(axis)
            ),
            Self::FollowingError {
                axis,
                error_rad,
                limit_rad,
            } => write!(
                f,
                "axis {axis} is {error_rad} rad from its set-point, {limit_rad} rad are allowed: \
                 check for obstacles, load and drive gains, then clear",
                axis = ordinal(axis)
            ),
            Self::NothingLoaded => {
                write!(f, "there is nothing to play: load a trajectory, then clear")
            }
            Self::QuickStop => write!(f, "a quick stop was asked for: clear to go on"),
            Self::CommsLost {
                silent_ticks,
                limit_ticks,
            } => write!(
                f,
                "nothing was heard from the host for {silent_ticks} ticks, {limit_ticks} are allowed: \
                 check the link, then clear"
            ),
            Self::LoopOverrun {
                duration_ticks,
                limit_ticks,
            } => write!(
                f,
                "a tick of the drive loop took {} µs, {} µs are allowed: lower the tick rate, then clear",
                f64::from(duration_ticks) / 10.0,
                f64::from(limit_ticks) / 10.0
            ),
            Self::TicksMissed { missed } => write!(
                f,
                "the drive loop left out {missed} ticks during a move: lower the tick rate, then clear"
            ),
            Self::Restart => write!(
                f,
                "the board started anew while the drives were on: check its supply and its log"
            ),
            Self::LeftStart {
                axis,
                distance_rad,
                tolerance_rad,
            } => write!(
                f,
                "armed and not enabled yet, axis {axis} is {distance_rad} rad from the first node, \
                 {tolerance_rad} rad are allowed: check what moves it, then clear",
                axis = ordinal(axis)
            ),
            Self::NotEnabled {
                axis,
                waited_ticks,
                limit_ticks,
            } => write!(
                f,
                "the drive of axis {axis} is not enabled {waited_ticks} ticks after it was armed, \
                 {limit_ticks} are allowed: check its supply and enable input, then clear",
                axis = ordinal(axis)
            ),
        }
    }
}
