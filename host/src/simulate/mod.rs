//! Simulation of any [`Plant`](crate::machine::Plant): what the machine does when its motors follow a path exactly
//! ([`ideal`]), and when they are driven by the firmware's executor through servo drives ([`closed_loop`]).

pub mod closed_loop;
pub mod drives;
pub mod ideal;
mod linear;
pub mod metrics;
pub mod modes;
pub mod ode;
pub mod path;
pub mod planned;
pub mod profile;
pub mod recording;
pub mod ringing;
pub mod settings;
pub mod shaper;
pub mod shipped;
pub mod shortest;
pub mod stepper;
pub mod trajectory;
pub mod usage;

pub use closed_loop::{ClosedLoop, ClosedLoopError};
pub use metrics::Metrics;
pub use recording::{Frame, Recording};
pub use settings::{DriveSettings, DriveSettingsError};

#[cfg(test)]
mod tests;
