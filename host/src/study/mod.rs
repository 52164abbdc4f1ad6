//! Studies of a move: runs of a trajectory and of what a user would pick instead, side by side.

pub mod compare;
mod document;
mod on_board;
mod parallel;
mod random_moves;
mod run;

pub use document::{Document, paper_row};
pub use on_board::{BoardError, BoardRun, Step, play_on_board};
pub use random_moves::{PAYLOADS, RandomMove, random_moves};
pub use run::{Run, StudyError, equal_quintic, play, shortest_shaped};
