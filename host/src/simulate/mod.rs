//! Simulation of any [`Plant`](crate::machine::Plant): what the machine does when its motors follow a path exactly
//! ([`ideal`]), and when they are driven by the firmware's executor through servo drives.

pub mod ideal;
mod linear;
pub mod metrics;
pub mod modes;
pub mod ode;
pub mod path;
pub mod profile;
pub mod recording;
pub mod shortest;
pub mod usage;

#[cfg(test)]
mod tests;
