//! The first guess of a move: a quintic along the straight line between the poses.

use crate::movefile::MoveFile;
use crate::ocp::Guess;

/// 6s⁵ − 15s⁴ + 10s³ and its derivative.
fn quintic(s: f64) -> (f64, f64) {
    (
        s * s * s * (10.0 + s * (6.0 * s - 15.0)),
        30.0 * s * s * (1.0 - s) * (1.0 - s),
    )
}

/// Undeformed machine moving along a quintic in `duration_s`; torques and torque rates zero.
#[must_use]
pub fn quintic_guess(file: &MoveFile, duration_s: f64) -> Guess {
    let plant = file.machine.plant();
    let (from, to) = (plant.rest(&file.from), plant.rest(&file.to));
    let axes = plant.axis_count();
    Guess::new(duration_s, move |share| {
        let (s, slope) = quintic(share);
        let mut state = vec![0.0; axes];
        state.extend(from.iter().zip(&to).map(|(a, b)| a + s * (b - a)));
        state.extend(
            from.iter()
                .zip(&to)
                .map(|(a, b)| slope * (b - a) / duration_s),
        );
        (state, vec![0.0; axes])
    })
}
