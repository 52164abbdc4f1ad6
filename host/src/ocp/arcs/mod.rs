//! Bang-bang answers: controls at their bounds on arcs, whose boundaries are unknowns.
//!
//! On a fixed mesh a switch falls inside an interval, where a polynomial has to stand for a jump: the objective converges
//! only as fast as intervals around switches shrink. Here the arcs are read off an answer, the controls are fixed on them, the
//! durations are freed ([`lift`]), and what comes out is believed only if it satisfies Pontryagin's conditions ([`check`]).

mod check;
mod detect;
mod lift;

pub use check::Optimality;
pub use detect::{BangArc, Side};

use super::answer::Answer;
use super::{
    Bounds, Guess, Interval, Mesh, OptimalControlProblem, Quantity, RefineEnd, RefineSettings,
    Sizes, Solution, refine,
};
use crate::nlp::{NlpSolver, Settings};
use check::check;
use lift::{LiftedEnds, LiftedStage};
use nalgebra::DMatrix;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Points of the first mesh on every arc, and relative error of the dynamics that is aimed at.
const POINTS: usize = 10;
const TOLERANCE: f64 = 1e-10;
/// Tolerance of the solver.
const SOLVER_TOLERANCE: f64 = 1e-11;
/// Pontryagin's conditions hold to this.
const OPTIMALITY: f64 = 1e-6;
/// Arcs shorter than this share of the motion are none.
const SHORTEST: f64 = 1e-6;
/// More arcs than these are chatter, not structure.
const MOST_ARCS: usize = 24;

/// An answer with free arcs.
#[derive(Clone, Debug)]
pub struct BangBang {
    /// The arcs in the order of time.
    pub arcs: Vec<BangArc>,
    /// The polynomials, on a mesh whose intervals do not cross a switch.
    pub solution: Solution,
    /// Value of the objective.
    pub objective: f64,
    /// How well Pontryagin's conditions hold.
    pub optimality: Optimality,
    /// Relative error of the dynamics.
    pub error: f64,
    /// Variables of the last nonlinear program.
    pub variables: usize,
    /// Iterations of the solver in all.
    pub iterations: usize,
}

/// Looks for a bang-bang answer near `answer`; `None` if there is none that satisfies the conditions of optimality.
#[must_use]
pub fn bang_bang(
    problem: &Arc<OptimalControlProblem>,
    answer: &Answer,
    solver: &dyn NlpSolver,
    max_iterations: usize,
) -> Option<BangBang> {
    if !detect::affine(problem) {
        return None;
    }
    let mut arcs = detect::arcs(problem, answer)?;
    let mut iterations = 0;
    let mut near = answer.solution.clone();
    // Every round has fewer arcs.
    loop {
        if arcs.len() > MOST_ARCS {
            return None;
        }
        let lifted = Arc::new(lifted(problem, &arcs, &near));
        let guess = guess(&arcs, &near);
        let settings = RefineSettings {
            tolerance: TOLERANCE,
            max_intervals: 16,
            max_points: 200,
            max_meshes: 8,
            solver: Settings {
                tolerance: SOLVER_TOLERANCE,
                max_iterations,
                least_barrier: 0.0,
            },
        };
        let mesh = Mesh::uniform(1, POINTS);
        let refined = refine(&lifted, mesh, &guess, solver, &settings, |_, _| {
            ControlFlow::Continue(())
        });
        iterations += refined
            .log
            .iter()
            .map(|mesh| mesh.iterations)
            .sum::<usize>();
        if refined.end != RefineEnd::Met {
            return None;
        }
        let found = refined.answer.solution.states.column(0);
        let first = arcs.len() * problem.sizes.states;
        for (spec, duration_s) in arcs.iter_mut().zip(found.iter().skip(first)) {
            spec.duration_s = *duration_s;
        }
        let total: f64 = arcs.iter().map(|arc| arc.duration_s).sum();
        let solution = joined(problem, &arcs, &refined.answer.solution);
        let before = arcs.len();
        let kept = merged(arcs.clone(), SHORTEST * total);
        if kept.len() < before {
            arcs = kept;
            near = solution;
            continue;
        }
        let optimality = check(problem, &arcs, &refined.answer);
        return optimality.within(OPTIMALITY).then(|| BangBang {
            arcs,
            solution,
            objective: refined.answer.objective,
            optimality,
            error: refined.log.last().map_or(f64::NAN, |mesh| mesh.error),
            variables: refined.answer.variables,
            iterations,
        });
    }
}

/// Drops arcs shorter than `shortest_s`, and joins neighbours that are alike.
fn merged(arcs: Vec<BangArc>, shortest_s: f64) -> Vec<BangArc> {
    let mut kept: Vec<BangArc> = Vec::with_capacity(arcs.len());
    for arc in arcs.into_iter().filter(|arc| arc.duration_s > shortest_s) {
        match kept.last_mut() {
            Some(last) if last.sides == arc.sides => last.duration_s += arc.duration_s,
            _ => kept.push(arc),
        }
    }
    kept
}

