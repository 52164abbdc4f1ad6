//! A [`Machine`] whose joints follow commanded accelerations α: state (q, v), with the motor torques τ as a result.
//!
//! Index reduction: the constraint θ(q) = θ_commanded is imposed on accelerations, and holds from a common start on. So
//! w = (a, τ) is defined by
//!
//! ```text
//! r = ( F(q, v, a) − J(q)ᵀτ ) = 0,    ∂r/∂w = K = ( M  −Jᵀ )
//!     ( θ̈(q, v, a) − α      )                     ( J   0  )
//! ```
//!
//! where F is the machine's left-hand side. Hence ∂w/∂z = −K⁻¹ ∂r/∂z, and with Kᵀy = λ the Hessian of λ·w is
//!
//! ```text
//! φ_zz + φ_zw w_z + (φ_zw w_z)ᵀ,    φ = −y·r (y held fixed),    φ_ww = 0,
//! ```
//!
//! as in [`Mechanical`](super::Mechanical). α enters linearly and meets only q.

use super::mechanical::PathRow;
use super::motion::{Motion, outputs};
use super::problem::{Differentiable, Structure};
use crate::autodiff::{Dual, Scalar, SecondDual};
use crate::machine::Machine;
use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// (q̇, v̇, path rows) of (q, v, α) for a machine with `D` coordinates and `A` axes; `Z` = 2D and `H` = Z(Z+1)/2.
#[derive(Clone, Debug)]
pub struct Driven<M, const D: usize, const A: usize, const Z: usize, const H: usize> {
    machine: M,
    rows: Vec<PathRow>,
    outputs: usize,
    structure: Structure,
}

/// The equations solved at one point.
struct Solved<const D: usize, const A: usize> {
    mass: Cholesky<f64, Const<D>>,
    jacobian: SMatrix<f64, A, D>,
    /// J M⁻¹ Jᵀ.
    schur: Cholesky<f64, Const<A>>,
    acceleration: SVector<f64, D>,
    torque: SVector<f64, A>,
}

impl<const D: usize, const A: usize> Solved<D, A> {
    /// Solves K (a, τ) = (force, joints).
    fn columns<const C: usize>(
        &self,
        force: &SMatrix<f64, D, C>,
        joints: &SMatrix<f64, A, C>,
    ) -> (SMatrix<f64, D, C>, SMatrix<f64, A, C>) {
        let torque = self
            .schur
            .solve(&(joints - self.jacobian * self.mass.solve(force)));
        let acceleration = self
            .mass
            .solve(&(force + self.jacobian.transpose() * torque));
        (acceleration, torque)
    }

    /// Solves Kᵀ y = λ.
    fn transposed(
        &self,
        by_acceleration: &SVector<f64, D>,
        by_torque: &SVector<f64, A>,
    ) -> (SVector<f64, D>, SVector<f64, A>) {
        let joints = self
            .schur
            .solve(&(self.jacobian * self.mass.solve(by_acceleration) + by_torque));
        let force = self
            .mass
            .solve(&(by_acceleration - self.jacobian.transpose() * joints));
        (force, joints)
    }
}

