//! The joint motion that a trajectory asks for: what drives are sent, taken as numbers without rounding.

use super::path::{JointMotion, JointPath};
use crate::machine::Equations;
use crate::ocp::{Interval, Mesh, Solution, lgr::Rule};
use nalgebra::DMatrix;
use stillpoint_shared::lgr::LgrError;
use stillpoint_shared::trajectory::QUANTITIES;
use stillpoint_shared::{Trajectory, time};

/// A trajectory's positions and velocities; accelerations are the slopes of the velocities.
///
/// Nodes are the exact ones. The board's, rounded to f32, are at most 3·10⁻⁸ of half an interval away, which moves an angle by less
/// than its own rounding.
pub struct ShippedPath {
    start: Vec<f64>,
    axes: usize,
    /// States (angles, rates) and controls (accelerations) of all axes.
    motion: Solution,
}

impl ShippedPath {
    /// From the coordinates `start`.
    ///
    /// # Errors
    /// [`LgrError`] for an interval with an impossible number of points.
    pub fn new(trajectory: &Trajectory, start: Vec<f64>) -> Result<Self, LgrError> {
        let axes = trajectory.axes();
        let (mut states, mut controls) = (Vec::new(), Vec::new());
        let (mut intervals, mut rules) = (Vec::new(), Vec::new());
        let mut end = Vec::new();
        for interval in trajectory.intervals() {
            let rule = Rule::new(interval.points)?;
            let length_s = time::seconds(interval.duration_ticks);
            let rows: Vec<Vec<f64>> = (interval.coefficients)
                .chunks_exact(QUANTITIES * axes)
                .map(|row| row[..2 * axes].iter().map(|&x| f64::from(x)).collect())
                .collect();
            for point in 0..interval.points {
                states.extend(&rows[point]);
                let slopes = rule.differentiation.row(point);
                controls.extend((axes..2 * axes).map(|rate| {
                    let sum: f64 = slopes.iter().zip(&rows).map(|(d, row)| d * row[rate]).sum();
                    sum * 2.0 / length_s
                }));
            }
            end.clone_from(&rows[interval.points]);
            intervals.push(Interval {
                fraction: length_s,
                points: interval.points,
            });
            rules.push(rule);
        }
        states.extend(end);
        let points = controls.len() / axes;
        Ok(Self {
            start,
            axes,
            motion: Solution {
                duration_s: time::seconds(trajectory.duration_ticks()),
                mesh: Mesh::new(intervals),
                rules,
                states: DMatrix::from_vec(2 * axes, points + 1, states),
                controls: DMatrix::from_vec(axes, points, controls),
            },
        })
    }
}

impl JointPath for ShippedPath {
    fn start(&self) -> Vec<f64> {
        self.start.clone()
    }

    fn motion(&self, time_s: f64, _equations: &mut Equations) -> JointMotion {
        let share = (time_s / self.motion.duration_s).clamp(0.0, 1.0);
        let place = self.motion.place(share);
        let mut angles_rad = self.motion.state_at(place);
        let rates_rad_per_s = angles_rad.split_off(self.axes);
        if time_s >= self.motion.duration_s {
            return JointMotion {
                angles_rad,
                rates_rad_per_s: vec![0.0; self.axes],
                accelerations_rad_per_s2: vec![0.0; self.axes],
            };
        }
        JointMotion {
            angles_rad,
            rates_rad_per_s,
            accelerations_rad_per_s2: self.motion.control_at(place),
        }
    }

    fn duration_s(&self) -> f64 {
        self.motion.duration_s
    }

    fn breaks_s(&self) -> Vec<f64> {
        let starts = self.motion.intervals_s().map(|(start, _)| start);
        starts.chain([self.motion.duration_s]).collect()
    }
}
