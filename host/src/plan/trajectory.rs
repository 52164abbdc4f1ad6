//! From the planner's polynomials to what the board plays: joint angles, joint rates and torques at the nodes.

use crate::machine::Plant;
use crate::movefile::Limits;
use crate::ocp::Solution;
use crate::simulate::trajectory::board_limits;
use stillpoint_shared::{self as shared, LimitsError, TrajectoryBuilder, TrajectoryError, time};

/// Why a solution cannot become a trajectory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConversionError {
    /// The limits do not fit the board's numbers.
    #[error("the limits cannot be given to the board: {0}")]
    Limits(LimitsError),
    /// The move does not fit the board.
    #[error("the move does not fit the board: {0}")]
    Trajectory(TrajectoryError),
    /// The board's numbers are too coarse for the move.
    #[error(
        "axis {axis} moves by {range_rad:.3e} rad at {position_rad:.6e} rad, where the board's f32 resolves {resolution_rad:.1e} rad: \
         count its angle from nearer to the move"
    )]
    Resolution {
        /// Axis, from 1.
        axis: usize,
        /// Its largest position.
        position_rad: f64,
        /// What it moves.
        range_rad: f64,
        /// Distance of neighbouring numbers there.
        resolution_rad: f64,
    },
    /// An interval is too long for the board's clock.
    #[error("interval {interval} lasts {duration_s} s: the board counts at most 429 s")]
    Duration {
        /// Interval, from 1.
        interval: usize,
        /// Its length.
        duration_s: f64,
    },
}

/// The trajectory of a planned move, named by `id`.
///
/// Interval lengths are rounded up to ticks of 0.1 µs, so no rate grows.
///
/// # Errors
/// [`ConversionError`] when the move does not fit the board.
pub fn trajectory(
    plant: &dyn Plant,
    limits: &Limits,
    solution: &Solution,
    id: u32,
) -> Result<shared::Trajectory, ConversionError> {
    let board = board_limits(limits, plant).map_err(ConversionError::Limits)?;
    let (axes, n) = (plant.axis_count(), plant.coordinate_count());
    let mut builder = TrajectoryBuilder::new(id, &board);
    let mut extremes = vec![(f64::INFINITY, f64::NEG_INFINITY); axes];
    let mut first = 0;
    let mut angles: Option<Vec<f64>> = None;
    for (index, ((_, length_s), rule)) in solution.intervals_s().zip(&solution.rules).enumerate() {
        let mut rows = Vec::with_capacity((rule.points() + 1) * 3 * axes);
        for node in first..=first + rule.points() {
            let state = solution.states.column(node);
            let (torque, motion) = state.as_slice().split_at(axes);
            let (q, v) = motion.split_at(n);
            let mut here = plant.joint_angles(q);
            if let Some(before) = &angles {
                for (angle, near) in here.iter_mut().zip(before) {
                    *angle = plant.continued(*angle, *near);
                }
            }
            for (extreme, angle) in extremes.iter_mut().zip(&here) {
                *extreme = (extreme.0.min(*angle), extreme.1.max(*angle));
            }
            rows.extend_from_slice(&here);
            rows.extend(plant.joint_rates(q, v));
            rows.extend_from_slice(torque);
            angles = Some(here);
        }
        let ticks = (length_s * f64::from(time::TIME_TICKS_PER_SECOND)).ceil();
        if !(1.0..=f64::from(u32::MAX)).contains(&ticks) {
            return Err(ConversionError::Duration {
                interval: index + 1,
                duration_s: length_s,
            });
        }
        builder
            .interval(ticks as u32, rule.points(), &rows)
            .map_err(ConversionError::Trajectory)?;
        first += rule.points();
    }
    check_resolution(&extremes)?;
    builder.finish().map_err(ConversionError::Trajectory)
}

/// Refuses a move that the board's numbers would turn into steps.
fn check_resolution(extremes: &[(f64, f64)]) -> Result<(), ConversionError> {
    const FEWEST_STEPS: f64 = 100.0;
    let range_rad = extremes
        .iter()
        .map(|(low, high)| high - low)
        .fold(0.0, f64::max);
    for (index, (low, high)) in extremes.iter().enumerate() {
        let position_rad = low.abs().max(high.abs());
        let resolution_rad = position_rad * f64::from(f32::EPSILON);
        if resolution_rad * FEWEST_STEPS > range_rad {
            return Err(ConversionError::Resolution {
                axis: index + 1,
                position_rad,
                range_rad,
                resolution_rad,
            });
        }
    }
    Ok(())
}
