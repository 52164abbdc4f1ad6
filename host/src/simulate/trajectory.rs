//! Trajectories from joint paths: what lets a quintic run on the board like a planned move.

use super::ideal::{self, Settings};
use super::linear;
use super::ode::OdeError;
use super::path::{JointPath as _, RigidPath};
use super::recording::Frame;
use crate::machine::{Equations, Plant};
use crate::movefile::Limits;
use stillpoint_shared::{
    AxisLimits, LimitsError, Trajectory, TrajectoryBuilder, TrajectoryError, lgr, time,
};

/// LGR points per interval.
const POINTS: usize = 10;
/// Intervals of a whole move: each holds a sixth of it at most.
const INTERVALS: f64 = 6.0;

/// What every axis does at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointSample {
    /// Joint angles, without jumps.
    pub angles_rad: Vec<f64>,
    /// Joint rates.
    pub rates_rad_per_s: Vec<f64>,
    /// Torques at the reducer outputs.
    pub torques_nm: Vec<f64>,
}

impl From<Frame> for JointSample {
    fn from(frame: Frame) -> Self {
        Self {
            angles_rad: frame.joint_angles_rad,
            rates_rad_per_s: frame.joint_rates_rad_per_s,
            torques_nm: frame.torques_nm,
        }
    }
}

/// Where the torque fed forward along a rigid path comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// The rigid machine's: what a controller without knowledge of elasticity computes. Zero at both ends.
    Rigid,
    /// What ideal drives would need on the elastic machine. At the end it still fights the vibration.
    Ideal,
}

/// Why a path cannot become a trajectory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The simulation fails.
    #[error(transparent)]
    Ode(#[from] OdeError),
    /// The limits are none that a board takes.
    #[error("{0}")]
    Limits(LimitsError),
    /// The trajectory is none that a board takes.
    #[error("{0}")]
    Trajectory(TrajectoryError),
}

/// The limits as the board knows them: per axis, at the joint, in f32.
///
/// # Errors
/// [`LimitsError`] where a number does not fit f32.
pub fn board_limits(
    limits: &Limits,
    plant: &dyn Plant,
) -> Result<stillpoint_shared::Limits, LimitsError> {
    let ratio = plant.reducer_ratio();
    let axis = AxisLimits {
        torque_nm: limits.torque_nm as f32,
        torque_rate_nm_per_s: limits.torque_rate_nm_per_s as f32,
        speed_rad_per_s: limits.joint_speed_rad_per_s(ratio) as f32,
        knee_speed_rad_per_s: limits.knee_rad_per_s(ratio) as f32,
        slope_nm_s_per_rad: limits.slope_nm_s_per_rad(ratio) as f32,
    };
    stillpoint_shared::Limits::new(&vec![axis; plant.axis_count()])
}

/// Times at which a trajectory is sampled: per interval its ticks, and the times of its nodes.
fn mesh(breaks_s: &[f64]) -> Result<Vec<(u32, Vec<f64>)>, TrajectoryError> {
    let mut nodes = [0.0; POINTS + 1];
    lgr::support_nodes(&mut nodes).map_err(|_| TrajectoryError::Points {
        interval: 0,
        points: POINTS,
    })?;
    let duration_s = breaks_s.last().copied().unwrap_or_default();
    let mut intervals = Vec::new();
    let mut from = 0_u32;
    for piece in breaks_s.windows(2) {
        let [start_s, end_s] = [piece[0], piece[1]];
        let parts = ((end_s - start_s) * INTERVALS / duration_s).ceil().max(1.0);
        for part in 1..=parts as usize {
            let until_s = start_s + (end_s - start_s) * part as f64 / parts;
            let interval = intervals.len();
            let to = time::ticks(until_s).ok_or(TrajectoryError::TooLong { interval })?;
            // Two breaks within a tick are one.
            if to > from {
                let (a, b) = (time::seconds(from), time::seconds(to));
                let inner = |x| a + (b - a) * (x + 1.0) / 2.0;
                let times = nodes.map(|x| if x < 1.0 { inner(x) } else { b });
                intervals.push((to - from, times.to_vec()));
                from = to;
            }
        }
    }
    Ok(intervals)
}

