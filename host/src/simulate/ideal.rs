//! Ideal drives: motors that follow their path exactly, whatever torque that takes.
//!
//! Each motor is a constraint θ(q) = θ_p(t) with the torque as its multiplier:
//!
//! ```text
//! M a − Jᵀτ = −bias
//! J a       = θ̈_p − J̇v + 2β(θ̇_p − Jv) + β²(θ_p − θ(q))
//! ```
//!
//! The terms in β (Baumgarte) pull numerical drift back; they vanish on the exact solution.

use super::linear;
use super::ode::{OdeError, Tolerance, integrate};
use super::path::JointPath;
use super::recording::{Frame, Recording};
use crate::machine::{Equations, Plant};
use std::cell::RefCell;

/// β: fast against every machine's vibration, slow against the integration step.
const PULL_PER_S: f64 = 500.0;

/// What to simulate, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time watched after the end of the move.
    pub after_s: f64,
    /// Distance of the samples.
    pub sample_s: f64,
    /// Relative tolerance of the integration.
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            after_s: 0.35,
            sample_s: 1e-4,
            tolerance: 1e-8,
        }
    }
}

/// Working space of one evaluation.
struct Space {
    equations: Equations,
    path: Equations,
    system: Vec<f64>,
    solution: Vec<f64>,
}

impl Space {
    fn new(plant: &dyn Plant) -> Self {
        let size = plant.coordinate_count() + plant.axis_count();
        Self {
            equations: Equations::new(plant),
            path: Equations::new(plant),
            system: vec![0.0; size * size],
            solution: vec![0.0; size],
        }
    }

    /// Accelerations, then torques, into `solution`. `pull_per_s` is β.
    fn solve(
        &mut self,
        plant: &dyn Plant,
        path: &dyn JointPath,
        time_s: f64,
        (q, v): (&[f64], &[f64]),
        pull_per_s: f64,
    ) -> Option<()> {
        let (n, axes) = (plant.coordinate_count(), plant.axis_count());
        let size = n + axes;
        plant.equations(q, v, &mut self.equations);
        let wanted = path.motion(time_s, &mut self.path);
        let angles = plant.joint_angles(q);
        let e = &self.equations;
        self.system.fill(0.0);
        for row in 0..n {
            self.system[row * size..row * size + n]
                .copy_from_slice(&e.mass_matrix[row * n..(row + 1) * n]);
            self.solution[row] = -e.bias[row];
        }
        for (axis, (angle, wanted_rad)) in angles.iter().zip(&wanted.angles_rad).enumerate() {
            let row = &e.joint_jacobian[axis * n..(axis + 1) * n];
            let rate: f64 = row.iter().zip(v).map(|(j, v)| j * v).sum();
            let behind = wanted_rad - plant.continued(*angle, *wanted_rad);
            self.solution[n + axis] = wanted.accelerations_rad_per_s2[axis] - e.joint_bias[axis]
                + 2.0 * pull_per_s * (wanted.rates_rad_per_s[axis] - rate)
                + pull_per_s * pull_per_s * behind;
            for (column, j) in row.iter().enumerate() {
                self.system[(n + axis) * size + column] = *j;
                self.system[column * size + n + axis] = -j;
            }
        }
        linear::solve(&mut self.system, &mut self.solution)
    }
}

/// Simulates the move along `path` from rest with ideal drives.
///
/// # Errors
/// [`OdeError`] where the path leaves what the machine can reach.
pub fn simulate(
    plant: &dyn Plant,
    path: &dyn JointPath,
    settings: Settings,
) -> Result<Recording, OdeError> {
    let end_s = path.duration_s() + settings.after_s;
    let times: Vec<f64> = (0..)
        .map(|k| f64::from(k) * settings.sample_s)
        .take_while(|t| *t <= end_s)
        .collect();
    simulate_at(plant, path, &times, settings.tolerance)
}

/// The same, sampled at the ascending `times_s`.
///
/// # Errors
/// [`OdeError`] where the path leaves what the machine can reach.
pub fn simulate_at(
    plant: &dyn Plant,
    path: &dyn JointPath,
    times_s: &[f64],
    tolerance: f64,
) -> Result<Recording, OdeError> {
    let n = plant.coordinate_count();
    let space = RefCell::new(Space::new(plant));
    let slope = |time_s: f64, state: &[f64], out: &mut [f64]| {
        let (q, v) = state.split_at(n);
        let mut space = space.borrow_mut();
        space.solve(plant, path, time_s, (q, v), PULL_PER_S)?;
        out[..n].copy_from_slice(v);
        out[n..].copy_from_slice(&space.solution[..n]);
        Some(())
    };
    let coordinates = plant.coordinates();
    let rates = coordinates.iter().map(|c| c.rate_magnitude);
    let tolerance = Tolerance {
        relative: tolerance,
        scale: coordinates
            .iter()
            .map(|c| c.magnitude)
            .chain(rates)
            .collect(),
    };
    let duration_s = path.duration_s();
    let mut recording = Recording {
        duration_s,
        rest_from_s: duration_s,
        ..Recording::default()
    };
    let mut state = path.start();
    state.resize(2 * n, 0.0);
    let (mut time_s, mut rest) = (0.0, times_s);
    // Between the breaks everything is smooth, so no step is wasted on a kink.
    let mut pieces_s = path.breaks_s();
    pieces_s.push(f64::INFINITY);
    for piece_s in pieces_s {
        let (times, later) = rest.split_at(rest.partition_point(|t| *t <= piece_s));
        rest = later;
        let until_s = if piece_s.is_finite() {
            piece_s
        } else {
            times.last().copied().unwrap_or(time_s)
        };
        let samples = integrate(slope, (time_s, until_s), &state, &tolerance, times)?;
        for (time_s, state) in times.iter().zip(&samples.states) {
            let (q, v) = state.split_at(n);
            let mut space = space.borrow_mut();
            // Without the pull: it would turn the interpolation's last digits into torque.
            space
                .solve(plant, path, *time_s, (q, v), 0.0)
                .ok_or(OdeError::Undefined { time_s: *time_s })?;
            let torques = &space.solution[n..];
            let frame = Frame::of(plant, *time_s, q, v, torques, recording.frames.last());
            recording.frames.push(frame);
        }
        state = samples.end;
        time_s = until_s;
    }
    Ok(recording)
}
