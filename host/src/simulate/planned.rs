//! The joint motion of a planned move: what any plant can be made to follow, also one that the plan was not made for.

use super::path::{JointMotion, JointPath};
use crate::machine::{Equations, Plant};
use crate::ocp::Solution;

/// The joints of a plant that moves as planned.
#[derive(Clone, Copy)]
pub struct PlannedPath<'a> {
    plant: &'a dyn Plant,
    solution: &'a Solution,
}

impl<'a> PlannedPath<'a> {
    /// Of a solution whose states are torques, coordinates and rates of the plant.
    #[must_use]
    pub fn new(plant: &'a dyn Plant, solution: &'a Solution) -> Self {
        Self { plant, solution }
    }
}

impl JointPath for PlannedPath<'_> {
    fn start(&self) -> Vec<f64> {
        let (axes, n) = (self.plant.axis_count(), self.plant.coordinate_count());
        let state = self.solution.states.column(0);
        state.iter().skip(axes).take(n).copied().collect()
    }

    /// θ̈ = J a + J̇v with the accelerations that the planned torque gives.
    fn motion(&self, time_s: f64, equations: &mut Equations) -> JointMotion {
        let (axes, n) = (self.plant.axis_count(), self.plant.coordinate_count());
        let share = (time_s / self.solution.duration_s).clamp(0.0, 1.0);
        let state = self.solution.state_at_share(share);
        let (torque_nm, motion) = state.split_at(axes);
        let (q, v) = (&motion[..n], &motion[n..2 * n]);
        let angles_rad = self.plant.joint_angles(q);
        if time_s >= self.solution.duration_s {
            return JointMotion {
                angles_rad,
                rates_rad_per_s: vec![0.0; axes],
                accelerations_rad_per_s2: vec![0.0; axes],
            };
        }
        let Some(forward) = self.plant.forward(q, v, torque_nm) else {
            let unknown = vec![f64::NAN; axes];
            return JointMotion {
                angles_rad,
                rates_rad_per_s: unknown.clone(),
                accelerations_rad_per_s2: unknown,
            };
        };
        self.plant.equations(q, v, equations);
        let along = |vector: &[f64]| -> Vec<f64> {
            let rows = equations.joint_jacobian.chunks_exact(n);
            rows.map(|row| row.iter().zip(vector).map(|(j, x)| j * x).sum())
                .collect()
        };
        let from_accelerations = along(forward.accelerations.as_slice());
        JointMotion {
            angles_rad,
            rates_rad_per_s: along(v),
            accelerations_rad_per_s2: from_accelerations
                .iter()
                .zip(&equations.joint_bias)
                .map(|(a, bias)| a + bias)
                .collect(),
        }
    }

    fn duration_s(&self) -> f64 {
        self.solution.duration_s
    }

    fn breaks_s(&self) -> Vec<f64> {
        let starts = self.solution.intervals_s().map(|(start, _)| start);
        starts.chain([self.solution.duration_s]).collect()
    }
}
