//! The optimal control problem of a move: the fastest way from rest to rest within every limit.
//!
//! State (τ, q, v), control u = τ̇ (eqs. 6–8 of the paper); the cost is the duration. At both ends the machine stands
//! undeformed and without torque, so nothing accelerates and nothing rings afterwards.

use super::guess::rigid_duration_s;
use crate::autodiff::Scalar;
use crate::machine::{Machine, OutputForm};
use crate::movefile::{Limits, MachineKind, MoveFile};
use crate::ocp::{
    Bounds, Differentiable, Exact, Mechanical, Model, OptimalControlProblem, PathRow, Quantity,
    Sizes,
};

/// Shortest duration the planner considers, as share of that of the rigid quintic: an axis limited in speed alone takes 1/1.875
/// of it, with a limited torque or torque rate more. Without it some solves fall into a duration of zero and stay there.
const SHORTEST_SHARE: f64 = 0.2;

/// Longest duration the planner considers, s.
const LONGEST_S: f64 = 1e3;

/// Moves below this share of a typical one are scaled by their own size.
const TINY: f64 = 0.1;

/// Φ = T, no end constraints.
#[derive(Clone, Copy, Debug)]
struct Duration {
    states: usize,
}

impl Model for Duration {
    fn variables(&self) -> usize {
        2 * self.states + 1
    }
    fn values(&self) -> usize {
        1
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[2 * self.states];
    }
}

/// The problem of a move file.
#[must_use]
pub fn move_problem(file: &MoveFile) -> OptimalControlProblem {
    match &file.machine {
        MachineKind::ThreeRrr(machine) => build(machine, file, |rows| {
            Box::new(Mechanical::<_, 6, 3, 12, 78>::new(machine.clone(), rows))
        }),
        MachineKind::TwoMassAxis(machine) => build(machine, file, |rows| {
            Box::new(Mechanical::<_, 2, 1, 4, 10>::new(machine.clone(), rows))
        }),
    }
}

fn build<M: Machine>(
    machine: &M,
    file: &MoveFile,
    stage: impl FnOnce(Vec<PathRow>) -> Box<dyn Differentiable>,
) -> OptimalControlProblem {
    let limits = &file.limits;
    let (rows, path) = path_rows(machine, limits);
    let joint_rate = |row: &PathRow| matches!(row, PathRow::JointRate(_));
    let rates = (0..rows.len()).filter(|&i| joint_rate(&rows[i])).collect();
    let sizes = Sizes {
        states: M::AXES + 2 * M::COORDINATES,
        controls: M::AXES,
        path: rows.len(),
        endpoint: 0,
    };
    let at_rest = |pose: &[f64]| -> Vec<Bounds> {
        let zero = |count| std::iter::repeat_n(Bounds::fixed(0.0), count);
        zero(M::AXES)
            .chain(machine.rest(pose).into_iter().map(Bounds::fixed))
            .chain(zero(M::COORDINATES))
            .collect()
    };
    let shortest_s = rigid_duration_s(file).map_or(1e-6, |rigid_s| SHORTEST_SHARE * rigid_s);
    OptimalControlProblem {
        sizes,
        stage: stage(rows),
        endpoint: Box::new(Exact::new(Duration {
            states: sizes.states,
        })),
        states: states(machine, file),
        controls: (0..M::AXES)
            .map(|axis| {
                let bounds = Bounds::symmetric(limits.torque_rate_nm_per_s);
                Quantity::new(format!("torque rate of axis {} (N·m/s)", axis + 1), bounds)
            })
            .collect(),
        path,
        rates,
        ends: Vec::new(),
        initial: at_rest(&file.from),
        terminal: at_rest(&file.to),
        duration_s: Bounds::new(shortest_s, LONGEST_S),
    }
}

/// τ, q and v with their bounds; a limit on an output proportional to a coordinate is a bound on that coordinate.
pub(super) fn states<M: Machine>(machine: &M, file: &MoveFile) -> Vec<Quantity> {
    let limits = &file.limits;
    let coordinates = Machine::coordinates(machine);
    // The solver's tolerance is relative to these magnitudes: a tiny move needs small ones.
    let (from, to) = (machine.rest(&file.from), machine.rest(&file.to));
    let distance = (coordinates.iter().zip(from.iter().zip(&to)))
        .map(|(c, (a, b))| (b - a).abs() / c.magnitude)
        .fold(0.0, f64::max);
    let size = if distance < TINY { distance } else { 1.0 };
    let mut bounds = vec![Bounds::FREE; coordinates.len()];
    for (output, limit) in Machine::outputs(machine).iter().zip(&limits.outputs) {
        if let (OutputForm::Proportional { coordinate, gain }, Some(limit)) = (output.form, limit) {
            bounds[coordinate] =
                bounds[coordinate].intersect(Bounds::symmetric(limit / gain.abs()));
        }
    }
    let torques = (0..M::AXES).map(|axis| {
        let bounds = Bounds::symmetric(limits.torque_nm);
        Quantity::new(format!("torque of axis {} (N·m)", axis + 1), bounds)
    });
    let positions = coordinates.iter().zip(bounds).map(|(c, bounds)| Quantity {
        name: c.name.to_owned(),
        magnitude: Some(c.magnitude * size),
        bounds,
    });
    let rates = coordinates.iter().map(|c| Quantity {
        name: format!("rate of {}", c.name),
        magnitude: Some(c.rate_magnitude * size),
        bounds: Bounds::FREE,
    });
    torques.chain(positions).chain(rates).collect()
}

/// Path rows with their bounds.
pub(super) fn path_rows<M: Machine>(machine: &M, limits: &Limits) -> (Vec<PathRow>, Vec<Quantity>) {
    let ratio = Machine::reducer_ratio(machine);
    let (mut rows, mut path) = (Vec::new(), Vec::new());
    for (index, (output, limit)) in Machine::outputs(machine)
        .iter()
        .zip(&limits.outputs)
        .enumerate()
    {
        if let (OutputForm::General, Some(limit)) = (output.form, limit) {
            rows.push(PathRow::Output(index));
            path.push(Quantity::new(output.key, Bounds::symmetric(*limit)));
        }
    }
    for axis in 0..M::AXES {
        rows.push(PathRow::JointRate(axis));
        let bounds = Bounds::symmetric(limits.joint_speed_rad_per_s(ratio));
        path.push(Quantity::new(
            format!("joint speed of axis {} (rad/s)", axis + 1),
            bounds,
        ));
    }
    if limits.torque_falls_with_speed() {
        // |τ| + k(|θ̇| − n0) ≤ m_peak, as two bands of τ ± kθ̇.
        let slope = limits.slope_nm_s_per_rad(ratio);
        let band = Bounds::symmetric(limits.torque_nm + slope * limits.knee_rad_per_s(ratio));
        for axis in 0..M::AXES {
            for slope_nm_s_per_rad in [slope, -slope] {
                rows.push(PathRow::TorqueSpeed {
                    axis,
                    slope_nm_s_per_rad,
                });
                path.push(Quantity::new(
                    format!("torque–speed curve of axis {} (N·m)", axis + 1),
                    band,
                ));
            }
        }
    }
    (rows, path)
}