impl<M: Machine, const D: usize, const A: usize, const Z: usize, const H: usize>
    Driven<M, D, A, Z, H>
{
    const SHAPE: () =
        assert!(M::COORDINATES == D && M::AXES == A && Z == 2 * D && H == Z * (Z + 1) / 2);

    /// A machine with the given path rows, of which those with a torque show the torque that the motion asks for.
    pub fn new(machine: M, rows: Vec<PathRow>) -> Self {
        let () = Self::SHAPE;
        let mut structure = Structure::default();
        let all = Z + A;
        structure.jacobian.extend((0..D).map(|i| (i, D + i)));
        for row in D..Z {
            structure.jacobian.extend((0..all).map(|c| (row, c)));
        }
        for (index, row) in rows.iter().enumerate() {
            let columns = match row {
                PathRow::Output(_) => D,
                PathRow::JointRate(_) => Z,
                PathRow::TorqueSpeed { .. } => all,
            };
            structure
                .jacobian
                .extend((0..columns).map(|c| (Z + index, c)));
        }
        for row in 0..all {
            let columns = if row < Z { row + 1 } else { D };
            structure.hessian.extend((0..columns).map(|c| (row, c)));
        }
        Self {
            outputs: machine.outputs().len(),
            machine,
            rows,
            structure,
        }
    }

    /// `None` where the mechanism cannot be assembled or is singular.
    fn solve(&self, z: &[f64]) -> Option<Solved<D, A>> {
        let q: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(z[i]));
        let v: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(z[D + i]));
        let a: [Dual<D>; D] = std::array::from_fn(|i| Dual::seed(0.0, i));
        let motion = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let mass = SMatrix::<f64, D, D>::from_fn(|r, c| motion.force[r].gradient[c]);
        let mass = Cholesky::new(mass)?;
        let jacobian = SMatrix::<f64, A, D>::from_fn(|r, c| motion.joints[r][c].value);
        let schur = Cholesky::new(jacobian * mass.solve(&jacobian.transpose()))?;
        let mut solved = Solved {
            mass,
            jacobian,
            schur,
            acceleration: SVector::zeros(),
            torque: SVector::zeros(),
        };
        let force = SVector::<f64, D>::from_fn(|r, _| -motion.force[r].value);
        let joints =
            SVector::<f64, A>::from_fn(|i, _| z[Z + i] - motion.joint_acceleration[i].value);
        (solved.acceleration, solved.torque) = solved.columns(&force, &joints);
        Some(solved)
    }

    /// q̇, v̇ and, given outputs and joint rates, the path rows.
    fn fill(
        &self,
        z: &[f64],
        solved: &Solved<D, A>,
        rates: &[f64; A],
        outputs: &[f64],
        out: &mut [f64],
    ) {
        out[..D].copy_from_slice(&z[D..Z]);
        out[D..Z].copy_from_slice(solved.acceleration.as_slice());
        for (slot, row) in out[Z..].iter_mut().zip(&self.rows) {
            *slot = match *row {
                PathRow::Output(index) => outputs[index],
                PathRow::JointRate(axis) => rates[axis],
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => solved.torque[axis] + slope_nm_s_per_rad * rates[axis],
            };
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

    /// −∂r/∂(q, v) with w held fixed, from an evaluation with the seeds q, then v.
    fn residual<S: Scalar>(
        motion: &Motion<S, D, A>,
        torque: &SVector<f64, A>,
        slope: impl Fn(&S, usize) -> f64,
    ) -> (SMatrix<f64, D, Z>, SMatrix<f64, A, Z>) {
        let force = SMatrix::from_fn(|r, c| {
            let share: f64 = (0..A)
                .map(|i| slope(&motion.joints[i][r], c) * torque[i])
                .sum();
            share - slope(&motion.force[r], c)
        });
        let joints = SMatrix::from_fn(|r, c| -slope(&motion.joint_acceleration[r], c));
        (force, joints)
    }
}

impl<M: Machine, const D: usize, const A: usize, const Z: usize, const H: usize> Differentiable
    for Driven<M, D, A, Z, H>
{
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        let Some(solved) = self.solve(z) else {
            out.fill(f64::NAN);
            return;
        };
        let rates = solved.jacobian * SVector::<f64, D>::from_column_slice(&z[D..Z]);
        let rates = std::array::from_fn(|i| rates[i]);
        self.fill(z, &solved, &rates, &self.outputs(&z[..D]), out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let Some(solved) = self.solve(z) else {
            out.fill(f64::NAN);
            entries.fill(f64::NAN);
            return;
        };
        let q: [Dual<Z>; D] = std::array::from_fn(|i| Dual::seed(z[i], i));
        let v: [Dual<Z>; D] = std::array::from_fn(|i| Dual::seed(z[D + i], D + i));
        let a: [Dual<Z>; D] = std::array::from_fn(|i| Dual::constant(solved.acceleration[i]));
        let motion = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let rates = motion.rates(&v);
        let outputs = self.outputs(&q);
        let values: Vec<f64> = outputs.iter().map(|o| o.value).collect();
        self.fill(z, &solved, &rates.map(|r| r.value), &values, out);

        let (force, joints) = Self::residual(&motion, &solved.torque, |s, c| s.gradient[c]);
        let by_state = solved.columns(&force, &joints);
        let by_command = solved.columns(&SMatrix::<f64, D, A>::zeros(), &SMatrix::identity());

        let mut slots = entries.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        (0..D).for_each(|_| put(1.0));
        for row in 0..D {
            by_state.0.row(row).iter().for_each(|&value| put(value));
            by_command.0.row(row).iter().for_each(|&value| put(value));
        }
        for row in &self.rows {
            match *row {
                PathRow::Output(index) => {
                    let gradient = outputs[index].gradient;
                    gradient[..D].iter().for_each(|&value| put(value));
                }
                PathRow::JointRate(axis) => rates[axis].gradient.iter().for_each(|&g| put(g)),
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => {
                    let torque = by_state.1.row(axis);
                    for (torque, rate) in torque.iter().zip(&rates[axis].gradient) {
                        put(torque + slope_nm_s_per_rad * rate);
                    }
                    by_command.1.row(axis).iter().for_each(|&value| put(value));
                }
            }
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let Some(solved) = self.solve(z) else {
            entries.fill(f64::NAN);
            return;
        };
        let path = &weights[Z..];
        let by_acceleration = SVector::<f64, D>::from_column_slice(&weights[D..Z]);
        let mut by_torque = SVector::<f64, A>::zeros();
        for (row, weight) in self.rows.iter().zip(path) {
            if let PathRow::TorqueSpeed { axis, .. } = *row {
                by_torque[axis] += weight;
            }
        }
        let (y, y_joints) = solved.transposed(&by_acceleration, &by_torque);

        // φ and the path rows, second order in (q, v).
        let q: [SecondDual<Z, H>; D] = std::array::from_fn(|i| SecondDual::seed(z[i], i));
        let v: [SecondDual<Z, H>; D] = std::array::from_fn(|i| SecondDual::seed(z[D + i], D + i));
        let a: [SecondDual<Z, H>; D] =
            std::array::from_fn(|i| SecondDual::constant(solved.acceleration[i]));
        let motion = Motion::<_, D, A>::of(&self.machine, &q, &v, &a);
        let rates = motion.rates(&v);
        let mut total = SecondDual::<Z, H>::constant(0.0);
        for i in 0..D {
            total -= motion.force[i] * y[i];
            for axis in 0..A {
                total += motion.joints[axis][i] * (y[i] * solved.torque[axis]);
            }
        }
        for axis in 0..A {
            total -= motion.joint_acceleration[axis] * y_joints[axis];
        }
        let outputs = self.outputs(&q);
        for (row, &weight) in self.rows.iter().zip(path) {
            match *row {
                PathRow::Output(index) => total += outputs[index] * weight,
                PathRow::JointRate(axis) => total += rates[axis] * weight,
                PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                } => total += rates[axis] * (weight * slope_nm_s_per_rad),
            }
        }

        // φ_qa = −∂(M y + Jᵀ y_joints)/∂q and φ_qτ = ∂(J y)/∂q: first order in q, from the equations at rest with a = y and
        // with a = 0.
        let q: [Dual<D>; D] = std::array::from_fn(|i| Dual::seed(z[i], i));
        let rest = [Dual::<D>::constant(0.0); D];
        let y_dual: [Dual<D>; D] = std::array::from_fn(|i| Dual::constant(y[i]));
        let without = Motion::<_, D, A>::of(&self.machine, &q, &rest, &rest);
        let with_y = Motion::<_, D, A>::of(&self.machine, &q, &rest, &y_dual);
        let q_by_a = SMatrix::<f64, D, D>::from_fn(|i, k| {
            let joints: f64 = (0..A)
                .map(|axis| without.joints[axis][k].gradient[i] * y_joints[axis])
                .sum();
            without.force[k].gradient[i] - with_y.force[k].gradient[i] - joints
        });
        let q_by_torque =
            SMatrix::<f64, D, A>::from_fn(|i, k| with_y.joint_acceleration[k].gradient[i]);

        // w_z from the gradient parts of the second-order pass.
        let (force, joints) = Self::residual(&motion, &solved.torque, |s, c| s.gradient[c]);
        let by_state = solved.columns(&force, &joints);
        let by_command = solved.columns(&SMatrix::<f64, D, A>::zeros(), &SMatrix::identity());
        let mixed = q_by_a * by_state.0 + q_by_torque * by_state.1;
        let mixed_command = q_by_a * by_command.0 + q_by_torque * by_command.1;

        let mut slots = entries.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        for row in 0..Z {
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
        for axis in 0..A {
            mixed_command.column(axis).iter().for_each(|&m| put(m));
        }
    }
}
