//! Equations of motion in plain numbers, into buffers that are reused.

use super::{Dynamics, Machine, Plant};
use crate::autodiff::{Dual, Scalar};
use nalgebra::DMatrix;

/// M(q) a + bias(q, v) = J(q)ᵀ τ with θ̈ = J a + J̇v, all at one point. Matrices are row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Equations {
    /// M(q), `coordinate_count` square.
    pub mass_matrix: Vec<f64>,
    /// c(q, v) + ∂V/∂q.
    pub bias: Vec<f64>,
    /// J = ∂θ/∂q, `axis_count` × `coordinate_count`.
    pub joint_jacobian: Vec<f64>,
    /// J̇v, the joint accelerations while the coordinates' accelerations are zero.
    pub joint_bias: Vec<f64>,
}

impl Equations {
    /// Buffers for a machine.
    #[must_use]
    pub fn new(plant: &dyn Plant) -> Self {
        let (n, axes) = (plant.coordinate_count(), plant.axis_count());
        Self {
            mass_matrix: vec![0.0; n * n],
            bias: vec![0.0; n],
            joint_jacobian: vec![0.0; axes * n],
            joint_bias: vec![0.0; axes],
        }
    }
}

/// Numbers of working space on the stack: a machine that needs more gets it from the heap.
const STACK: usize = 48;

/// Directions per pass; a machine with more coordinates takes more passes.
const WIDTH: usize = 8;

/// The directions are the accelerations, in which the equations are affine: derivatives are M exactly, values the bias.
pub(super) fn evaluate<M: Machine>(machine: &M, q: &[f64], v: &[f64], out: &mut Equations) {
    let n = M::COORDINATES;
    if n <= WIDTH {
        // The usual case in one pass, as narrow as the machine allows: what is computed per direction is most of the time.
        match n {
            0..=2 => pass::<M, 2>(machine, q, v, 0, out),
            3..=4 => pass::<M, 4>(machine, q, v, 0, out),
            5..=6 => pass::<M, 6>(machine, q, v, 0, out),
            _ => pass::<M, WIDTH>(machine, q, v, 0, out),
        }
    } else {
        for first in (0..n).step_by(WIDTH) {
            pass::<M, WIDTH>(machine, q, v, first, out);
        }
    }
}

/// Directions `first..first + W` of `COORDINATES`.
fn pass<M: Machine, const W: usize>(
    machine: &M,
    q: &[f64],
    v: &[f64],
    first: usize,
    out: &mut Equations,
) {
    let (n, axes) = (M::COORDINATES, M::AXES);
    let zero = Dual::<W>::constant(0.0);
    let (mut stack, mut heap) = ([zero; STACK], Vec::new());
    let needed = 4 * n + axes * (n + 1);
    let space = match stack.get_mut(..needed) {
        Some(space) => space,
        None => {
            heap.resize(needed, zero);
            heap.as_mut_slice()
        }
    };
    let (points, results) = space.split_at_mut(3 * n);
    let (force, joints) = results.split_at_mut(n);
    let (joint_jacobian, joint_acceleration) = joints.split_at_mut(axes * n);
    for i in 0..n {
        points[i].value = q[i];
        points[n + i].value = v[i];
        if (first..first + W).contains(&i) {
            points[2 * n + i].gradient[i - first] = 1.0;
        }
    }
    let (q_dual, rest) = points.split_at(n);
    let (v_dual, a_dual) = rest.split_at(n);
    let dynamics = Dynamics {
        force: &mut *force,
        joint_jacobian: &mut *joint_jacobian,
        joint_acceleration: &mut *joint_acceleration,
    };
    machine.dynamics(q_dual, v_dual, a_dual, dynamics);
    for (row, entry) in force.iter().enumerate() {
        out.bias[row] = entry.value;
        let columns = first..n.min(first + W);
        out.mass_matrix[row * n..][columns.clone()]
            .copy_from_slice(&entry.gradient[..columns.len()]);
    }
    for (value, entry) in out.joint_jacobian.iter_mut().zip(&*joint_jacobian) {
        *value = entry.value;
    }
    for (value, entry) in out.joint_bias.iter_mut().zip(&*joint_acceleration) {
        *value = entry.value;
    }
}

/// Derivative of the generalised force with respect to the coordinates, at rest.
pub(super) fn stiffness<M: Machine>(machine: &M, q: &[f64]) -> DMatrix<f64> {
    let n = M::COORDINATES;
    let zero = Dual::<1>::constant(0.0);
    let mut out = DMatrix::zeros(n, n);
    let mut force = vec![zero; n];
    let mut joint_jacobian = vec![zero; M::AXES * n];
    let mut joint_acceleration = vec![zero; M::AXES];
    for column in 0..n {
        let mut point: Vec<Dual<1>> = q.iter().map(|&x| Dual::constant(x)).collect();
        point[column] = Dual::seed(q[column], 0);
        let dynamics = Dynamics {
            force: &mut force,
            joint_jacobian: &mut joint_jacobian,
            joint_acceleration: &mut joint_acceleration,
        };
        machine.dynamics(&point, &vec![zero; n], &vec![zero; n], dynamics);
        for row in 0..n {
            out[(row, column)] = force[row].gradient[0];
        }
    }
    out
}
