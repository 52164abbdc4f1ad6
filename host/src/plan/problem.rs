//! The optimal control problem of a move: the fastest way from rest to rest within every limit.
//!
//! State (τ, q, v), control u = τ̇ (eqs. 6–8 of the paper); the cost is the duration. At both ends the machine stands
//! undeformed and without torque, so nothing accelerates and nothing rings afterwards.

use super::guess::rigid_duration_s;
use crate::autodiff::Scalar;
use crate::machine::{Machine, OutputForm};
use crate::movefile::{MachineKind, MoveFile};
use crate::ocp::{
    Bounds, Differentiable, Exact, Mechanical, Model, OptimalControlProblem, PathRow, Quantity,
    Sizes,
};

/// Shortest duration the planner considers, as share of that of the rigid quintic: an axis limited in speed alone takes 1/1.875
/// of it, with a limited torque or torque rate more. Without it some solves fall into a duration of zero and stay there.
pub(super) const SHORTEST_SHARE: f64 = 0.2;

/// Longest duration the planner considers, s.
pub(super) const LONGEST_S: f64 = 1e3;

/// Share of what the straight line between the poses keeps, at this many places, that is not asked for more than.
const OF_LINE: f64 = 0.9;
const PLACES: usize = 64;

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
    let (rows, path) = path_rows(machine, file);
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
        // Regularities come first.
        guards: (0..M::REGULARITIES.len()).collect(),
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

/// What keeps a motion on the side of singular poses where it begins. Near one, joints or elastic displacements have a pole, and
/// polynomials step over it between two points: such a move is fast, and none that a machine can make.
fn regular<M: Machine>(machine: &M, file: &MoveFile) -> Vec<Quantity> {
    let at = |share: f64| {
        let ends = file.from.iter().zip(&file.to);
        let pose: Vec<f64> = ends.map(|(a, b)| a + share * (b - a)).collect();
        let mut values = vec![0.0; M::REGULARITIES.len()];
        machine.regularities(&machine.rest(&pose), &mut values);
        values
    };
    let (from, to) = (at(0.0), at(1.0));
    let line: Vec<Vec<f64>> = (1..PLACES).map(|k| at(k as f64 / PLACES as f64)).collect();
    let bounds = |i: usize| {
        let side = from[i].signum();
        let of_ends = file.solver.clearance * (side * from[i]).min(side * to[i]);
        // The straight line keeps what it can, if it stays on its side.
        let of_line = line
            .iter()
            .fold(f64::INFINITY, |least, v| least.min(side * v[i]));
        let least = if of_line > 0.0 {
            of_ends.min(OF_LINE * of_line)
        } else {
            of_ends
        };
        if side > 0.0 {
            Bounds::new(least, f64::INFINITY)
        } else {
            Bounds::new(f64::NEG_INFINITY, -least)
        }
    };
    let names = M::REGULARITIES.iter().enumerate();
    names
        .map(|(i, name)| Quantity::new(*name, bounds(i)))
        .collect()
}

/// Path rows with their bounds.
pub(super) fn path_rows<M: Machine>(machine: &M, file: &MoveFile) -> (Vec<PathRow>, Vec<Quantity>) {
    let limits = &file.limits;
    let ratio = Machine::reducer_ratio(machine);
    let outputs = Machine::outputs(machine);
    let (mut rows, mut path) = (Vec::new(), Vec::new());
    for (index, quantity) in regular(machine, file).into_iter().enumerate() {
        rows.push(PathRow::Output(outputs.len() + index));
        path.push(quantity);
    }
    for (index, (output, limit)) in outputs.iter().zip(&limits.outputs).enumerate() {
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
