//! Hypersensitive: two boundary layers of length 1 in a horizon of 10,000. min ½∫x² + u² dt, x′ = −x³ + u.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct Hypersensitive;

impl Model for Hypersensitive {
    fn variables(&self) -> usize {
        2
    }
    fn values(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[1] - z[0] * z[0].square();
        out[1] = (z[0].square() + z[1].square()) * 0.5;
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "hypersensitive",
        answer: 3.362_056_904_943,
        uncertainty: 0.0,
        source: "Rao and Mease (2000); the limit of an infinite horizon, by the value function of either end",
        problem: problem(
            Hypersensitive,
            Cost::None,
            vec![State::from("x", 1.0).to(1.5)],
            vec![("u", Bounds::FREE)],
            Bounds::fixed(1e4),
        ),
        guess: Guess::line(1e4, vec![1.0], vec![1.5], vec![0.0]),
    }
}