/// The problem with free arcs; magnitudes come from a solution.
fn lifted(
    problem: &Arc<OptimalControlProblem>,
    arcs: &[BangArc],
    near: &Solution,
) -> OptimalControlProblem {
    let (sizes, count) = (problem.sizes, arcs.len());
    let controls = arcs.iter().map(|arc| arc.controls(problem)).collect();
    let magnitudes: Vec<f64> = (near.states.row_iter())
        .map(|row| row.max() - row.min())
        .map(|range| if range > 0.0 { range } else { 1.0 })
        .collect();
    let known = |quantity: &Quantity, magnitude: f64, arc: usize| Quantity {
        name: format!("{}, arc {}", quantity.name, arc + 1),
        magnitude: Some(magnitude),
        bounds: quantity.bounds,
    };
    let of_time = |name: String, bounds: Bounds| Quantity {
        name,
        magnitude: Some(near.duration_s),
        bounds,
    };
    let mut states = Vec::new();
    let mut path = Vec::new();
    for arc in 0..count {
        let own = problem.states.iter().zip(&magnitudes);
        states.extend(own.map(|(state, magnitude)| known(state, *magnitude, arc)));
        path.extend(problem.path.iter().map(|row| Quantity {
            magnitude: row.magnitude,
            ..known(row, 1.0, arc)
        }));
    }
    let positive = Bounds::new(0.0, f64::INFINITY);
    states.extend((1..=count).map(|arc| of_time(format!("duration of arc {arc}"), positive)));
    let mut ends = problem.ends.clone();
    for joint in 1..count {
        let own = problem.states.iter().zip(&magnitudes);
        ends.extend(own.map(|(state, magnitude)| Quantity {
            bounds: Bounds::fixed(0.0),
            ..known(state, *magnitude, joint)
        }));
    }
    ends.push(of_time("duration".into(), problem.duration_s));
    let free = vec![Bounds::FREE; (count - 1) * sizes.states];
    let durations = vec![Bounds::FREE; count];
    OptimalControlProblem {
        sizes: Sizes {
            states: states.len(),
            controls: 0,
            path: path.len(),
            endpoint: ends.len(),
        },
        stage: Box::new(LiftedStage::new(Arc::clone(problem), controls)),
        endpoint: Box::new(LiftedEnds::new(Arc::clone(problem), count)),
        states,
        controls: vec![],
        path,
        rates: (0..count)
            .flat_map(|arc| {
                problem
                    .rates
                    .iter()
                    .map(move |rate| arc * sizes.path + rate)
            })
            .collect(),
        guards: vec![],
        ends,
        initial: [problem.initial.as_slice(), &free, &durations].concat(),
        terminal: [&free, problem.terminal.as_slice(), &durations].concat(),
        duration_s: Bounds::fixed(1.0),
    }
}

fn guess(arcs: &[BangArc], near: &Solution) -> Guess {
    let near = near.clone();
    let durations: Vec<f64> = arcs.iter().map(|arc| arc.duration_s).collect();
    Guess::new(1.0, move |s| {
        let (mut states, mut start_s) = (Vec::new(), 0.0);
        for duration_s in &durations {
            states.extend(near.state_at_share((start_s + s * duration_s) / near.duration_s));
            start_s += duration_s;
        }
        states.extend(&durations);
        (states, vec![])
    })
}

/// The arcs one after the other as an ordinary solution.
fn joined(problem: &OptimalControlProblem, arcs: &[BangArc], lifted: &Solution) -> Solution {
    let n = problem.sizes.states;
    let points = lifted.mesh.points();
    let total: f64 = arcs.iter().map(|arc| arc.duration_s).sum();
    let mut intervals = Vec::new();
    let mut rules = Vec::new();
    let mut states = DMatrix::zeros(n, points * arcs.len() + 1);
    let mut controls = DMatrix::zeros(problem.sizes.controls, points * arcs.len());
    // An arc that vanishes still needs a positive share of the mesh.
    let shortest_s = total * f64::EPSILON;
    for (arc, spec) in arcs.iter().enumerate() {
        intervals.extend(lifted.mesh.intervals().iter().map(|interval| Interval {
            fraction: interval.fraction * spec.duration_s.max(shortest_s) / total,
            points: interval.points,
        }));
        rules.extend(lifted.rules.iter().cloned());
        let last = usize::from(arc + 1 == arcs.len());
        let own = lifted.states.view((arc * n, 0), (n, points + last));
        states
            .view_mut((0, arc * points), (n, points + last))
            .copy_from(&own);
        let values = spec.controls(problem);
        for mut column in controls.columns_mut(arc * points, points).column_iter_mut() {
            column.copy_from_slice(&values);
        }
    }
    Solution {
        duration_s: total,
        mesh: Mesh::new(intervals),
        rules,
        states,
        controls,
    }
}

#[cfg(test)]
mod tests;
