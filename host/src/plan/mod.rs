//! Planning a move: problem, first guess, solve, check, trajectory.

mod attempt;
mod check;
mod diagnosis;
mod figures;
mod guess;
mod played;
mod problem;
mod ringing;
mod robust;
mod trajectory;

pub use check::{EndMiss, StateMiss, end_miss};
pub use diagnosis::{Diagnosis, Saturation, Violation};
pub use figures::Finer;
pub use guess::{quintic_guess, rigid_duration_s};
pub use played::{Played, PlayedError};
pub use problem::move_problem;
pub use robust::{nominal_part, robust_guess, robust_problem};
pub use trajectory::{ConversionError, trajectory};

use crate::certify::{Certificate, CertifyError, Coordinates, certify};
use crate::movefile::{LimitsAt, MoveFile, Robust};
use crate::nlp::{Iteration, NlpSolver, Status};
use crate::ocp::{Guess, Hamiltonian, OptimalControlProblem, Solution};
use crate::simulate::modes::ModesError;
use crate::simulate::ode::OdeError;
use crate::sptfile::Section;
use attempt::{Attempt, Solved};
use played::played;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};
use stillpoint_shared::Trajectory;

/// How much longer than the rigid estimate the first guesses are, one after the other until one leads to an answer:
/// solving from a slow move is quicker and surer than from one that no machine could do.
const GUESS_SLOWNESS: [f64; 4] = [2.0, 4.0, 1.3, 8.0];

/// Iterations that a first guess is given before the next one is tried; the last one may use up all that are left.
const ITERATIONS_PER_GUESS: usize = 150;

/// Guessed duration, s, when the straight line between the poses gives no estimate.
const GUESS_WITHOUT_ESTIMATE_S: f64 = 0.25;

