//! First guesses: states and controls at any share of the duration.

use super::solution::Solution;

/// States and controls at one moment.
pub type Point = (Vec<f64>, Vec<f64>);

/// States x(s) and controls u(s) over the share s ∈ [0, 1] of a guessed duration.
pub struct Guess {
    duration_s: f64,
    at: Box<dyn Fn(f64) -> Point>,
}

impl Guess {
    /// A guess from a function of the share of the duration.
    pub fn new(duration_s: f64, at: impl Fn(f64) -> Point + 'static) -> Self {
        Self {
            duration_s,
            at: Box::new(at),
        }
    }

    /// A straight line between two states, with constant controls.
    #[must_use]
    pub fn line(duration_s: f64, from: Vec<f64>, to: Vec<f64>, control: Vec<f64>) -> Self {
        Self::new(duration_s, move |s| {
            let state = from.iter().zip(&to).map(|(a, b)| a + s * (b - a)).collect();
            (state, control.clone())
        })
    }

    /// The interpolant of a solution, for another mesh or a changed problem.
    #[must_use]
    pub fn from_solution(solution: Solution) -> Self {
        Self::new(solution.duration_s, move |s| {
            (solution.state_at_share(s), solution.control_at_share(s))
        })
    }

    /// Guessed duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// States and controls at a share of the duration.
    #[must_use]
    pub fn at(&self, share: f64) -> Point {
        (self.at)(share)
    }
}
