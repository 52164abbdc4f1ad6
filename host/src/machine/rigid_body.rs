//! Forward dynamics of any [`Machine`] in plain numbers, for simulation and checks.

use super::equations::{self, Equations};
use super::{Coordinate, Dynamics, Machine, Output};
use crate::autodiff::{Dual, Scalar, Taylor};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::f64::consts::TAU;

/// Mass matrix and accelerations at one point.
#[derive(Clone, Debug)]
pub struct ForwardDynamics {
    /// M(q), `COORDINATES` square.
    pub mass_matrix: DMatrix<f64>,
    /// Accelerations q̈.
    pub accelerations: DVector<f64>,
    /// J = ∂θ/∂q, `AXES` × `COORDINATES`.
    pub joint_jacobian: DMatrix<f64>,
}

/// A machine in plain numbers, whatever its kind: what simulation and reports work with.
pub trait Plant: Send + Sync {
    /// Number of generalised coordinates.
    fn coordinate_count(&self) -> usize;
    /// Number of driven joints.
    fn axis_count(&self) -> usize;
    /// Descriptions of the coordinates.
    fn coordinates(&self) -> Vec<Coordinate>;
    /// Descriptions of the outputs.
    fn outputs(&self) -> Vec<Output>;
    /// Names of the components of a pose.
    fn pose_names(&self) -> &'static [&'static str];
    /// Undeformed coordinates at a pose.
    fn rest(&self, pose: &[f64]) -> Vec<f64>;
    /// Motor speed over joint speed.
    fn reducer_ratio(&self) -> f64;
    /// Mass matrix, accelerations and joint Jacobian; `None` where the mechanism cannot be assembled or is singular.
    fn forward(&self, q: &[f64], v: &[f64], torque_nm: &[f64]) -> Option<ForwardDynamics>;
    /// M, bias, J and J̇v at one point into buffers that are reused: what integration calls thousands of times.
    ///
    /// NaN where the mechanism cannot be assembled.
    fn equations(&self, q: &[f64], v: &[f64], equations: &mut Equations);
    /// ∂(∂V/∂q)/∂q at rest: the stiffness matrix, `coordinate_count` square.
    fn stiffness(&self, q: &[f64]) -> DMatrix<f64>;
    /// Joint angles θ(q), rad.
    fn joint_angles(&self, q: &[f64]) -> Vec<f64>;
    /// The joint angle that continues from `near_rad`: angles that wrap are unwrapped.
    fn continued(&self, angle_rad: f64, near_rad: f64) -> f64;
    /// Joint rates θ̇ = J(q) v, rad/s.
    fn joint_rates(&self, q: &[f64], v: &[f64]) -> Vec<f64>;
    /// Output values.
    fn output_values(&self, q: &[f64]) -> Vec<f64>;
    /// How the outputs change along a direction of the coordinates.
    fn output_slopes(&self, q: &[f64], direction: &[f64]) -> Vec<f64>;
    /// Output values and their first two derivatives over a stretch of time, rounding included, from the coordinates'.
    fn output_enclosures(&self, q: &[Taylor]) -> Vec<Taylor>;
}

impl<M: Machine> Plant for M {
    fn coordinate_count(&self) -> usize {
        M::COORDINATES
    }
    fn axis_count(&self) -> usize {
        M::AXES
    }
    fn coordinates(&self) -> Vec<Coordinate> {
        Machine::coordinates(self)
    }
    fn outputs(&self) -> Vec<Output> {
        Machine::outputs(self)
    }
    fn pose_names(&self) -> &'static [&'static str] {
        Machine::pose_names(self)
    }
    fn rest(&self, pose: &[f64]) -> Vec<f64> {
        Machine::rest(self, pose)
    }
    fn reducer_ratio(&self) -> f64 {
        Machine::reducer_ratio(self)
    }

    fn forward(&self, q: &[f64], v: &[f64], torque_nm: &[f64]) -> Option<ForwardDynamics> {
        let n = M::COORDINATES;
        let mut equations = Equations::new(self);
        Plant::equations(self, q, v, &mut equations);
        let mass_matrix = DMatrix::from_row_slice(n, n, &equations.mass_matrix);
        let joint_jacobian = DMatrix::from_row_slice(M::AXES, n, &equations.joint_jacobian);
        let bias = DVector::from_column_slice(&equations.bias);
        let right = joint_jacobian.transpose() * DVector::from_column_slice(torque_nm) - bias;
        let accelerations = Cholesky::new(mass_matrix.clone())?.solve(&right);
        accelerations
            .iter()
            .all(|a| a.is_finite())
            .then_some(ForwardDynamics {
                mass_matrix,
                accelerations,
                joint_jacobian,
            })
    }

    fn equations(&self, q: &[f64], v: &[f64], equations: &mut Equations) {
        equations::evaluate(self, q, v, equations);
    }

    fn stiffness(&self, q: &[f64]) -> DMatrix<f64> {
        equations::stiffness(self, q)
    }

    fn joint_angles(&self, q: &[f64]) -> Vec<f64> {
        let mut angles = vec![0.0; M::AXES];
        Machine::joint_angles(self, q, &mut angles);
        angles
    }

    fn continued(&self, angle_rad: f64, near_rad: f64) -> f64 {
        if M::ANGLES_WRAP {
            angle_rad + TAU * ((near_rad - angle_rad) / TAU).round()
        } else {
            angle_rad
        }
    }

    fn joint_rates(&self, q: &[f64], v: &[f64]) -> Vec<f64> {
        let n = M::COORDINATES;
        let mut joint_jacobian = vec![0.0; M::AXES * n];
        let dynamics = Dynamics {
            force: &mut vec![0.0; n],
            joint_jacobian: &mut joint_jacobian,
            joint_acceleration: &mut vec![0.0; M::AXES],
        };
        self.dynamics(q, v, &vec![0.0; n], dynamics);
        joint_jacobian
            .chunks_exact(n)
            .map(|row| row.iter().zip(v).map(|(j, v)| j * v).sum())
            .collect()
    }

    fn output_slopes(&self, q: &[f64], direction: &[f64]) -> Vec<f64> {
        let along = q.iter().zip(direction);
        let point: Vec<Dual<1>> = along
            .map(|(&value, &slope)| Dual {
                value,
                gradient: [slope],
            })
            .collect();
        let mut out = vec![Dual::constant(0.0); Machine::outputs(self).len()];
        Machine::output_values(self, &point, &mut out);
        out.iter().map(|output| output.gradient[0]).collect()
    }

    fn output_values(&self, q: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; Machine::outputs(self).len()];
        Machine::output_values(self, q, &mut out);
        out
    }

    fn output_enclosures(&self, q: &[Taylor]) -> Vec<Taylor> {
        let mut out = vec![Taylor::constant(0.0); Machine::outputs(self).len()];
        Machine::output_values(self, q, &mut out);
        out
    }
}
