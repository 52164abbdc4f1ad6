//! Planning a move: problem, first guess, solve, check, trajectory.

mod check;
mod diagnosis;
mod guess;
mod problem;
mod trajectory;

pub use check::{EndMiss, LargestViolation, end_miss, largest_violation};
pub use diagnosis::{Diagnosis, Saturation, Violation};
pub use guess::{quintic_guess, rigid_duration_s};
pub use problem::move_problem;
pub use trajectory::{ConversionError, trajectory};

use crate::movefile::MoveFile;
use crate::nlp::{Iteration, NlpSolver, Settings, Status};
use crate::ocp::{CollocationNlp, Mesh, OptimalControlProblem, Solution, Transcription};
use crate::simulate::ode::OdeError;
use std::sync::Arc;
use std::time::{Duration, Instant};
use stillpoint_shared::Trajectory;

/// How much longer than the rigid estimate the first guess is: solving from a slow move is quicker and surer than from
/// one that no machine could do.
const GUESS_SLOWNESS: f64 = 2.0;

/// Guessed duration, s, when the straight line between the poses gives no estimate.
const GUESS_WITHOUT_ESTIMATE_S: f64 = 0.5;

/// A planned and checked move.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The polynomials.
    pub solution: Solution,
    /// What the board plays.
    pub trajectory: Trajectory,
    /// Solver and its effort.
    pub effort: Effort,
    /// Where the machine ends when the dynamics are integrated under the planned control.
    pub end_miss: EndMiss,
    /// The limit exceeded most between the points.
    pub largest_violation: Option<LargestViolation>,
}

/// What a plan cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Name of the solver.
    pub solver: &'static str,
    /// How it ended.
    pub status: Status,
    /// Iterations.
    pub iterations: usize,
    /// Variables of the nonlinear program.
    pub variables: usize,
    /// Constraints.
    pub constraints: usize,
    /// Time to build the problem.
    pub setup: Duration,
    /// Time to solve it.
    pub solve: Duration,
    /// Time to check the answer.
    pub check: Duration,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The solver did not converge.
    #[error("no plan: {0}")]
    Unsolved(Box<Diagnosis>, Box<Effort>),
    /// The answer does not hold when the dynamics are integrated.
    #[error("the plan does not hold: {0}")]
    Check(#[from] OdeError),
    /// The answer does not fit the board.
    #[error(transparent)]
    Conversion(#[from] ConversionError),
}

/// Sees an iteration and the duration (s) that the move has there; `false` ends the solve.
pub type Progress = Box<dyn FnMut(&Iteration, f64) -> bool>;

/// Plans the fastest move of a file, with limits at the LGR points.
///
/// # Errors
/// [`PlanError`].
pub fn plan(
    file: &MoveFile,
    solver: &dyn NlpSolver,
    mut progress: Progress,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    let problem: Arc<OptimalControlProblem> = Arc::new(move_problem(file));
    let duration_s =
        rigid_duration_s(file).map_or(GUESS_WITHOUT_ESTIMATE_S, |s| s * GUESS_SLOWNESS);
    let guess = quintic_guess(file, duration_s);
    let mesh = Mesh::uniform(file.mesh.intervals, file.mesh.points);
    let transcription = Arc::new(Transcription::new(Arc::clone(&problem), mesh, &guess));
    let start = transcription.unknowns(&guess);
    let nlp = CollocationNlp::new(Arc::clone(&transcription), start, None);
    let setup = started.elapsed();

    let started = Instant::now();
    let settings = Settings {
        tolerance: file.solver.tolerance,
        max_iterations: file.solver.max_iterations,
    };
    let seconds_per_objective = transcription.scaling().objective;
    let monitor = Box::new(move |iteration: &Iteration| {
        progress(iteration, iteration.objective * seconds_per_objective)
    });
    let outcome = solver.solve(Box::new(nlp.clone()), &settings, monitor);
    let mut effort = Effort {
        solver: solver.name(),
        status: outcome.status,
        iterations: outcome.iterations,
        variables: transcription.variables(),
        constraints: transcription.constraints(),
        setup,
        solve: started.elapsed(),
        check: Duration::ZERO,
    };
    if outcome.status != Status::Solved {
        let diagnosis = Diagnosis::of(&transcription, &nlp, &outcome);
        return Err(PlanError::Unsolved(Box::new(diagnosis), Box::new(effort)));
    }

    let started = Instant::now();
    let solution = transcription.solution(&outcome.x);
    let end_miss = end_miss(&problem, &solution)?;
    let largest_violation = largest_violation(&problem, &solution);
    let trajectory = trajectory(file.machine.plant(), &file.limits, &solution, 1)?;
    effort.check = started.elapsed();
    Ok(Plan {
        solution,
        trajectory,
        effort,
        end_miss,
        largest_violation,
    })
}
