//! Planning a move: problem, first guess, solve, check, trajectory.

mod attempt;
mod check;
mod diagnosis;
mod error;
mod figures;
mod finer;
mod guess;
mod played;
mod problem;
mod refinement;
mod robust;
mod shipped;
mod spread;
mod stillness;
mod trajectory;
mod ways;

pub use check::{EndMiss, StateMiss, end_miss};
pub use diagnosis::{Diagnosis, Nearest, Saturation, Violation};
pub use error::PlanError;
pub use finer::Finer;
pub use guess::{quintic_guess, rigid_duration_s};
pub use played::{Played, PlayedError};
pub use problem::move_problem;
pub use refinement::{Refinement, Shortfall};
pub use robust::{nominal_part, robust_problem};
pub use trajectory::{ConversionError, trajectory};

use crate::movefile::{LimitsAt, MoveFile};
use crate::nlp::{Iteration, NlpSolver, Status};
use crate::ocp::{Hamiltonian, Mesh, OptimalControlProblem, Solution};
use crate::sptfile::Section;
use attempt::{Attempt, Solved};
use finer::Beside;
use played::played;
use problem::{LONGEST_S, SHORTEST_SHARE};
use shipped::Shipped;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};
use stillpoint_shared::Trajectory;
use ways::WAYS;

/// How much longer than the rigid estimate the first guesses are, one after the other until one leads to an answer:
/// solving from a slow move is quicker and surer than from one that no machine could do.
const GUESS_SLOWNESS: [f64; 4] = [2.0, 4.0, 1.3, 8.0];

/// How many of them a robust move is tried from: there is a surer way, over plants that are nearer to the nominal one.
const GUESSES_OF_ROBUST: usize = 2;

/// Iterations that a first guess is given before the next one is tried, and the last one before another way.
const ITERATIONS_PER_GUESS: usize = 200;
const ITERATIONS_OF_LAST_GUESS: usize = 500;

/// Guessed duration, s, when the straight line between the poses gives no estimate.
const GUESS_WITHOUT_ESTIMATE_S: f64 = 0.25;

