//! Bryson–Denham: a state constraint that is active in the middle third. min ½∫u² dt, x′ = v, v′ = u, x ≤ 1/9.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct BrysonDenham;

impl Model for BrysonDenham {
    fn variables(&self) -> usize {
        3
    }
    fn values(&self) -> usize {
        3
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[1];
        out[1] = z[2];
        out[2] = z[2].square() * 0.5;
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "bryson-denham",
        answer: 4.0,
        uncertainty: 0.0,
        source: "Bryson and Ho, Applied Optimal Control (1975), 3.11: 4/(9ℓ) for x ≤ ℓ ≤ 1/6",
        problem: problem(
            BrysonDenham,
            Cost::None,
            vec![
                State::from("x", 0.0)
                    .to(0.0)
                    .within(f64::NEG_INFINITY, 1.0 / 9.0),
                State::from("v", 1.0).to(-1.0),
            ],
            vec![("u", Bounds::FREE)],
            Bounds::fixed(1.0),
        ),
        guess: Guess::line(1.0, vec![0.0, 1.0], vec![0.0, -1.0], vec![0.0]),
    }
}
