//! Is a structured answer an extremal? Pontryagin's conditions between the points, on the costates of the lifted problem.

use super::detect::{BangArc, Side};
use crate::ocp::{Answer, HamiltonianAt, OptimalControlProblem};

/// Samples per interval of an arc.
const SAMPLES: usize = 20;

/// How well an answer meets the conditions of optimality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimality {
    /// Largest deviation of the Hamiltonian from its mean, relative to the size of its terms.
    pub hamiltonian: f64,
    /// Largest value with the wrong sign of a switching function over its largest value; 0 if none has it.
    pub switching: f64,
    /// Largest excess over a bound of state or path function, relative to the bound's size; 0 inside.
    pub bounds: f64,
}

impl Optimality {
    /// Whether each figure is at most this.
    pub(super) fn within(&self, tolerance: f64) -> bool {
        // Written so that NaN fails.
        [self.hamiltonian, self.switching, self.bounds]
            .iter()
            .all(|figure| *figure <= tolerance)
    }
}

/// Checks the arcs of `problem` on an answer of the lifted one.
pub(super) fn check(
    problem: &OptimalControlProblem,
    arcs: &[BangArc],
    lifted: &Answer,
) -> Optimality {
    let sizes = problem.sizes;
    let n = sizes.states;
    let (mut values, mut size) = (Vec::new(), 0.0_f64);
    let mut largest = vec![0.0_f64; sizes.controls];
    let mut wrong = vec![0.0_f64; sizes.controls];
    let mut bounds = 0.0_f64;
    let mut start = 0.0;
    for interval in lifted.solution.mesh.intervals() {
        let middle = lifted.solution.place(start + interval.fraction / 2.0);
        for sample in 0..=SAMPLES {
            let mut place = middle;
            place.local = 2.0 * sample as f64 / SAMPLES as f64 - 1.0;
            let states = lifted.solution.state_at(place);
            let costates = lifted.costates.at(&lifted.solution, place);
            for (arc, spec) in arcs.iter().enumerate() {
                let x = &states[arc * n..][..n];
                let own = &costates[arc * n..][..n];
                let u = spec.controls(problem);
                let here = HamiltonianAt::at(problem, x, &u, own);
                let z: Vec<f64> = x.iter().chain(&u).copied().collect();
                let mut stage = vec![0.0; sizes.stage_values()];
                problem.stage.values(&z, &mut stage);
                let terms = stage
                    .iter()
                    .zip(own)
                    .map(|(f, costate)| (f * costate).abs());
                size = terms.fold(size.max(here.value.abs()), f64::max);
                values.push(here.value);
                for (control, (&function, side)) in
                    here.by_control.iter().zip(&spec.sides).enumerate()
                {
                    let excess = match side {
                        Side::Lower => -function,
                        Side::Upper => function,
                    };
                    largest[control] = largest[control].max(function.abs());
                    wrong[control] = wrong[control].max(excess);
                }
                let limited = problem.states.iter().zip(x);
                let paths = problem.path.iter().zip(&stage[n..]);
                for (quantity, value) in limited.chain(paths) {
                    let violation = quantity.bounds.violation(*value);
                    bounds = bounds.max(violation / value.abs().max(f64::MIN_POSITIVE));
                }
            }
        }
        start += interval.fraction;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let deviation = values
        .iter()
        .fold(0.0_f64, |m, value| m.max((value - mean).abs()));
    let switching = wrong
        .iter()
        .zip(&largest)
        .map(|(wrong, largest)| wrong / largest);
    Optimality {
        hamiltonian: deviation / size,
        switching: switching.fold(0.0, f64::max),
        bounds,
    }
}