/// Shares of the limits by which they are drawn in so that they hold everywhere: the next one if with one what is shipped
/// cannot be certified, or the executor's limiter might act on it.
const MARGINS: [f64; 3] = [2e-4, 1e-3, 5e-3];

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
    /// The duration on a finer mesh, if the solver ended there.
    pub finer: Option<Finer>,
    /// The Hamiltonian, from the multipliers.
    pub hamiltonian: Hamiltonian,
    /// What the executor made of the shipped trajectory.
    pub played: Result<Played, PlayedError>,
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
    /// The limits could not be made to hold between the points.
    #[error(
        "the plan does not hold: {tightest}. Try a finer mesh ([mesh] intervals, points), or plan with limits at the points only \
         (`--limits nodes`), which a board refuses"
    )]
    NotCertified {
        /// The limit that is exceeded most, in words.
        tightest: String,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The answer does not fit the board.
    #[error(transparent)]
    Conversion(#[from] ConversionError),
    /// A plant of a robust move cannot follow the nominal one.
    #[error("no robust plan: following the motion that is planned for the nominal plant, {0}")]
    Follow(#[from] OdeError),
    /// A plant of a robust move has no modes at the goal.
    #[error("no bound on what is left after the move: {0}")]
    Modes(#[from] ModesError),
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
    let progress = Rc::new(RefCell::new(progress));
    let attempt = Attempt::new(file, problem(file)?, solver, &progress, MARGINS[0]);
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
    let mut solved = match &file.robust {
        None => from_first_guesses(file, &attempt, &mut effort)?,
        Some(robust) => {
            let nominal = Attempt::new(file, move_problem(file), solver, &progress, MARGINS[0]);
            let nominal = from_first_guesses(file, &nominal, &mut effort)?;
            from_nominal(file, robust, &attempt, &nominal, &mut effort)?
        }
    };
    let mut shipped = Shipped::of(file, &nominal_part(file, &solved.solution))?;
    for margin in &MARGINS[1..] {
        if shipped.is_as_wanted(file) {
            break;
        }
        let attempt = Attempt::new(file, problem(file)?, solver, &progress, *margin);
        let guess = Guess::from_solution(solved.solution);
        let left = file.solver.max_iterations.saturating_sub(effort.iterations);
        let again = attempt.solve(&guess, left, &mut effort);
        solved = again.map_err(|diagnosis| PlanError::unsolved(diagnosis, &effort))?;
        shipped = Shipped::of(file, &nominal_part(file, &solved.solution))?;
    }
    checked(file, &attempt, solved, shipped, effort)
}

/// The problem of a file, for all its plants.
fn problem(file: &MoveFile) -> Result<OptimalControlProblem, PlanError> {
    Ok(match &file.robust {
        Some(robust) => robust_problem(file, robust, None)?,
        None => move_problem(file),
    })
}

/// Solves for all plants from the solution for the nominal one.
fn from_nominal(
    file: &MoveFile,
    robust: &Robust,
    attempt: &Attempt<'_>,
    nominal: &Solved,
    effort: &mut Effort,
) -> Result<Solved, PlanError> {
    let guess = robust_guess(file, robust, &nominal.solution)?;
    let left = file.solver.max_iterations.saturating_sub(effort.iterations);
    let solved = attempt.solve(&guess, left, effort);
    solved.map_err(|diagnosis| PlanError::unsolved(diagnosis, effort))
}

/// Solves from one first guess after the other.
fn from_first_guesses(
    file: &MoveFile,
    attempt: &Attempt<'_>,
    effort: &mut Effort,
) -> Result<Solved, PlanError> {
    let estimate_s = rigid_duration_s(file).unwrap_or(GUESS_WITHOUT_ESTIMATE_S);
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
        match attempt.solve(&guess, iterations, effort) {
            Ok(solved) => return Ok(solved),
            Err(diagnosis) => {
                let stopped = diagnosis.status == Status::Stopped;
                failure = Some(diagnosis);
                if stopped || effort.iterations >= file.solver.max_iterations {
                    break;
                }
            }
        }
    }
    let Some(diagnosis) = failure else {
        unreachable!("there is at least one first guess");
    };
    Err(PlanError::unsolved(diagnosis, effort))
}

impl PlanError {
    fn unsolved(mut diagnosis: Box<Diagnosis>, effort: &Effort) -> Self {
        diagnosis.iterations = effort.iterations;
        Self::Unsolved(diagnosis, Box::new(effort.clone()))
    }
}

/// What is written into the file.
struct Shipped {
    trajectory: Trajectory,
    coordinates: Coordinates,
    certificate: Certificate,
}

impl Shipped {
    fn of(file: &MoveFile, solution: &Solution) -> Result<Self, PlanError> {
        let plant = file.machine.plant();
        let trajectory = trajectory(plant, &file.limits, solution, 1)?;
        let coordinates = Coordinates::of(solution, plant.axis_count());
        let certificate = certify(&trajectory, &coordinates, &file.limits, plant)?;
        Ok(Self {
            trajectory,
            coordinates,
            certificate,
        })
    }

    fn is_as_wanted(&self, file: &MoveFile) -> bool {
        file.solver.limits == LimitsAt::Nodes
            || self.certificate.is_certified() && self.certificate.limiter_never_acts()
    }
}

/// Checks an answer and what is shipped of it.
fn checked(
    file: &MoveFile,
    attempt: &Attempt<'_>,
    solved: Solved,
    shipped: Shipped,
    mut effort: Effort,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    let nominal = nominal_part(file, &solved.solution);
    if let Some(tightest) = shipped.certificate.tightest()
        && !shipped.certificate.is_certified()
        && file.solver.limits == LimitsAt::Everywhere
    {
        return Err(PlanError::NotCertified {
            tightest: tightest.to_string(),
            effort: Box::new(effort),
        });
    }
    // The solver works on one core most of the time.
    let (miss, played, finer) = std::thread::scope(|scope| {
        let checks = scope.spawn(|| {
            let miss = end_miss(&move_problem(file), &nominal);
            (miss, played(file, &shipped.trajectory))
        });
        let finer = attempt.finer(&solved);
        let (miss, played) = checks
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (miss, played, finer)
    });
    effort.check = started.elapsed();
    let end_miss = match miss {
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
    Ok(Plan {
        hamiltonian: solved.transcription.hamiltonian(&solved.outcome),
        solution: nominal,
        trajectory: shipped.trajectory,
        section: Section {
            coordinates: shipped.coordinates,
            certificate: shipped.certificate,
        },
        effort,
        end_miss,
        finer,
        played,
    })
}
