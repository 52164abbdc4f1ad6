//! What the board images share: registers, and nothing that can be tested without them.
#![allow(unreachable_pub)] // RTIC wants the types of its resources public, and a binary is not.

pub mod build_id;
mod log;
mod memory;
mod panic;
pub mod receive;
pub mod retained;
pub mod serve;
pub mod timer;
pub mod uart;

#[cfg(feature = "f405")]
pub mod can;
#[cfg(feature = "f405")]
pub mod clock;
#[cfg(feature = "f405")]
pub mod flash;
#[cfg(feature = "f405")]
pub mod pins;
#[cfg(feature = "f405")]
#[path = "rtt.rs"]
mod sink;
#[cfg(feature = "f405")]
pub mod watchdog;

#[cfg(feature = "qemu")]
pub mod bench_port;
#[cfg(feature = "qemu")]
pub mod ram_flash;
#[cfg(feature = "qemu")]
#[path = "semihosting.rs"]
pub mod sink;
#[cfg(feature = "qemu")]
pub mod stack;
#[cfg(feature = "qemu")]
pub mod stopwatch;
