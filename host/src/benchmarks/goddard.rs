//! The rocket of Goddard (COPS): greatest height for given fuel; full thrust, then a singular arc, then none.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct Goddard;

impl Model for Goddard {
    fn variables(&self) -> usize {
        4
    }
    fn values(&self) -> usize {
        4
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        const DRAG: f64 = 310.0;
        const DRAG_DECAY: f64 = 500.0;
        const EXHAUST: f64 = 0.5;
        let (height, speed, mass, thrust) = (z[0], z[1], z[2], z[3]);
        let drag = speed.square() * (-((height - 1.0) * DRAG_DECAY)).exp() * DRAG;
        out[0] = speed;
        out[1] = (thrust - drag) / mass - height.square().recip();
        out[2] = thrust * (-1.0 / EXHAUST);
        out[3] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    Benchmark {
        name: "goddard",
        answer: -1.012_836_918_317,
        uncertainty: 1e-12,
        source: "problem: Dolan, Moré, Munson, COPS 3.0 (2004), 10; answer (minus the height): full thrust up to the surface \
                 m g = (1 + v/c) D, along it down to the last fuel, and up to rest, by a Runge–Kutta rule of fourth order",
        problem: problem(
            Goddard,
            Cost::Minus(0),
            vec![
                State::from("height", 1.0).within(1.0, f64::INFINITY),
                State::from("speed", 0.0).within(0.0, f64::INFINITY),
                State::from("mass", 1.0).to(0.6).within(0.6, 1.0),
            ],
            vec![("thrust", Bounds::new(0.0, 3.5))],
            Bounds::new(0.01, 10.0),
        ),
        guess: Guess::line(0.2, vec![1.0, 0.0, 1.0], vec![1.01, 0.0, 0.6], vec![1.75]),
    }
}