fn build(
    id: u32,
    limits: &stillpoint_shared::Limits,
    intervals: &[(u32, Vec<f64>)],
    samples: &mut dyn FnMut(f64) -> Option<JointSample>,
) -> Result<Trajectory, PathError> {
    let mut builder = TrajectoryBuilder::new(id, limits);
    for (duration_ticks, times) in intervals {
        let mut values = Vec::new();
        for &time_s in times {
            let sample = samples(time_s).ok_or(OdeError::Undefined { time_s })?;
            values.extend(sample.angles_rad);
            values.extend(sample.rates_rad_per_s);
            values.extend(sample.torques_nm);
        }
        builder
            .interval(*duration_ticks, POINTS, &values)
            .map_err(PathError::Trajectory)?;
    }
    builder.finish().map_err(PathError::Trajectory)
}

/// A trajectory of any joint path, sampled in ascending time. `breaks_s` are the times between which the path is smooth,
/// first 0, last the end.
///
/// # Errors
/// [`PathError`]; [`OdeError::Undefined`] where `sample` returns `None`.
pub fn from_samples(
    id: u32,
    limits: &stillpoint_shared::Limits,
    breaks_s: &[f64],
    mut sample: impl FnMut(f64) -> Option<JointSample>,
) -> Result<Trajectory, PathError> {
    let intervals = mesh(breaks_s).map_err(PathError::Trajectory)?;
    build(id, limits, &intervals, &mut sample)
}

/// A trajectory of motors that follow a rigid path.
///
/// # Errors
/// [`PathError`].
pub fn from_path(
    id: u32,
    plant: &dyn Plant,
    limits: &Limits,
    path: &RigidPath,
    feedforward: Feedforward,
) -> Result<Trajectory, PathError> {
    let board = board_limits(limits, plant).map_err(PathError::Limits)?;
    let breaks_s = path.profile().breaks_s();
    let intervals = mesh(&breaks_s).map_err(PathError::Trajectory)?;
    let mut last: Option<JointSample> = None;
    match feedforward {
        Feedforward::Rigid => build(id, &board, &intervals, &mut |time_s| {
            let sample = rigid_sample(plant, path, time_s, last.as_ref())?;
            last = Some(sample.clone());
            Some(sample)
        }),
        Feedforward::Ideal => {
            let times: Vec<f64> = intervals.iter().flat_map(|(_, t)| t.clone()).collect();
            let tolerance = Settings::default().tolerance;
            let recording = ideal::simulate_at(plant, path, &times, tolerance)?;
            let mut frames = recording.frames.into_iter();
            build(id, &board, &intervals, &mut |_| {
                frames.next().map(JointSample::from)
            })
        }
    }
}

/// Motion and torques of the rigid machine on its path.
///
/// Elastic coordinates are held at zero by forces of their own, so the equations of the others alone give the torques:
/// (M a + bias)ᵣ = (Jᵀτ)ᵣ. `None` if these are not as many as the motors, or singular.
fn rigid_sample(
    plant: &dyn Plant,
    path: &RigidPath,
    time_s: f64,
    before: Option<&JointSample>,
) -> Option<JointSample> {
    let (n, axes) = (plant.coordinate_count(), plant.axis_count());
    let rigid: Vec<usize> = (0..n)
        .filter(|&i| !plant.coordinates()[i].elastic)
        .collect();
    if rigid.len() != axes {
        return None;
    }
    let mut equations = Equations::new(plant);
    let motion = path.motion(time_s, &mut equations);
    let (q, v, a) = path.rigid_motion(time_s);
    plant.equations(&q, &v, &mut equations);
    let mut torques_nm = Vec::with_capacity(axes);
    let mut matrix = Vec::with_capacity(axes * axes);
    for &row in &rigid {
        let masses = &equations.mass_matrix[row * n..(row + 1) * n];
        let inertia: f64 = masses.iter().zip(&a).map(|(m, a)| m * a).sum();
        torques_nm.push(inertia + equations.bias[row]);
        matrix.extend((0..axes).map(|axis| equations.joint_jacobian[axis * n + row]));
    }
    linear::solve(&mut matrix, &mut torques_nm)?;
    let mut angles_rad = motion.angles_rad;
    if let Some(before) = before {
        for (angle, near) in angles_rad.iter_mut().zip(&before.angles_rad) {
            *angle = plant.continued(*angle, *near);
        }
    }
    Some(JointSample {
        angles_rad,
        rates_rad_per_s: motion.rates_rad_per_s,
        torques_nm,
    })
}
