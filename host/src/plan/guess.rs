//! The first guess of a move: a quintic along the straight line between the poses, at a speed that the motors of the
//! undeformed machine could just follow.

use crate::machine::{Equations, Plant};
use crate::movefile::{Limits, MoveFile};
use crate::ocp::{Guess, Solution};
use nalgebra::{DMatrix, DVector};

/// 6s⁵ − 15s⁴ + 10s³ with its first and second derivative.
fn quintic(s: f64) -> [f64; 3] {
    [
        s * s * s * (10.0 + s * (6.0 * s - 15.0)),
        30.0 * s * s * (1.0 - s) * (1.0 - s),
        60.0 * s * (1.0 + s * (2.0 * s - 3.0)),
    ]
}

/// Undeformed machine, and with it every other plant of a robust move, moving along a quintic in `duration_s`; torques, torque
/// rates and commanded accelerations zero.
#[must_use]
pub fn quintic_guess(file: &MoveFile, duration_s: f64) -> Guess {
    let plant = file.machine.plant();
    let (from, to) = (plant.rest(&file.from), plant.rest(&file.to));
    let axes = plant.axis_count();
    let others = file.robust.as_ref().map(|robust| robust.scenarios.len());
    Guess::new(duration_s, move |share| {
        let [s, slope, _] = quintic(share);
        let ends = || from.iter().zip(&to);
        let positions = ends().map(|(a, b)| a + s * (b - a));
        let rates = ends().map(|(a, b)| slope * (b - a) / duration_s);
        let motion: Vec<f64> = positions.chain(rates).collect();
        let mut state = vec![0.0; axes];
        for _ in 0..=others.unwrap_or(0) {
            state.extend(&motion);
        }
        let controls = if others.is_some() { 2 * axes } else { axes };
        (state, vec![0.0; controls])
    })
}

/// A solution made `factor` times longer: poses stay, and what accelerations cause falls with the square of the factor.
///
/// Nearly a motion of the machine again, and far from the limits.
pub(super) fn slowed_guess(file: &MoveFile, solution: &Solution, factor: f64) -> Guess {
    let plant = file.machine.plant();
    let (axes, count) = (plant.axis_count(), plant.coordinate_count());
    let elastic: Vec<bool> = plant.coordinates().iter().map(|c| c.elastic).collect();
    // After the nominal plant's states come those of any others, (q, v) of each.
    let share = |state: usize| {
        let power = match state.checked_sub(axes).map(|i| i % (2 * count)) {
            None => 2,
            Some(i) if i < count => 2 * i32::from(elastic[i]),
            Some(i) => 1 + 2 * i32::from(elastic[i - count]),
        };
        factor.powi(-power)
    };
    let shares: Vec<f64> = (0..solution.states.nrows()).map(share).collect();
    let solution = solution.clone();
    Guess::new(solution.duration_s * factor, move |at| {
        let states = solution.state_at_share(at);
        let controls = solution.control_at_share(at);
        (
            states
                .iter()
                .zip(&shares)
                .map(|(x, share)| x * share)
                .collect(),
            // Torque rates, then any commanded accelerations.
            (controls.iter().enumerate())
                .map(|(i, u)| u * factor.powi(if i < axes { -3 } else { -2 }))
                .collect(),
        )
    })
}

/// Shortest duration (s) in which the undeformed machine's motors can follow the quintic within their own limits.
///
/// At the duration T torques are those of one second over T², their rates over T³ and speeds over T. `None` where the
/// straight line leaves the machine's reach or passes a singular pose.
#[must_use]
pub fn rigid_duration_s(file: &MoveFile) -> Option<f64> {
    rigid_duration(file).map(|(duration_s, _)| duration_s)
}

/// The same, and the key of the limit that it is due to.
pub(super) fn rigid_duration(file: &MoveFile) -> Option<(f64, &'static str)> {
    const SAMPLES: usize = 64;
    let plant = file.machine.plant();
    let speed_limit = file.limits.joint_speed_rad_per_s(plant.reducer_ratio());
    let Limits {
        torque_nm,
        torque_rate_nm_per_s,
        ..
    } = file.limits;
    let mut before: Option<DVector<f64>> = None;
    let (mut torque, mut rate, mut speed) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..=SAMPLES {
        let (torques, speeds) = rigid_motors(plant, file, k as f64 / SAMPLES as f64)?;
        torque = torque.max(torques.amax());
        speed = speed.max(speeds.amax());
        if let Some(before) = &before {
            rate = rate.max((&torques - before).amax() * SAMPLES as f64);
        }
        before = Some(torques);
    }
    let durations = [
        ((torque / torque_nm).sqrt(), "torque_nm"),
        ((rate / torque_rate_nm_per_s).cbrt(), "torque_rate_nm_per_s"),
        (speed / speed_limit, "motor_speed_rpm"),
    ];
    let longest = durations.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    (longest.0.is_finite() && longest.0 > 0.0).then_some(longest)
}

/// Torques and joint rates of the undeformed machine at a share of a quintic of one second.
fn rigid_motors(
    plant: &dyn Plant,
    file: &MoveFile,
    share: f64,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let [s, rate, acceleration] = quintic(share);
    let (from, to) = (plant.rest(&file.from), plant.rest(&file.to));
    let line = DVector::from_iterator(from.len(), to.iter().zip(&from).map(|(b, a)| b - a));
    let q: Vec<f64> = from.iter().zip(&line).map(|(a, d)| a + s * d).collect();
    let v = &line * rate;
    let mut equations = Equations::new(plant);
    plant.equations(&q, v.as_slice(), &mut equations);
    let (n, axes) = (plant.coordinate_count(), plant.axis_count());
    let mass = DMatrix::from_row_slice(n, n, &equations.mass_matrix);
    let jacobian = DMatrix::from_row_slice(axes, n, &equations.joint_jacobian);
    let force = mass * &line * acceleration + DVector::from_column_slice(&equations.bias);
    // The motors carry the rigid coordinates; the elastic ones are carried by the structure.
    let rigid: Vec<usize> = (plant.coordinates().iter().enumerate())
        .filter(|(_, c)| !c.elastic)
        .map(|(i, _)| i)
        .collect();
    let torques = jacobian
        .select_columns(&rigid)
        .transpose()
        .lu()
        .solve(&force.select_rows(&rigid))?;
    let finite = torques.iter().all(|t| t.is_finite());
    finite.then(|| (torques, jacobian * v))
}
