//! Automatic scaling: every variable and every row of the nonlinear program is brought to the order of one.
//!
//! Factors come from known magnitudes, bounds and the first guess, and are capped: a row that happens to vanish at the
//! guess must not be blown up.

use super::guess::{Guess, Point};
use super::problem::{Bounds, OptimalControlProblem, Quantity};

/// No factor is below or above these, relative to one SI unit.
const SMALLEST: f64 = 1e-8;
const LARGEST: f64 = 1e8;

/// Magnitudes by which the transcription divides.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    /// Of the states.
    pub states: Vec<f64>,
    /// What is subtracted from the states before.
    pub shift: Vec<f64>,
    /// Of the controls.
    pub controls: Vec<f64>,
    /// Of the path constraints.
    pub path: Vec<f64>,
    /// Of the end constraints.
    pub ends: Vec<f64>,
    /// Of the duration, s.
    pub duration_s: f64,
    /// Of the objective.
    pub objective: f64,
}

impl Scaling {
    /// Scaling of a problem from its bounds and a first guess.
    #[must_use]
    pub fn automatic(problem: &OptimalControlProblem, guess: &Guess) -> Self {
        const SAMPLES: usize = 32;
        let sizes = problem.sizes;
        let samples: Vec<_> = (0..=SAMPLES)
            .map(|k| guess.at(k as f64 / SAMPLES as f64))
            .collect();
        let shift: Vec<f64> = samples[0].0.clone();
        let range = |pick: &dyn Fn(&Point) -> f64| {
            samples
                .iter()
                .fold(0.0_f64, |m, sample| m.max(pick(sample).abs()))
        };
        let states = (0..sizes.states)
            .map(|i| magnitude(&problem.states[i], range(&|s| s.0[i] - shift[i])))
            .collect();
        let controls = (0..sizes.controls)
            .map(|i| magnitude(&problem.controls[i], range(&|s| s.1[i])))
            .collect();
        // Path and end functions at the guess, for those without finite bounds.
        let mut path_range = vec![0.0_f64; sizes.path];
        let mut out = vec![0.0; sizes.stage_values()];
        let mut integral = 0.0;
        for (x, u) in &samples {
            let z: Vec<f64> = x.iter().chain(u).copied().collect();
            problem.stage.values(&z, &mut out);
            for (range, value) in path_range.iter_mut().zip(&out[sizes.states..]) {
                *range = range.max(value.abs());
            }
            integral += out[sizes.states + sizes.path] * guess.duration_s() / samples.len() as f64;
        }
        let path = problem
            .path
            .iter()
            .zip(path_range)
            .map(|(q, r)| magnitude(q, r))
            .collect();
        let ends_at: Vec<f64> = samples[0]
            .0
            .iter()
            .chain(&samples[SAMPLES].0)
            .copied()
            .chain([guess.duration_s()])
            .collect();
        let mut end_values = vec![0.0; sizes.endpoint_values()];
        problem.endpoint.values(&ends_at, &mut end_values);
        let ends = problem
            .ends
            .iter()
            .zip(&end_values[1..])
            .map(|(q, value)| magnitude(q, value.abs()))
            .collect();
        Self {
            states,
            shift,
            controls,
            path,
            ends,
            duration_s: capped(guess.duration_s()),
            objective: capped((end_values[0].abs()).max(integral.abs())),
        }
    }
}

fn capped(value: f64) -> f64 {
    if value.is_finite() && value > 0.0 {
        value.clamp(SMALLEST, LARGEST)
    } else {
        1.0
    }
}

/// Known magnitude, else what the bounds allow, else what the guess covers, else one.
fn magnitude(quantity: &Quantity, range: f64) -> f64 {
    let Bounds { lower, upper } = quantity.bounds;
    let bound = lower.abs().max(upper.abs());
    capped(match quantity.magnitude {
        Some(known) => known,
        None if bound.is_finite() && bound > 0.0 => bound,
        None => range,
    })
}
