//! Floating oscillator: two unit masses and a spring, the first one pushed with |u| ≤ 1, rest to rest over 1, minimum time.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct FloatingOscillator;

impl Model for FloatingOscillator {
    fn variables(&self) -> usize {
        5
    }
    fn values(&self) -> usize {
        5
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let stretch = z[0] - z[1];
        out[0] = z[2];
        out[1] = z[3];
        out[2] = z[4] - stretch;
        out[3] = stretch;
        out[4] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "floating-oscillator",
        answer: 4.217_866_510_451,
        uncertainty: 1e-12,
        source: "Newton on the three switch times 1.0026784304, 2.1089332552, 3.2151880801",
        problem: problem(
            FloatingOscillator,
            Cost::Duration,
            vec![
                State::from("x1", 0.0).to(1.0),
                State::from("x2", 0.0).to(1.0),
                State::from("v1", 0.0).to(0.0),
                State::from("v2", 0.0).to(0.0),
            ],
            vec![("u", Bounds::symmetric(1.0))],
            Bounds::new(0.1, 100.0),
        ),
        guess: Guess::line(5.0, vec![0.0; 4], vec![1.0, 1.0, 0.0, 0.0], vec![0.0]),
    }
}
