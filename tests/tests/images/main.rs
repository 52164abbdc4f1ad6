//! What can be proved about the linked images, and how long a tick takes on the emulated board.
//!
//! Needs the images: `cargo image-qemu` and `cargo image-f405`.

mod linked;
mod ticks;