/// Share of the limits by which they are drawn in so that they hold everywhere, and how many times more than that is tried if
/// what is shipped cannot be certified, or the executor's limiter might act on it.
const MARGIN: f64 = 5e-4;
const WIDER_MARGINS: usize = 2;

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
    /// What refinement of the mesh did, if it was asked for.
    pub refinement: Option<Refinement>,
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
        let doubts = [self.missing_the_end(), self.limiter_may_act()];
        let doubts: Vec<String> = doubts.into_iter().flatten().collect();
        (!doubts.is_empty()).then(|| doubts.join("; "))
    }

    fn missing_the_end(&self) -> Option<String> {
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

    /// Positions far from zero have few digits left in f32: their steps from tick to tick can look faster than the limit.
    fn limiter_may_act(&self) -> Option<String> {
        let certificate = &self.section.certificate;
        let proof = certificate.tightest_as_played()?;
        if !certificate.is_certified() || proof.is_left_alone() {
            return None;
        }
        let acts = match &self.played {
            Ok(played) if played.limited_ticks > 0 => {
                format!("acts in {} ticks", played.limited_ticks)
            }
            _ => "may act".to_owned(),
        };
        Some(format!(
            "every limit holds, but as the board computes it in f32 {} can reach {:.6e} {} of {}, and its limiter {acts}: split the \
             move, put the zero of the axis nearer to it, or leave more room below the drive's limit",
            proof.name,
            proof.played.unwrap_or(proof.bound),
            proof.unit,
            proof.limit
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
    /// How many of them led nowhere and were begun again from elsewhere.
    pub restarts: usize,
    /// Intervals of the mesh: more than the move file says where limits could not be kept on that.
    pub intervals: usize,
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
    let progress = Rc::new(RefCell::new(progress));
    let effort = Effort {
        solver: solver.name(),
        status: Status::Invalid,
        iterations: 0,
        rounds: 0,
        restarts: 0,
        intervals: 0,
        variables: 0,
        constraints: 0,
        setup: Duration::ZERO,
        solve: Duration::ZERO,
        check: Duration::ZERO,
    };
    std::thread::scope(|scope| {
        let mut beside = Beside::new(scope, solver);
        let mut plan = plan_on_mesh(file, solver, &progress, &mut beside, effort);
        for way in &WAYS {
            let failed = plan.as_ref().err().and_then(PlanError::worth_another_way);
            let left = |spent: &Effort| spent.iterations < file.solver.max_iterations;
            let Some((failure, spent)) = failed.filter(|(_, spent)| left(spent)) else {
                break;
            };
            if let Some(other) = way.instead_of(file, failure) {
                let spent = Effort {
                    restarts: spent.restarts + 1,
                    ..spent.clone()
                };
                plan = plan_on_mesh(&other, solver, &progress, &mut beside, spent);
            }
        }
        beside.stop();
        plan
    })
}

/// Plans on the mesh of a file.
fn plan_on_mesh(
    file: &MoveFile,
    solver: &dyn NlpSolver,
    progress: &Rc<RefCell<Progress>>,
    beside: &mut Beside<'_, '_>,
    mut effort: Effort,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    check_length(file)?;
    let attempt = Attempt::new(file, problem(file)?, solver, progress, MARGIN);
    effort.intervals = file.mesh.intervals;
    effort.setup += started.elapsed();
    let solved = from_first_guesses(file, &attempt, &mut effort, beside);
    let mut solved = match (&file.robust, solved) {
        (Some(robust), Err(failure)) if failure.worth_another_way().is_some() => {
            spread::from_the_nominal_plant(&attempt, robust, &mut effort, beside)?
        }
        (_, solved) => solved?,
    };
    let refinement = (file.mesh.refine)
        .map(|tolerance| refinement::refine(&attempt, &mut solved, tolerance, &mut effort, beside))
        .transpose()?;
    let mut shipped = Shipped::of(file, &solved.solution)?;
    let narrower = stillness::drawn_in(&attempt, &mut solved, &mut shipped, &mut effort, beside)?;
    let mut margin = MARGIN;
    for _ in 0..WIDER_MARGINS {
        let Some(wider) = shipped.wider_margin(file, margin) else {
            break;
        };
        margin = wider;
        let attempt = Attempt::new(&narrower, problem(&narrower)?, solver, progress, margin);
        solved = match attempt.rounds(solved.clone(), &mut effort, beside) {
            Ok(again) => again,
            Err(diagnosis) if diagnosis.status == Status::Stopped => {
                return Err(PlanError::unsolved(diagnosis, &effort));
            }
            Err(_) => break,
        };
        shipped = Shipped::of(file, &solved.solution)?;
    }
    let plan = checked(file, beside, solved, shipped, effort)?;
    let mut plan = Plan { refinement, ..plan };
    plan.section.remarks = plan.remarks(file.solver.limits);
    Ok(plan)
}

/// Whether there is a duration to look for.
fn check_length(file: &MoveFile) -> Result<(), PlanError> {
    match guess::rigid_duration(file) {
        Some((estimate_s, limit)) if SHORTEST_SHARE * estimate_s >= LONGEST_S => {
            Err(PlanError::TooLong {
                limit,
                estimate_s,
                longest_s: LONGEST_S,
            })
        }
        _ => Ok(()),
    }
}

/// The problem of a file, for all its plants.
fn problem(file: &MoveFile) -> Result<OptimalControlProblem, PlanError> {
    Ok(match &file.robust {
        Some(robust) => robust_problem(file, robust, None)?,
        None => move_problem(file),
    })
}

/// Solves from one first guess after the other.
fn from_first_guesses(
    file: &MoveFile,
    attempt: &Attempt<'_>,
    effort: &mut Effort,
    beside: &mut Beside<'_, '_>,
) -> Result<Solved, PlanError> {
    let estimate_s = rigid_duration_s(file).unwrap_or(GUESS_WITHOUT_ESTIMATE_S);
    let mut failure = None;
    let guesses = match file.robust {
        Some(_) => &GUESS_SLOWNESS[..GUESSES_OF_ROBUST],
        None => &GUESS_SLOWNESS,
    };
    for (index, slowness) in guesses.iter().enumerate() {
        let left = file.solver.max_iterations.saturating_sub(effort.iterations);
        let last = index + 1 == GUESS_SLOWNESS.len();
        let iterations = left.min(if last {
            ITERATIONS_OF_LAST_GUESS
        } else {
            ITERATIONS_PER_GUESS
        });
        let guess = quintic_guess(file, estimate_s * slowness);
        let mesh = Mesh::uniform(file.mesh.intervals, file.mesh.points);
        match attempt.solve(mesh, &guess, iterations, effort, beside) {
            Ok(solved) => return Ok(solved),
            Err(diagnosis) => {
                let stopped = diagnosis.status == Status::Stopped;
                failure = Some(diagnosis);
                effort.restarts += usize::from(!last);
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

/// Checks an answer and what is shipped of it.
fn checked(
    file: &MoveFile,
    beside: &mut Beside<'_, '_>,
    solved: Solved,
    shipped: Shipped,
    mut effort: Effort,
) -> Result<Plan, PlanError> {
    let started = Instant::now();
    if let Some(tightest) = shipped.certificate.tightest()
        && !shipped.certificate.is_certified()
        && file.solver.limits == LimitsAt::Everywhere
    {
        return Err(PlanError::NotCertified {
            tightest: tightest.to_string(),
            effort: Box::new(effort),
        });
    }
    stillness::check(file, &shipped, &effort)?;
    let nominal = nominal_part(file, &solved.solution);
    let miss = end_miss(&move_problem(file), &nominal);
    let played = played(file, &shipped.trajectory);
    let finer = beside.finish();
    effort.check += started.elapsed();
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
            remarks: Vec::new(),
        },
        effort,
        end_miss,
        refinement: None,
        finer,
        played,
    })
}
