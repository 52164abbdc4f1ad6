//! The optimal control problem of a robust move: several plants that follow one commanded joint motion.
//!
//! States (τ, q, v) of the nominal plant and (q_s, v_s) of every scenario; controls u = τ̇ and the commanded joint
//! accelerations α, which the nominal plant's torque pays for:
//!
//! ```text
//! (a, τ₀) of (q, v, α),   τ = τ₀        a_s of (q_s, v_s, α)
//! ```
//!
//! All plants start at rest with their joints at the same angles, so they keep them in common. A scenario's functions
//! depend on its own states and on α alone: the structure of the derivatives shows one block for each plant.

use super::problem::{move_problem, path_rows, states};
use crate::machine::Machine;
use crate::movefile::{MachineKind, MoveFile, Robust, Scenario};
use crate::ocp::{
    Bounds, Differentiable, Driven, OptimalControlProblem, Part, Parts, PathRow, Quantity,
    Solution, Squares,
};
use crate::simulate::modes::ModesError;
use crate::simulate::ringing::ringing;
use nalgebra::DMatrix;

/// The problem of a move that suits all plants of `robust`; its bounds on what is left are tight near a solution of it, if
/// one is given.
///
/// # Errors
/// [`ModesError`] where a plant is singular at the goal.
pub fn robust_problem(
    file: &MoveFile,
    robust: &Robust,
    near: Option<&Solution>,
) -> Result<OptimalControlProblem, ModesError> {
    let axes = file.machine.plant().axis_count();
    let n = file.machine.plant().coordinate_count();
    let mut problem = move_problem(file);
    let nominal_states = problem.sizes.states;
    let states = nominal_states + 2 * n * robust.scenarios.len();
    let commands = (0..axes).map(|axis| states + axes + axis);
    let layout = |first_state: usize| -> Vec<usize> {
        (first_state..first_state + 2 * n)
            .chain(commands.clone())
            .collect()
    };
    let mut linear: Vec<_> = (0..axes).map(|i| (i, states + i, 1.0)).collect();

    // The nominal plant, with its own path rows and the torque that the commanded motion asks for.
    let mut rows = nominal_rows(file);
    rows.extend((0..axes).map(torque));
    for axis in 0..axes {
        linear.push((states + problem.path.len(), axis, -1.0));
        problem.path.push(Quantity {
            name: format!("torque of the commanded motion of axis {} (N·m)", axis + 1),
            magnitude: Some(file.limits.torque_nm),
            bounds: Bounds::fixed(0.0),
        });
    }
    let path = states..states + problem.path.len();
    let mut parts = vec![Part {
        function: driven(&file.machine, rows),
        variables: layout(axes),
        rows: (axes..nominal_states).chain(path).collect(),
    }];

    let guards = problem.guards.len();
    let mut ends = Vec::new();
    for (index, scenario) in robust.scenarios.iter().enumerate() {
        let first = nominal_states + 2 * n * index;
        let own = scenario_rows(file, scenario);
        let path = states + problem.path.len()..states + problem.path.len() + own.rows.len();
        parts.push(Part {
            function: driven(&scenario.machine, own.rows),
            variables: layout(first),
            rows: (first..first + 2 * n).chain(path).collect(),
        });
        if scenario.limited {
            let first = problem.path.len();
            problem.guards.extend(first..first + guards);
        }
        problem.path.extend(own.path);
        problem.states.extend(own.states);
        problem.terminal.extend(vec![Bounds::FREE; 2 * n]);
        let start = problem.initial[axes..nominal_states].to_vec();
        problem.initial.extend(start);

        let plant = scenario.machine.plant();
        let end = near.map(|solution| {
            let last = solution.states.ncols() - 1;
            let own = solution.states.column(last);
            own.rows(first, 2 * n).iter().copied().collect::<Vec<f64>>()
        });
        let left = ringing(plant, &file.to, &robust.residuals)?;
        let rows = 1 + problem.ends.len()..1 + problem.ends.len() + left.len();
        problem.ends.extend(left.iter().map(|left| Quantity {
            name: format!("{} left with {}", left.name, scenario.name),
            magnitude: Some(left.bound_of_squares()),
            bounds: Bounds::new(f64::NEG_INFINITY, left.bound_of_squares()),
        }));
        let squares = left.iter().map(|left| left.sum_of_squares(end.as_deref()));
        let squares = squares.collect();
        ends.push(Part {
            function: Box::new(Squares::new(squares, 2 * n)),
            variables: (states + first..states + first + 2 * n).collect(),
            rows: rows.collect(),
        });
    }
    let accelerations = (1..=axes)
        .map(|axis| format!("commanded acceleration of axis {axis} (rad/s²)"))
        .map(|name| Quantity {
            name,
            magnitude: largest_acceleration(file),
            bounds: Bounds::FREE,
        });
    problem.controls.extend(accelerations);
    problem.sizes.states = states;
    problem.sizes.controls = 2 * axes;
    problem.sizes.path = problem.path.len();
    problem.sizes.endpoint = problem.ends.len();
    problem.stage = Box::new(Parts::new(parts, linear));
    problem.endpoint = Box::new(Parts::new(ends, vec![(0, 2 * states, 1.0)]));
    Ok(problem)
}

