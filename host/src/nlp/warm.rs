//! How an interior-point method starts from a known solution.
//!
//! The barrier keeps iterates away from the bounds that a solution lies on. Started too high, it
//! first walks away from the solution and then back; started too low, it cannot leave bounds that
//! are no longer active. Iterations measured on the paper's move and an elastic axis, from the
//! solution itself and from that of other limits: elastic ones −5 %, torque and its rate −2 %,
//! elastic ones +5 %, torque rate +30 %:
//!
//! | barrier, distance | paper | axis |
//! |---|---|---|
//! | cold | 22 · 24 22 24 26 | 22 · 21 22 23 22 |
//! | 1e-4, 1e-6 | 26 · 25 21 21 22 | 19 · 22 20 16 18 |
//! | 1e-5, 1e-5 | 15 · 16 12 15 16 | 12 · 11 12 12 14 |
//! | 1e-7, 1e-9 | 1 · 37 11 27 44 | 1 · 14 5 37 39 |
//!
//! So the start decides: one that still solves the problem continues, any other takes the third
//! row. Where the barrier is not lowered to zero, solutions keep their distance from the bounds, and any start takes the
//! barrier at which its solve will end: on the paper's move with limits at ever more places 10, 6 and 3 iterations instead of 8,
//! 13 and 13.

use super::{Multipliers, NlpProblem, Settings};
use crate::ocp::Bounds;

/// Where a warm start begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WarmStart {
    /// First barrier parameter.
    pub(super) barrier: f64,
    /// Least distance from bounds, and least multiplier of one.
    pub(super) distance: f64,
}

impl WarmStart {
    /// For the problem's start, if that has multipliers.
    pub(super) fn of(problem: &mut dyn NlpProblem, settings: &Settings) -> Option<Self> {
        let tolerance = settings.tolerance;
        let start = problem.start().clone();
        let warm = start.warm?;
        Some(if settings.least_barrier > 0.0 {
            // The start is as far from its limits as the answer will be. From any nearer the solve would end there.
            Self {
                barrier: settings.least_barrier,
                distance: settings.least_barrier,
            }
        } else if error(problem, &start.x, &warm) <= 10.0 * tolerance {
            Self {
                barrier: 0.1 * tolerance,
                distance: 1e-3 * tolerance,
            }
        } else {
            Self {
                barrier: 1e-5,
                distance: 1e-5,
            }
        })
    }
}

/// Largest violation of bounds and constraints, and of complementarity with them.
fn error(problem: &mut dyn NlpProblem, x: &[f64], warm: &Multipliers) -> f64 {
    let mut values = vec![0.0; problem.constraint_bounds().len()];
    problem.constraints(x, &mut values);
    let variables = problem.variable_bounds().iter().zip(x);
    let of_variables = variables
        .zip(warm.lower.iter().zip(&warm.upper))
        .map(|((bounds, x), (lower, upper))| gap(*bounds, *x, *lower, *upper));
    let constraints = problem.constraint_bounds().iter().zip(&values);
    let of_constraints = constraints
        .zip(&warm.constraints)
        .map(|((bounds, g), m)| gap(*bounds, *g, (-m).max(0.0), m.max(0.0)));
    of_variables.chain(of_constraints).fold(0.0, f64::max)
}

fn gap(bounds: Bounds, value: f64, lower: f64, upper: f64) -> f64 {
    if !value.is_finite() {
        return f64::INFINITY;
    }
    if bounds.lower == bounds.upper {
        return (value - bounds.lower).abs();
    }
    let product = |multiplier: f64, distance: f64| {
        // A multiplier of an infinite bound has to vanish.
        if distance.is_finite() {
            multiplier * distance
        } else {
            multiplier
        }
    };
    bounds
        .violation(value)
        .max(product(lower, value - bounds.lower))
        .max(product(upper, bounds.upper - value))
}

#[cfg(test)]
mod tests {
    use super::gap;
    use crate::ocp::Bounds;

    #[test]
    fn gaps() {
        let bounds = Bounds::new(0.0, 2.0);
        assert_eq!(gap(bounds, 0.0, 5.0, 0.0), 0.0);
        assert_eq!(gap(bounds, 0.5, 5.0, 0.0), 2.5);
        assert_eq!(gap(bounds, 0.5, 0.0, 2.0), 3.0);
        assert_eq!(gap(bounds, -0.25, 0.0, 0.0), 0.25);
        assert_eq!(gap(Bounds::fixed(1.0), 1.5, 7.0, 7.0), 0.5);
        assert_eq!(gap(Bounds::FREE, 1.5, 0.125, 0.0), 0.125);
        assert_eq!(gap(bounds, f64::NAN, 0.0, 0.0), f64::INFINITY);
    }
}
