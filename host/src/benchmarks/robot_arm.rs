//! Robot arm in spherical coordinates (COPS): the arm ρ slides, swings by θ and φ; |u| ≤ 1, minimum time.

use super::Benchmark;
use super::statement::{Cost, State, problem};
use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Guess, Model};

struct RobotArm;

impl Model for RobotArm {
    fn variables(&self) -> usize {
        9
    }
    fn values(&self) -> usize {
        7
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        const LENGTH: f64 = 5.0;
        let (rho, phi) = (z[0], z[4]);
        let rest = -rho + LENGTH;
        let inertia = (rest.square() * rest + rho.square() * rho) * (1.0 / 3.0);
        out[0] = z[1];
        out[1] = z[6] * (1.0 / LENGTH);
        out[2] = z[3];
        out[3] = z[7] / (inertia * phi.sin_cos().0.square());
        out[4] = z[5];
        out[5] = z[8] / inertia;
        out[6] = S::constant(0.0);
    }
}

pub(super) fn benchmark() -> Benchmark {
    use std::f64::consts::{FRAC_PI_4, PI};
    let swing = 2.0 * PI / 3.0;
    Benchmark {
        name: "robot-arm",
        answer: 9.140_911_745_915,
        uncertainty: 1e-12,
        source: "problem: Dolan, Moré, Munson, COPS 3.0 (2004), 8; answer: Newton on the switch times (the often quoted \
                 9.14093620 is 2.4e-5 too slow)",
        problem: problem(
            RobotArm,
            Cost::Duration,
            vec![
                State::from("rho", 4.5).to(4.5).within(0.0, 5.0),
                State::from("rho rate", 0.0).to(0.0),
                State::from("theta", 0.0).to(swing).within(-PI, PI),
                State::from("theta rate", 0.0).to(0.0),
                State::from("phi", FRAC_PI_4).to(FRAC_PI_4).within(0.0, PI),
                State::from("phi rate", 0.0).to(0.0),
            ],
            ["u rho", "u theta", "u phi"]
                .map(|name| (name, Bounds::symmetric(1.0)))
                .to_vec(),
            Bounds::new(0.1, 100.0),
        ),
        guess: Guess::line(
            10.0,
            vec![4.5, 0.0, 0.0, 0.0, FRAC_PI_4, 0.0],
            vec![4.5, 0.0, swing, 0.0, FRAC_PI_4, 0.0],
            vec![0.0; 3],
        ),
    }
}
