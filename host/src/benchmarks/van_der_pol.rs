//! Van der Pol with |u| ≤ 1 and x₁ ≥ −0.25 over 10 s. min ∫x₁² + x₂² + u² dt.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct VanDerPol;

impl Model for VanDerPol {
    fn variables(&self) -> usize {
        3
    }
    fn values(&self) -> usize {
        3
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let (x1, x2, u) = (z[0], z[1], z[2]);
        out[0] = (-x2.square() + 1.0) * x1 - x2 + u;
        out[1] = x1;
        out[2] = x1.square() + x2.square() + u.square();
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "van-der-pol",
        answer: 3.615_181,
        uncertainty: 1e-6,
        source: "problem: Canto, Banga, Alonso, Vassiliadis (2002), with a state constraint; answer: two meshes",
        problem: problem(
            VanDerPol,
            Cost::None,
            vec![
                State::from("x1", 0.0).within(-0.25, f64::INFINITY),
                State::from("x2", 1.0),
            ],
            vec![("u", Bounds::symmetric(1.0))],
            Bounds::fixed(10.0),
        ),
        guess: Guess::line(10.0, vec![0.0, 1.0], vec![0.0, 0.0], vec![0.0]),
    }
}
