//! The stage functions of a [`Machine`]: state (τ, q, v), control u = τ̇, with derivatives through the implicit
//! function theorem.
//!
//! The accelerations a(τ, q, v) are defined by r = F(q, v, a) − J(q)ᵀτ = 0, where F is the machine's left-hand side
//! and ∂r/∂a = M. Hence ∂a/∂z = −M⁻¹ ∂r/∂z, and with M y = λ the Hessian of λ·a is
//!
//! ```text
//! φ_zz + φ_za a_z + (φ_za a_z)ᵀ,    φ = −y·r (y held fixed),    φ_aa = 0,
//! ```
//!
//! so only the machine's equations are differentiated twice, never the solution of the linear system.

use super::motion::{Motion, outputs};
use super::problem::{Differentiable, Structure};
use crate::autodiff::{Dual, Scalar, SecondDual};
use crate::machine::Machine;
use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// A row of the path function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathRow {
    /// An output of the machine or, counted on from the last of them, a regularity.
    Output(usize),
    /// A joint rate θ̇, rad/s.
    JointRate(usize),
    /// τ + slope·θ̇: one edge of the torque–speed curve, N·m.
    TorqueSpeed {
        /// Axis.
        axis: usize,
        /// Signed slope, N·m·s/rad.
        slope_nm_s_per_rad: f64,
    },
}

/// Stage functions of a machine with `D` coordinates and `A` axes; `Z` = 2D and `H` = Z(Z+1)/2.
#[derive(Clone, Debug)]
pub struct Mechanical<M, const D: usize, const A: usize, const Z: usize, const H: usize> {
    machine: M,
    rows: Vec<PathRow>,
    outputs: usize,
    structure: Structure,
}

/// The equations of motion solved at one point.
struct Solved<const D: usize, const A: usize> {
    mass: Option<Cholesky<f64, Const<D>>>,
    jacobian: SMatrix<f64, A, D>,
    acceleration: SVector<f64, D>,
}

impl<const D: usize, const A: usize> Solved<D, A> {
    /// ∂a/∂(q, v) and ∂a/∂τ from −∂r/∂(q, v); NaN where the mass matrix is singular.
    fn sensitivities<const Z: usize>(
        &self,
        residual: &SMatrix<f64, D, Z>,
    ) -> (SMatrix<f64, D, Z>, SMatrix<f64, D, A>) {
        self.mass.as_ref().map_or_else(
            || (SMatrix::repeat(f64::NAN), SMatrix::repeat(f64::NAN)),
            |factor| {
                (
                    factor.solve(residual),
                    factor.solve(&self.jacobian.transpose()),
                )
            },
        )
    }
}

