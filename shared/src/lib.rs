//! What planner and board must agree on, to the bit.
//!
//! A [`Trajectory`] is a list of intervals; in each, every axis' position, velocity and torque at
//! the reducer output are polynomials given by their values at the Legendre–Gauss–Radau (LGR)
//! points and at the interval's end. The planner writes it, the board checks it against its
//! [`Limits`] and evaluates it with a [`Player`]: the same code in the same order of operations on
//! both, so a replay on the host equals the board's set-points bit for bit.
//!
//! No allocation, no unsafe code, no panic on any bytes; SI units everywhere, time in integer ticks
//! of 0.1 µs.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod assembly;
pub mod basis;
pub mod config;
pub mod crc;
pub mod decode;
pub mod drive_config;
pub mod drive_error;
pub mod encode;
pub mod hash;
pub mod lgr;
pub mod limits;
pub mod player;
pub mod protocol;
pub mod status;
pub mod time;
pub mod trajectory;

mod error;
mod ordinal;
mod wire;

pub use basis::Basis;
pub use drive_config::{AxisDrive, BusConfig, DriveConfig, DriveConfigError};
pub use limits::{AxisLimits, LimitName, Limits, LimitsError};
pub use ordinal::ordinal;
pub use player::{Player, Sample, Schedule};
pub use trajectory::{Header, Interval, Trajectory, TrajectoryBuilder, TrajectoryError};

/// Most axes a trajectory, a set of limits or a drive group can have.
pub const MAX_AXES: usize = 6;

/// Relative tolerance (1e-4) by which an accepted value may exceed a limit.
///
/// Solvers meet active bounds to 1e-6…1e-8 relative and f32 rounds at 6e-8; a machine does not
/// notice 1e-4. The board's acceptance check and its limiter use the same number, so a plan that
/// touches its bounds is neither rejected nor flagged for rounding.
pub const LIMIT_TOLERANCE: f32 = 1e-4;
