//! Solves a benchmark and measures the answer.

use super::Benchmark;
use crate::nlp::{NlpSolver, Settings, Status};
use crate::ocp::{
    Answer, BangBang, Mesh, MeshRecord, RefineEnd, RefineSettings, Solution, bang_bang, refine,
};
use crate::plan::end_miss;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How a benchmark is solved.
#[derive(Clone, Debug, PartialEq)]
pub enum Approach {
    /// From a coarse mesh, refined to a relative tolerance, and with free arcs where the answer is bang-bang. Nothing is told
    /// about the answer.
    Automatic {
        /// The tolerance.
        tolerance: f64,
    },
    /// Once, on this mesh: to compare with others at equal points.
    Fixed(Mesh),
}

/// The mesh that the automatic approach starts with: intervals, points.
const FIRST_MESH: (usize, usize) = (10, 4);
/// Tolerance of the solver.
const SOLVER_TOLERANCE: f64 = 1e-9;
const MAX_ITERATIONS: usize = 1000;
const MAX_MESHES: usize = 40;
const MAX_INTERVALS: usize = 500;
const MAX_POINTS: usize = 5000;

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Value of the objective.
    pub objective: f64,
    /// The polynomials.
    pub solution: Solution,
    /// The arcs, if the answer is bang-bang.
    pub arcs: Option<BangBang>,
    /// The meshes.
    pub log: Vec<MeshRecord>,
    /// Largest miss of a state at the end when the dynamics are integrated under the answer's control, relative to what the
    /// state moves; none if they cannot be integrated.
    pub miss: Option<f64>,
    /// Variables of the last nonlinear program.
    pub variables: usize,
    /// Iterations of the solver, over all meshes.
    pub iterations: usize,
    /// Time taken, without the integration.
    pub time: Duration,
}

/// Why a benchmark has no value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The solver did not converge.
    #[error("{name}: the solver ended as {status} on mesh {mesh}")]
    Unsolved {
        /// The benchmark.
        name: &'static str,
        /// How the solver ended.
        status: Status,
        /// Number of the mesh, from 1.
        mesh: usize,
    },
    /// Refinement ended before its tolerance.
    #[error(
        "{name}: the tolerance of {tolerance:e} is not reached with {meshes} meshes, the last of {points} points (error {error:.1e})"
    )]
    Tolerance {
        /// The benchmark.
        name: &'static str,
        /// What was asked for.
        tolerance: f64,
        /// Meshes solved.
        meshes: usize,
        /// Points of the last one.
        points: usize,
        /// Its error.
        error: f64,
    },
}

/// Runs a benchmark.
///
/// # Errors
/// [`RunError`].
pub fn run(
    benchmark: Benchmark,
    approach: &Approach,
    solver: &dyn NlpSolver,
) -> Result<Measured, RunError> {
    let started = Instant::now();
    let name = benchmark.name;
    let problem = Arc::new(benchmark.problem);
    let (mesh, tolerance) = match approach {
        Approach::Automatic { tolerance } => {
            (Mesh::uniform(FIRST_MESH.0, FIRST_MESH.1), Some(*tolerance))
        }
        Approach::Fixed(mesh) => (mesh.clone(), None),
    };
    let settings = RefineSettings {
        tolerance: tolerance.unwrap_or(f64::INFINITY),
        max_intervals: MAX_INTERVALS,
        max_points: MAX_POINTS,
        max_meshes: MAX_MESHES,
        solver: Settings {
            tolerance: SOLVER_TOLERANCE,
            max_iterations: MAX_ITERATIONS,
            least_barrier: 0.0,
        },
    };
    let mut arcs = None;
    let watch = |answer: &Answer, _: &MeshRecord| {
        if tolerance.is_none() {
            return ControlFlow::Break(());
        }
        arcs = bang_bang(&problem, answer, solver, MAX_ITERATIONS);
        match arcs {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    };
    let refined = refine(&problem, mesh, &benchmark.guess, solver, &settings, watch);
    let time = started.elapsed();
    match refined.end {
        RefineEnd::Met | RefineEnd::Stopped => {}
        RefineEnd::Unsolved(status) => {
            return Err(RunError::Unsolved {
                name,
                status,
                mesh: refined.log.len() + 1,
            });
        }
        RefineEnd::Capacity { .. } | RefineEnd::Meshes => {
            return Err(RunError::Tolerance {
                name,
                tolerance: settings.tolerance,
                meshes: refined.log.len(),
                points: refined.answer.solution.mesh.points(),
                error: refined.log.last().map_or(f64::NAN, |mesh| mesh.error),
            });
        }
    }
    let of_meshes: usize = refined.log.iter().map(|mesh| mesh.iterations).sum();
    let (solution, objective, variables, iterations) = match &arcs {
        Some(found) => (
            found.solution.clone(),
            found.objective,
            found.variables,
            of_meshes + found.iterations,
        ),
        None => (
            refined.answer.solution,
            refined.answer.objective,
            refined.answer.variables,
            of_meshes,
        ),
    };
    let miss = end_miss(&problem, &solution).ok();
    Ok(Measured {
        objective,
        miss: miss.map(|miss| {
            let states = miss.states.iter();
            states.fold(0.0, |m, state| state.relative().max(m))
        }),
        solution,
        arcs,
        log: refined.log,
        variables,
        iterations,
        time,
    })
}