impl<M: Machine, const D: usize, const A: usize, const Z: usize, const H: usize>
    Mechanical<M, D, A, Z, H>
{
    const SHAPE: () =
        assert!(M::COORDINATES == D && M::AXES == A && Z == 2 * D && H == Z * (Z + 1) / 2);

    /// Stage functions with the given path rows.
    pub fn new(machine: M, rows: Vec<PathRow>) -> Self {
        let () = Self::SHAPE;
        let outputs = machine.outputs().len();
        let mut structure = Structure::default();
        let (q, v, u) = (A, A + D, A + 2 * D);
        structure.jacobian.extend((0..A).map(|i| (i, u + i)));
        structure.jacobian.extend((0..D).map(|i| (A + i, v + i)));
        for row in A + D..A + 2 * D {
            structure
                .jacobian
                .extend((0..A + 2 * D).map(|column| (row, column)));
        }
        for (index, row) in rows.iter().enumerate() {
            let own = A + 2 * D + index;
            match *row {
                PathRow::Output(_) => structure.jacobian.extend((q..v).map(|c| (own, c))),
                PathRow::JointRate(_) => structure.jacobian.extend((q..u).map(|c| (own, c))),
                PathRow::TorqueSpeed { axis, .. } => {
                    structure.jacobian.push((own, axis));
                    structure.jacobian.extend((q..u).map(|c| (own, c)));
                }
            }
        }
        // Torques enter linearly and meet only the coordinates.
        for row in q..u {
            let first = if row < v { 0 } else { q };
            structure
                .hessian
                .extend((first..=row).map(|column| (row, column)));
        }
        Self {
            machine,
            rows,
            outputs,
            structure,
        }
    }

    fn solve(&self, z: &[f64]) -> Solved<D, A> {
        let q: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(z[A + i]));
        let v: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(z[A + D + i]));
        let a: [Dual<D>; D] = std::array::from_fn(|i| Dual::seed(0.0, i));
        let Motion {
            force,
            joints: joint,
            ..
        } = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let mass = SMatrix::<f64, D, D>::from_fn(|r, c| force[r].gradient[c]);
        let jacobian = SMatrix::<f64, A, D>::from_fn(|r, c| joint[r][c].value);
        let torque = SVector::<f64, A>::from_column_slice(&z[..A]);
        let right =
            jacobian.transpose() * torque - SVector::<f64, D>::from_fn(|r, _| force[r].value);
        let mass = Cholesky::new(mass);
        let acceleration = mass
            .as_ref()
            .map_or_else(|| SVector::repeat(f64::NAN), |factor| factor.solve(&right));
        Solved {
            mass,
            jacobian,
            acceleration,
        }
    }

    /// τ̇, q̇, v̇ and, given joint rates and outputs, the path rows; no running cost.
    fn fill(
        &self,
        z: &[f64],
        acceleration: &SVector<f64, D>,
        rates: &SVector<f64, A>,
        outputs: &[f64],
        out: &mut [f64],
    ) {
        out[..A].copy_from_slice(&z[A + 2 * D..]);
        out[A..A + D].copy_from_slice(&z[A + D..A + 2 * D]);
        out[A + D..A + 2 * D].copy_from_slice(acceleration.as_slice());
        for (slot, row) in out[A + 2 * D..].iter_mut().zip(&self.rows) {
            *slot = match *row {
                PathRow::Output(index) => outputs[index],
                PathRow::JointRate(axis) => rates[axis],
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => z[axis] + slope_nm_s_per_rad * rates[axis],
            };
        }
        if let Some(cost) = out.last_mut() {
            *cost = 0.0;
        }
    }

    /// Values of outputs and regularities, none if no row needs them.
    fn outputs<S: Scalar>(&self, q: &[S]) -> Vec<S> {
        let needed = |row: &PathRow| matches!(row, PathRow::Output(_));
        if self.rows.iter().any(needed) {
            outputs(&self.machine, self.outputs, q)
        } else {
            Vec::new()
        }
    }
}

