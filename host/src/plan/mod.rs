//! Planning a move: problem, first guess, solve, check, trajectory.

mod attempt;
mod check;
mod diagnosis;
mod guess;
mod problem;
mod trajectory;

use attempt::{Attempt, Solved, imposed};
pub use check::{EndMiss, LargestViolation, StateMiss, end_miss, largest_violation};
pub use diagnosis::{Diagnosis, Saturation, Violation};
pub use guess::{quintic_guess, rigid_duration_s};
pub use problem::move_problem;
pub use trajectory::{ConversionError, trajectory};

use crate::certify::{CertifyError, Coordinates, certify};
use crate::movefile::MoveFile;
use crate::nlp::{Iteration, NlpSolver, Status};
use crate::ocp::Solution;
use crate::simulate::ode::OdeError;
use crate::sptfile::Section;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};
use stillpoint_shared::Trajectory;

/// How much longer than the rigid estimate the first guesses are, one after the other until one leads to an answer:
/// solving from a slow move is quicker and surer than from one that no machine could do.
const GUESS_SLOWNESS: [f64; 4] = [2.0, 4.0, 1.3, 8.0];

/// Iterations that a first guess is given before the next one is tried; the last one may use up all that are left.
const ITERATIONS_PER_GUESS: usize = 150;

/// Guessed duration, s, when the straight line between the poses gives no estimate.
const GUESS_WITHOUT_ESTIMATE_S: f64 = 0.25;

/// Share of its range by which a coordinate may miss its end before the user is warned, and before the plan is refused.
const DOUBTFUL_MISS: f64 = 0.01;
const REFUSED_MISS: f64 = 0.5;

/// A planned and checked move.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The polynomials.
    pub solution: Solution,
    /// What the board plays.
    pub trajectory: Trajectory,
    /// What is stored beside it: the machine's coordinates, and what is proved.
    pub section: Section,
    /// Solver and its effort.
    pub effort: Effort,
    /// Where the machine ends when the dynamics are integrated under the planned control.
    pub end_miss: EndMiss,
    /// The limit exceeded most between the points.
    pub largest_violation: Option<LargestViolation>,
}

impl Plan {
    /// What a user has to know before trusting the plan.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let worst = self
            .end_miss
            .worst()
            .filter(|worst| worst.relative() > DOUBTFUL_MISS)?;
        Some(format!(
            "integrated under the planned control, {} misses its end by {:.3e}, {:.1} % of what it moves: the mesh is too coarse \
             ([mesh] intervals, points)",
            worst.name,
            worst.miss,
            worst.relative() * 100.0
        ))
    }
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
    /// Programs solved: one for every first guess, and with limits everywhere one for every set of places.
    pub rounds: usize,
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
    /// The machine cannot follow the planned control to the end.
    #[error("the plan does not hold: {source}. Try a finer mesh ([mesh] intervals, points)")]
    Check {
        /// Where the integration ended.
        source: OdeError,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The machine ends somewhere else under the planned control.
    #[error(
        "the plan does not hold: integrated under the planned control, {name} misses its end by {miss:.3e}, {share:.0} % of \
         what it moves. Try a finer mesh ([mesh] intervals, points), or for a tiny move a smaller [solver] tolerance"
    )]
    Missed {
        /// The coordinate that misses most.
        name: String,
        /// By how much, in its unit.
        miss: f64,
        /// In per cent of its range.
        share: f64,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The answer does not fit the board.
    #[error(transparent)]
    Conversion(#[from] ConversionError),
    /// The answer cannot be certified, whatever it is.
    #[error(transparent)]
    Certify(#[from] CertifyError),
}

/// Sees an iteration and the duration (s) that the move has there; `false` ends the solve.
pub type Progress = Box<dyn FnMut(&Iteration, f64) -> bool>;

/// Plans the fastest move of a file, with limits where its `[solver]` table wants them.
///
/// # Errors
/// [`PlanError`].
pub fn plan(
    file: &MoveFile,
    solver: &dyn NlpSolver,
    progress: Progress,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    let problem = Arc::new(imposed(move_problem(file), file.solver.limits));
    let estimate_s = rigid_duration_s(file).unwrap_or(GUESS_WITHOUT_ESTIMATE_S);
    let progress = Rc::new(RefCell::new(progress));
    let mut effort = Effort {
        solver: solver.name(),
        status: Status::Invalid,
        iterations: 0,
        rounds: 0,
        variables: 0,
        constraints: 0,
        setup: started.elapsed(),
        solve: Duration::ZERO,
        check: Duration::ZERO,
    };
    let attempt = Attempt {
        file,
        problem: &problem,
        solver,
        progress: &progress,
    };
    let mut failure = None;
    for (index, slowness) in GUESS_SLOWNESS.into_iter().enumerate() {
        let left = file.solver.max_iterations - effort.iterations;
        let last = index + 1 == GUESS_SLOWNESS.len();
        let iterations = if last {
            left
        } else {
            left.min(ITERATIONS_PER_GUESS)
        };
        let guess = quintic_guess(file, estimate_s * slowness);
        match attempt.solve(&guess, iterations, &mut effort) {
            Ok(solved) => return checked(file, solved, effort),
            Err(diagnosis) => {
                let stopped = diagnosis.status == Status::Stopped;
                failure = Some(diagnosis);
                if stopped || effort.iterations >= file.solver.max_iterations {
                    break;
                }
            }
        }
    }
    let Some(mut diagnosis) = failure else {
        unreachable!("there is at least one first guess");
    };
    diagnosis.iterations = effort.iterations;
    Err(PlanError::Unsolved(diagnosis, Box::new(effort)))
}

/// Checks a solution and makes the trajectory of it.
fn checked(
    file: &MoveFile,
    Solved { solution, .. }: Solved,
    mut effort: Effort,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    let problem = move_problem(file);
    let end_miss = match end_miss(&problem, &solution) {
        Ok(miss) => miss,
        Err(source) => {
            let effort = Box::new(effort);
            return Err(PlanError::Check { source, effort });
        }
    };
    if let Some(worst) = end_miss
        .worst()
        .filter(|worst| worst.relative() > REFUSED_MISS)
    {
        return Err(PlanError::Missed {
            name: worst.name.clone(),
            miss: worst.miss,
            share: worst.relative() * 100.0,
            effort: Box::new(effort),
        });
    }
    let largest_violation = largest_violation(&problem, &solution);
    let plant = file.machine.plant();
    let trajectory = trajectory(plant, &file.limits, &solution, 1)?;
    let coordinates = Coordinates::of(&solution, plant.axis_count());
    let certificate = certify(&trajectory, &coordinates, &file.limits, plant)?;
    effort.check = started.elapsed();
    Ok(Plan {
        solution,
        trajectory,
        section: Section {
            coordinates,
            certificate,
        },
        effort,
        end_miss,
        largest_violation,
    })
}