/// A path row that is a torque.
fn torque(axis: usize) -> PathRow {
    PathRow::TorqueSpeed {
        axis,
        slope_nm_s_per_rad: 0.0,
    }
}

fn driven(machine: &MachineKind, rows: Vec<PathRow>) -> Box<dyn Differentiable> {
    match machine {
        MachineKind::ThreeRrr(machine) => {
            Box::new(Driven::<_, 6, 3, 12, 78>::new(machine.clone(), rows))
        }
        MachineKind::TwoMassAxis(machine) => {
            Box::new(Driven::<_, 2, 1, 4, 10>::new(machine.clone(), rows))
        }
    }
}

fn nominal_rows(file: &MoveFile) -> Vec<PathRow> {
    match &file.machine {
        MachineKind::ThreeRrr(machine) => path_rows(machine, file).0,
        MachineKind::TwoMassAxis(machine) => path_rows(machine, file).0,
    }
}

/// States and path rows of a scenario.
struct Rows {
    states: Vec<Quantity>,
    rows: Vec<PathRow>,
    path: Vec<Quantity>,
}

fn scenario_rows(file: &MoveFile, scenario: &Scenario) -> Rows {
    match &scenario.machine {
        MachineKind::ThreeRrr(machine) => rows_of(machine, file, scenario),
        MachineKind::TwoMassAxis(machine) => rows_of(machine, file, scenario),
    }
}

fn rows_of<M: Machine>(machine: &M, file: &MoveFile, scenario: &Scenario) -> Rows {
    let mut states = states(machine, file).split_off(M::AXES);
    let (mut rows, mut path) = (Vec::new(), Vec::new());
    if scenario.limited {
        let limits = path_rows(machine, file);
        // Its joints move as the nominal plant's do.
        let own = |row: &PathRow| !matches!(row, PathRow::JointRate(_));
        let pairs = limits.0.into_iter().zip(limits.1);
        (rows, path) = pairs.filter(|(row, _)| own(row)).unzip();
        for axis in 0..M::AXES {
            rows.push(torque(axis));
            path.push(Quantity::new(
                format!("torque of axis {} (N·m)", axis + 1),
                Bounds::symmetric(file.limits.torque_nm),
            ));
        }
    } else {
        for state in &mut states {
            state.bounds = Bounds::FREE;
        }
    }
    for quantity in states.iter_mut().chain(&mut path) {
        quantity.name = format!("{} with {}", quantity.name, scenario.name);
    }
    Rows { states, rows, path }
}

/// A solution for the nominal plant as one for all, which move as it does; commanded accelerations zero.
pub(super) fn with_every_plant(file: &MoveFile, robust: &Robust, nominal: &Solution) -> Solution {
    let axes = file.machine.plant().axis_count();
    let (states, points) = nominal.states.shape();
    let own = states - axes;
    let count = robust.scenarios.len();
    Solution {
        states: DMatrix::from_fn(states + count * own, points, |row, column| {
            let row = if row < states {
                row
            } else {
                axes + (row - states) % own
            };
            nominal.states[(row, column)]
        }),
        controls: nominal.controls.clone().insert_rows(axes, axes, 0.0),
        ..nominal.clone()
    }
}

/// What the largest torque accelerates a joint by at the start of the move, rad/s²: how large commands are.
fn largest_acceleration(file: &MoveFile) -> Option<f64> {
    let plant = file.machine.plant();
    let (axes, n) = (plant.axis_count(), plant.coordinate_count());
    let accelerations = (0..axes).filter_map(|axis| {
        let mut torque_nm = vec![0.0; axes];
        torque_nm[axis] = file.limits.torque_nm;
        let forward = plant.forward(&plant.rest(&file.from), &vec![0.0; n], &torque_nm)?;
        Some((forward.joint_jacobian * forward.accelerations)[axis])
    });
    accelerations.reduce(f64::max)
}

/// The nominal plant's part of a robust solution.
#[must_use]
pub fn nominal_part(file: &MoveFile, solution: &Solution) -> Solution {
    let plant = file.machine.plant();
    let (axes, n) = (plant.axis_count(), plant.coordinate_count());
    Solution {
        states: solution.states.rows(0, axes + 2 * n).into_owned(),
        controls: solution.controls.rows(0, axes).into_owned(),
        ..solution.clone()
    }
}
