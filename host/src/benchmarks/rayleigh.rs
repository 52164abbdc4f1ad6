//! Rayleigh: a tunnel-diode oscillator brought near rest. min ∫u² + x₁² dt.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct Rayleigh;

impl Model for Rayleigh {
    fn variables(&self) -> usize {
        3
    }
    fn values(&self) -> usize {
        3
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[1];
        out[1] = z[1] * (-(z[1].square() * 0.14) + 1.4) - z[0] + z[2] * 4.0;
        out[2] = z[2].square() + z[0].square();
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "rayleigh",
        answer: 29.376_079_655_9,
        uncertainty: 1e-11,
        source: "problem: Jacobson and Mayne (1970); answer: the same digits on three meshes",
        problem: problem(
            Rayleigh,
            Cost::None,
            vec![State::from("x1", -5.0), State::from("x2", -5.0)],
            vec![("u", Bounds::FREE)],
            Bounds::fixed(2.5),
        ),
        guess: Guess::line(2.5, vec![-5.0, -5.0], vec![0.0, 0.0], vec![0.0]),
    }
}
