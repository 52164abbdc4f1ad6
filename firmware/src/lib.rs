//! Plays planned moves on servo drives: hardware-free, so that the same code runs on the board, in
//! the host's simulator and in the tests.
//!
//! Once per tick the [`Executor`] evaluates the loaded trajectory, passes the set-points through
//! the [`limiter`], hands them to a [`DriveGroup`] and lets the [`monitor`] look at the feedback.
//! What a machine may run is decided before, by [`accept`]: a trajectory is rejected with axis,
//! interval, time, value and limit, and never clipped into shape.
//!
//! No allocation, no unsafe code, no panic. Angles, speeds and torques are at the joint (reducer
//! output), in SI units.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod accept;
pub mod cia402;
pub mod command;
pub mod config;
pub mod drive;
pub mod executor;
pub mod fault;
pub mod ideal;
pub mod limiter;
pub mod monitor;
pub mod rejection;
pub mod safety_io;

pub use cia402::Cia402Group;
pub use command::{Command, Refusal, State};
pub use config::{Config, ConfigError};
pub use drive::{DriveGroup, DriveStatus, Feedback, Setpoint};
pub use executor::{Executor, TickReport};
pub use fault::{Fault, FaultCause};
pub use ideal::IdealDrives;
pub use limiter::LimitFlags;
pub use rejection::Rejection;
