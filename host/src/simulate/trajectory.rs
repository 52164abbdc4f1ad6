//! Trajectories from joint paths: what lets a quintic run on the board like a planned move.

use super::ideal::{self, Settings};
use super::linear;
use super::ode::OdeError;
use super::path::{JointPath as _, RigidPath};
use super::recording::Frame;
use crate::machine::{Equations, Plant};
use crate::movefile::Limits;
use stillpoint_shared::trajectory::{MAX_COEFFICIENTS, coefficient_count};
use stillpoint_shared::{
    AxisLimits, LimitsError, Trajectory, TrajectoryBuilder, TrajectoryError, lgr, time,
};

/// Most and least LGR points of an interval.
const POINTS: usize = 10;
const LEAST_POINTS: usize = 4;
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

/// One interval of a trajectory to be.
struct Span {
    duration_ticks: u32,
    points: usize,
    /// Times of its nodes, and its end.
    times_s: Vec<f64>,
}

/// Where a trajectory of `axes` axes is sampled. Every interval has the least number of points and, by its length, a share
/// of what the board has room for besides.
fn mesh(breaks_s: &[f64], axes: usize) -> Result<Vec<Span>, TrajectoryError> {
    let duration_s = breaks_s.last().copied().unwrap_or_default();
    let mut ends = vec![0];
    for piece in breaks_s.windows(2) {
        let [start_s, end_s] = [piece[0], piece[1]];
        let parts = ((end_s - start_s) * INTERVALS / duration_s).ceil().max(1.0);
        for part in 1..=parts as usize {
            let until_s = start_s + (end_s - start_s) * part as f64 / parts;
            let interval = ends.len() - 1;
            let to = time::ticks(until_s).ok_or(TrajectoryError::TooLong { interval })?;
            // Two breaks within a tick are one.
            if ends.last().is_some_and(|from| to > *from) {
                ends.push(to);
            }
        }
    }
    let least = coefficient_count(LEAST_POINTS, axes);
    let more = coefficient_count(LEAST_POINTS + 1, axes) - least;
    let spare = MAX_COEFFICIENTS.saturating_sub((ends.len() - 1) * least) / more;
    let spans = ends.windows(2).enumerate().map(|(interval, pair)| {
        let duration_ticks = pair[1] - pair[0];
        let share = spare as f64 * time::seconds(duration_ticks) / duration_s;
        let points = (LEAST_POINTS + share as usize).min(POINTS);
        Ok(Span {
            duration_ticks,
            points,
            times_s: times_s(interval, pair[0], duration_ticks, points)?,
        })
    });
    spans.collect()
}

/// Times of an interval's nodes, and its end.
fn times_s(
    interval: usize,
    start_ticks: u32,
    duration_ticks: u32,
    points: usize,
) -> Result<Vec<f64>, TrajectoryError> {
    let mut nodes = vec![0.0; points + 1];
    lgr::support_nodes(&mut nodes).map_err(|_| TrajectoryError::Points { interval, points })?;
    let ticks = |x: f64| f64::from(start_ticks) + f64::from(duration_ticks) * (x + 1.0) / 2.0;
    let per_s = f64::from(time::TIME_TICKS_PER_SECOND);
    Ok(nodes.into_iter().map(|x| ticks(x) / per_s).collect())
}

/// Where a trajectory has its values: the nodes of its intervals in turn, each with its end.
///
/// # Errors
/// [`TrajectoryError`] at an interval whose number of points has no rule.
pub fn node_times_s(trajectory: &Trajectory) -> Result<Vec<f64>, TrajectoryError> {
    let mut all_s = Vec::new();
    for (interval, span) in trajectory.intervals().enumerate() {
        all_s.extend(times_s(
            interval,
            span.start_ticks,
            span.duration_ticks,
            span.points,
        )?);
    }
    Ok(all_s)
}

fn build(
    id: u32,
    limits: &stillpoint_shared::Limits,
    spans: &[Span],
    samples: &mut dyn FnMut(f64) -> Option<JointSample>,
) -> Result<Trajectory, PathError> {
    let mut builder = TrajectoryBuilder::new(id, limits);
    for span in spans {
        let mut values = Vec::new();
        for &time_s in &span.times_s {
            let sample = samples(time_s).ok_or(OdeError::Undefined { time_s })?;
            values.extend(sample.angles_rad);
            values.extend(sample.rates_rad_per_s);
            values.extend(sample.torques_nm);
        }
        builder
            .interval(span.duration_ticks, span.points, &values)
            .map_err(PathError::Trajectory)?;
    }
    builder.finish().map_err(PathError::Trajectory)
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
    let spans = mesh(&breaks_s, plant.axis_count()).map_err(PathError::Trajectory)?;
    let mut last: Option<JointSample> = None;
    match feedforward {
        Feedforward::Rigid => build(id, &board, &spans, &mut |time_s| {
            let sample = rigid_sample(plant, path, time_s, last.as_ref())?;
            last = Some(sample.clone());
            Some(sample)
        }),
        Feedforward::Ideal => {
            let times: Vec<f64> = spans.iter().flat_map(|span| span.times_s.clone()).collect();
            let tolerance = Settings::default().tolerance;
            let recording = ideal::simulate_at(plant, path, &times, tolerance)?;
            let mut frames = recording.frames.into_iter();
            build(id, &board, &spans, &mut |_| {
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