impl<M: Machine, const D: usize, const A: usize, const Z: usize, const H: usize> Differentiable
    for Mechanical<M, D, A, Z, H>
{
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        let solved = self.solve(z);
        let rates = solved.jacobian * SVector::<f64, D>::from_column_slice(&z[A + D..A + 2 * D]);
        let outputs = self.outputs(&z[A..A + D]);
        self.fill(z, &solved.acceleration, &rates, &outputs, out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let solved = self.solve(z);
        let q: [Dual<Z>; D] = std::array::from_fn(|i| Dual::seed(z[A + i], i));
        let v: [Dual<Z>; D] = std::array::from_fn(|i| Dual::seed(z[A + D + i], D + i));
        let a: [Dual<Z>; D] = std::array::from_fn(|i| Dual::constant(solved.acceleration[i]));
        let motion = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let rates = motion.rates(&v);
        let (force, joint) = (motion.force, motion.joints);
        let outputs = self.outputs(&q);

        let residual = SMatrix::<f64, D, Z>::from_fn(|r, c| {
            let torque_share: f64 = (0..A).map(|i| joint[i][r].gradient[c] * z[i]).sum();
            torque_share - force[r].gradient[c]
        });
        let (by_state, by_torque) = solved.sensitivities(&residual);

        let output_values: Vec<f64> = outputs.iter().map(|o| o.value).collect();
        let rate_values = SVector::<f64, A>::from_fn(|i, _| rates[i].value);
        self.fill(z, &solved.acceleration, &rate_values, &output_values, out);

        let mut slots = entries.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        (0..A + D).for_each(|_| put(1.0));
        for row in 0..D {
            by_torque.row(row).iter().for_each(|&value| put(value));
            by_state.row(row).iter().for_each(|&value| put(value));
        }
        for row in &self.rows {
            match *row {
                PathRow::Output(index) => outputs[index].gradient[..D]
                    .iter()
                    .for_each(|&value| put(value)),
                PathRow::JointRate(axis) => {
                    rates[axis].gradient.iter().for_each(|&value| put(value))
                }
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => {
                    put(1.0);
                    rates[axis]
                        .gradient
                        .iter()
                        .for_each(|&value| put(slope_nm_s_per_rad * value));
                }
            }
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let solved = self.solve(z);
        let lambda = SVector::<f64, D>::from_column_slice(&weights[A + D..A + 2 * D]);
        let y = solved
            .mass
            .as_ref()
            .map_or_else(|| SVector::repeat(f64::NAN), |factor| factor.solve(&lambda));

        // φ and the path rows, second order in (q, v).
        let q: [SecondDual<Z, H>; D] = std::array::from_fn(|i| SecondDual::seed(z[A + i], i));
        let v: [SecondDual<Z, H>; D] =
            std::array::from_fn(|i| SecondDual::seed(z[A + D + i], D + i));
        let a: [SecondDual<Z, H>; D] =
            std::array::from_fn(|i| SecondDual::constant(solved.acceleration[i]));
        let motion = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let rates = motion.rates(&v);
        let (force, joint) = (motion.force, motion.joints);
        let mut total = SecondDual::<Z, H>::constant(0.0);
        for i in 0..D {
            total -= force[i] * y[i];
            for axis in 0..A {
                total += joint[axis][i] * (y[i] * z[axis]);
            }
        }
        let path = &weights[A + 2 * D..];
        let outputs = self.outputs(&q);
        for (row, &weight) in self.rows.iter().zip(path) {
            match *row {
                PathRow::Output(index) => total += outputs[index] * weight,
                PathRow::JointRate(axis) => total += rates[axis] * weight,
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => {
                    total += rates[axis] * (weight * slope_nm_s_per_rad);
                }
            }
        }

        // φ_qa = −∂(M y)/∂q and φ_qτ = ∂(J y)/∂q: first order in q, from the equations with a = y and a = 0 at rest.
        let q: [Dual<D>; D] = std::array::from_fn(|i| Dual::seed(z[A + i], i));
        let rest = [Dual::<D>::constant(0.0); D];
        let y_dual: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(y[i]));
        let without = Motion::<_, D, A>::of(&self.machine, &q, &rest, &rest);
        let with_y = Motion::<_, D, A>::of(&self.machine, &q, &rest, &y_dual);
        let q_by_a = SMatrix::<f64, D, D>::from_fn(|i, k| {
            without.force[k].gradient[i] - with_y.force[k].gradient[i]
        });
        let along_y = with_y.joint_acceleration;

        // a_z from the gradient parts of the second-order pass.
        let residual = SMatrix::<f64, D, Z>::from_fn(|r, c| {
            let torque_share: f64 = (0..A).map(|i| joint[i][r].gradient[c] * z[i]).sum();
            torque_share - force[r].gradient[c]
        });
        let (by_state, by_torque) = solved.sensitivities(&residual);
        let mixed = q_by_a * by_state;
        let mixed_torque = q_by_a * by_torque;

        let mut slots = entries.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        for row in 0..Z {
            if row < D {
                for axis in 0..A {
                    put(mixed_torque[(row, axis)] + along_y[axis].gradient[row]);
                }
            }
            for column in 0..=row {
                let mut value = total.hessian[row * (row + 1) / 2 + column];
                if row < D {
                    value += mixed[(row, column)];
                }
                if column < D {
                    value += mixed[(column, row)];
                }
                put(value);
            }
        }
    }
}
