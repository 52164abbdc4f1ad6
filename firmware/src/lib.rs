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
pub mod bench;
mod between;
mod buffers;
pub mod can_filters;
pub mod can_timing;
mod channels;
pub mod cia402;
mod comms;
pub mod drive;
pub mod executor;
pub mod ideal;
pub mod inputs;
pub mod limiter;
pub mod link;
pub mod loop_time;
pub mod monitor;
pub mod pace;
pub mod path_time;
pub mod pll;
pub mod ramp;
pub mod record;
mod root;
pub mod safety_io;
mod slot;
pub mod stand_in;
pub mod store;

pub use cia402::Cia402Group;
pub use drive::{DriveGroup, DriveStatus, Feedback, Setpoint};
pub use executor::{Executor, TickReport};
pub use ideal::IdealDrives;
pub use inputs::TickInputs;
pub use link::{Link, Machine};
pub use record::FaultRecord;

pub use stillpoint_shared::config::{self, Config};
pub use stillpoint_shared::status::{
    Command, CommsPolicy, ConfigError, ConfigField, Fault, FaultCause, HoldReason, LimitFlags,
    Refusal, Rejection, StartRequest, State,
};
