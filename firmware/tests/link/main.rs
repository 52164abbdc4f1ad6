//! The board's side of the protocol: every request, and what the line can do to it.

mod access;
#[path = "../common/mod.rs"]
mod common;
mod line;
mod requests;
mod rig;
mod sampling;
mod settings;
mod stale;
mod uploads;
