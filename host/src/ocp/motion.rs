//! A machine's equations at one point, in arrays and in any scalar.

use crate::autodiff::Scalar;
use crate::machine::{Dynamics, Machine};

/// What [`Machine::dynamics`] gives, for `D` coordinates and `A` axes.
pub(super) struct Motion<S, const D: usize, const A: usize> {
    /// F = M(q)a + c(q,v) + ∂V/∂q.
    pub(super) force: [S; D],
    /// J = ∂θ/∂q.
    pub(super) joints: [[S; D]; A],
    /// θ̈ = J a + J̇v.
    pub(super) joint_acceleration: [S; A],
}

impl<S: Scalar, const D: usize, const A: usize> Motion<S, D, A> {
    /// Of a machine.
    pub(super) fn of<M: Machine>(machine: &M, q: &[S; D], v: &[S; D], a: &[S; D]) -> Self {
        let zero = S::constant(0.0);
        let mut out = Self {
            force: [zero; D],
            joints: [[zero; D]; A],
            joint_acceleration: [zero; A],
        };
        let dynamics = Dynamics {
            force: &mut out.force,
            joint_jacobian: out.joints.as_flattened_mut(),
            joint_acceleration: &mut out.joint_acceleration,
        };
        machine.dynamics(q, v, a, dynamics);
        out
    }

    /// Joint rates J v.
    pub(super) fn rates(&self, v: &[S; D]) -> [S; A] {
        std::array::from_fn(|axis| {
            self.joints[axis]
                .iter()
                .zip(v)
                .fold(S::constant(0.0), |sum, (j, v)| sum + *j * *v)
        })
    }
}

/// The machine's output values, `count` of them, then its regularities.
pub(super) fn outputs<M: Machine, S: Scalar>(machine: &M, count: usize, q: &[S]) -> Vec<S> {
    let mut values = vec![S::constant(0.0); count + M::REGULARITIES.len()];
    let (outputs, regularities) = values.split_at_mut(count);
    machine.output_values(q, outputs);
    machine.regularities(q, regularities);
    values
}
