//! What is done with arbitrary bytes, in search of a panic, an overflow or a broken promise.
//!
//! Each function takes bytes and returns whatever they are; it panics where a promise is broken. The fuzzer
//! (`tests/fuzz`) looks for such bytes guided by coverage, a test with a loop of mutations.

mod board;
mod bytes;
mod frames;
mod messages;
mod seeds;
mod store;
mod trajectory;

pub use board::board;
pub use frames::frames;
pub use messages::messages;
pub use seeds::{Seed, seeds};
pub use store::store;
pub use trajectory::trajectory;

/// A function to fuzz, by name.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: [Target; 5] = [
    ("frames", frames),
    ("messages", messages),
    ("trajectory", trajectory),
    ("store", store),
    ("board", board),
];
