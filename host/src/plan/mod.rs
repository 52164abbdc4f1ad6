//! Planning a move: problem, first guess, solve.

mod guess;
mod problem;

pub use guess::quintic_guess;
pub use problem::move_problem;
