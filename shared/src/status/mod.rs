//! What an executor says about itself, on the wire as on the board: where it is, why it refuses,
//! why it stopped, which limits are in force.
//!
//! The order of an enum's variants is the wire format (postcard writes their index): append, never
//! reorder.

mod cause_words;
mod command;
mod config_error;
mod drive;
mod fault;
mod flags;
mod refusal;
mod rejection;
mod start;
mod state;

pub use command::Command;
pub use config_error::{ConfigError, ConfigField};
pub use drive::DriveStatus;
pub use fault::{Fault, FaultCause};
pub use flags::LimitFlags;
pub use refusal::Refusal;
pub use rejection::{Limit, Place, Quantity, Rejection};
pub use start::{CommsPolicy, HoldReason, StartRequest};
pub use state::State;
