//! Two-link arm: two rigid links with torques |u| ≤ 1 at both joints, in minimum time.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct TwoLinkArm;

impl Model for TwoLinkArm {
    fn variables(&self) -> usize {
        6
    }
    fn values(&self) -> usize {
        5
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let (rate_1, rate_2, u1, u2) = (z[0], z[1], z[4], z[5]);
        let (sin, cos) = z[2].sin_cos();
        let by = (sin.square() * (9.0 / 4.0) + 31.0 / 36.0).recip();
        let (squares_1, squares_2) = (rate_1.square(), rate_2.square());
        let push = (u1 - u2) * (4.0 / 3.0) - cos * u2 * 1.5;
        out[0] = (sin * (cos * squares_1 * (9.0 / 4.0) + squares_2 * 2.0) + push) * by;
        let pull = u2 * (7.0 / 3.0) - cos * (u1 - u2) * 1.5;
        out[1] = (pull - sin * (squares_1 * 3.5 + cos * squares_2 * (9.0 / 4.0))) * by;
        out[2] = rate_2 - rate_1;
        out[3] = rate_1;
        out[4] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    let (from, to) = (vec![0.0, 0.0, 0.5, 0.0], vec![0.0, 0.0, 0.5, 0.522]);
    Benchmark {
        name: "two-link-arm",
        answer: 2.982_279_942_550,
        uncertainty: 1e-12,
        source: "problem: Luus, Iterative Dynamic Programming (2000), 12.4.2; answer: Newton on the switch times",
        problem: problem(
            TwoLinkArm,
            Cost::Duration,
            ["rate 1", "rate 2", "angle 2", "angle 1"]
                .into_iter()
                .zip(from.iter().zip(&to))
                .map(|(name, (from, to))| State::from(name, *from).to(*to))
                .collect(),
            vec![
                ("u1", Bounds::symmetric(1.0)),
                ("u2", Bounds::symmetric(1.0)),
            ],
            Bounds::new(0.1, 100.0),
        ),
        guess: Guess::line(3.0, from, to, vec![0.0; 2]),
    }
}
