//! What the board images share: registers, and nothing that can be tested without them.
#![allow(unreachable_pub)] // RTIC wants the types of its resources public, and a binary is not.

#[cfg(feature = "qemu")]
pub mod bench_port;
pub mod build_id;
#[cfg(feature = "f405")]
pub mod can;
#[cfg(feature = "f405")]
pub mod clock;
#[cfg(feature = "f405")]
pub mod flash;
mod log;
mod panic;
#[cfg(feature = "f405")]
pub mod pins;
pub mod retained;
pub mod serve;
pub mod timer;
pub mod uart;
#[cfg(feature = "f405")]
pub mod watchdog;

#[cfg(feature = "qemu")]
pub mod ram_flash;
#[cfg(feature = "f405")]
#[path = "rtt.rs"]
pub mod sink;
#[cfg(feature = "qemu")]
#[path = "semihosting.rs"]
pub mod sink;
#[cfg(feature = "qemu")]
pub mod stack;
