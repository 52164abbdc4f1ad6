//! Brachistochrone from rest at (0, 0) to (2, 2), y downwards, g = 9.8 m/s²: a cycloid.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct Brachistochrone;

impl Model for Brachistochrone {
    fn variables(&self) -> usize {
        4
    }
    fn values(&self) -> usize {
        4
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let (sin, cos) = z[3].sin_cos();
        out[0] = z[2] * sin;
        out[1] = z[2] * cos;
        out[2] = cos * 9.8;
        out[3] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "brachistochrone",
        answer: 0.824_759_143_156_6,
        uncertainty: 0.0,
        source: "Johann Bernoulli (1696): the cycloid through both points",
        problem: problem(
            Brachistochrone,
            Cost::Duration,
            vec![
                State::from("x", 0.0).to(2.0),
                State::from("y", 0.0).to(2.0),
                State::from("v", 0.0),
            ],
            vec![("u", Bounds::symmetric(4.0))],
            Bounds::new(0.1, 10.0),
        ),
        guess: Guess::line(1.0, vec![0.0; 3], vec![2.0, 2.0, 5.0], vec![0.0]),
    }
}
