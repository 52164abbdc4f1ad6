//! Adaptive refinement of the mesh: solve, estimate, divide or add points, solve again from the last answer.
//!
//! The estimate says how well the dynamics hold, not how far the objective is from its optimum. So a mesh is accepted when the
//! dynamics are met to the tolerance and the objective has moved by no more than the tolerance since the mesh before; until
//! then the controls are resolved better.

mod estimate;
mod join;
mod next;

use super::answer::Answer;
use super::{Guess, Mesh, OptimalControlProblem, Solution};
use crate::nlp::{NlpSolver, Settings, Status};
use estimate::errors;
use next::{Reason, next};
use std::ops::ControlFlow;
use std::sync::Arc;

/// How far to refine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineSettings {
    /// Relative error of dynamics and objective that is asked for.
    pub tolerance: f64,
    /// Most intervals.
    pub max_intervals: usize,
    /// Most collocation points in all.
    pub max_points: usize,
    /// Most meshes, the first one included.
    pub max_meshes: usize,
    /// Of the solver, for every mesh.
    pub solver: Settings,
}

/// One line of the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshRecord {
    /// Intervals.
    pub intervals: usize,
    /// Collocation points in all.
    pub points: usize,
    /// Value of the objective.
    pub objective: f64,
    /// Largest relative error of the dynamics.
    pub error: f64,
    /// Relative change of the objective since the mesh before.
    pub change: Option<f64>,
    /// Iterations of the solver.
    pub iterations: usize,
}

/// How a refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RefineEnd {
    /// The tolerance is met.
    Met,
    /// Whoever watched had seen enough.
    Stopped,
    /// The next mesh would have this many intervals and points, more than allowed.
    Capacity {
        /// Intervals of the next mesh.
        intervals: usize,
        /// Points of the next mesh.
        points: usize,
    },
    /// The meshes are used up.
    Meshes,
    /// The solver did not converge on a mesh.
    Unsolved(Status),
}

/// What is known of a solution on its mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Largest relative error of the dynamics.
    pub error: f64,
    /// Relative change of the objective since the mesh before.
    pub change: Option<f64>,
    /// The mesh to solve on next; `None` where the tolerance is met.
    pub finer: Option<Mesh>,
}

/// Judges a solution by its estimate and by the objective on the mesh before.
#[must_use]
pub fn judge(
    problem: &OptimalControlProblem,
    solution: &Solution,
    objective: f64,
    before: Option<f64>,
    tolerance: f64,
) -> Judgement {
    let errors = errors(problem, solution);
    let error = errors
        .iter()
        .fold(0.0_f64, |m, error| m.max(error.dynamics));
    let change = before.map(|before| {
        let size = objective.abs().max(before.abs());
        (objective - before).abs() / size.max(f64::MIN_POSITIVE)
    });
    let reason = if error > tolerance {
        Some(Reason::Dynamics)
    } else if change.is_none_or(|change| change > tolerance) {
        Some(Reason::Objective)
    } else {
        None
    };
    let finer = reason.and_then(|reason| next(solution, &errors, tolerance, reason));
    Judgement {
        error,
        change,
        finer,
    }
}

/// What a refinement came to.
#[derive(Clone, Debug)]
pub struct Refined {
    /// On the last mesh that was solved; if none was, where the solver ended on the first.
    pub answer: Answer,
    /// All meshes that were solved.
    pub log: Vec<MeshRecord>,
    /// Why there are no more.
    pub end: RefineEnd,
}

/// Solves on finer and finer meshes until the tolerance is met; `watch` sees every answer and may end it.
pub fn refine(
    problem: &Arc<OptimalControlProblem>,
    mesh: Mesh,
    guess: &Guess,
    solver: &dyn NlpSolver,
    settings: &RefineSettings,
    mut watch: impl FnMut(&Answer, &MeshRecord) -> ControlFlow<()>,
) -> Refined {
    let solve = |mesh, guess: &Guess| {
        Answer::of(
            problem,
            mesh,
            guess,
            solver,
            &settings.solver,
            Box::new(|_| true),
        )
    };
    let mut answer = solve(mesh, guess);
    let mut log: Vec<MeshRecord> = Vec::new();
    let end = loop {
        if !matches!(answer.status, Status::Solved) {
            break RefineEnd::Unsolved(answer.status);
        }
        let mesh = &answer.solution.mesh;
        let before = log.last().map(|last| last.objective);
        let Judgement {
            error,
            change,
            finer,
        } = judge(
            problem,
            &answer.solution,
            answer.objective,
            before,
            settings.tolerance,
        );
        let record = MeshRecord {
            intervals: mesh.intervals().len(),
            points: mesh.points(),
            objective: answer.objective,
            error,
            change,
            iterations: answer.iterations,
        };
        log.push(record);
        if watch(&answer, &record).is_break() {
            break RefineEnd::Stopped;
        }
        let Some(finer) = finer else {
            break RefineEnd::Met;
        };
        let (intervals, points) = (finer.intervals().len(), finer.points());
        if intervals > settings.max_intervals || points > settings.max_points {
            break RefineEnd::Capacity { intervals, points };
        }
        if log.len() >= settings.max_meshes {
            break RefineEnd::Meshes;
        }
        let guess = Guess::from_solution(answer.solution.clone());
        let finer = solve(finer, &guess);
        if finer.status != Status::Solved {
            break RefineEnd::Unsolved(finer.status);
        }
        answer = finer;
    };
    Refined { answer, log, end }
}
