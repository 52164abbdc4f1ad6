//! Rest to rest over d = 1 with limited jerk |u| ≤ 1, x‴ = u, in minimum time: T = (32 d)^(1/3).

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct TripleIntegrator;

impl Model for TripleIntegrator {
    fn variables(&self) -> usize {
        4
    }
    fn values(&self) -> usize {
        4
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[1];
        out[1] = z[2];
        out[2] = z[3];
        out[3] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "triple-integrator",
        answer: 32.0_f64.cbrt(),
        uncertainty: 0.0,
        source: "switches at T/4 and 3T/4 by symmetry",
        problem: problem(
            TripleIntegrator,
            Cost::Duration,
            vec![
                State::from("x", 0.0).to(1.0),
                State::from("v", 0.0).to(0.0),
                State::from("a", 0.0).to(0.0),
            ],
            vec![("u", Bounds::symmetric(1.0))],
            Bounds::new(0.1, 100.0),
        ),
        guess: Guess::line(5.0, vec![0.0; 3], vec![1.0, 0.0, 0.0], vec![0.0]),
    }
}
