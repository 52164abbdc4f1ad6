//! The emulated board end to end: the very image that runs on QEMU's STM32F405, over the wire, by the library of the
//! host. Without the image, which `cargo image-qemu` builds, these tests fail.

mod bench;
mod faults;
mod halts;
mod moves;
mod refusals;
mod replay;
mod resets;
mod study;
mod ticks;
mod uploads;
