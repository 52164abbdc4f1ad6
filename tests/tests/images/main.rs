//! The linked images: what they need, and how long a tick takes.

mod ticks;
