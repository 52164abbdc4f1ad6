//! Stillpoint.
fn main() {}
