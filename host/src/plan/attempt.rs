//! One attempt: from a first guess to a solution that keeps its limits, at the points or everywhere.
//!
//! Everywhere, by exchange: limits hold at the points and at some places between them; the peaks of the solution's
//! polynomials are found, those that reach beyond their limits become places too, and the program is solved again from
//! where it ended, until no peak is left. This is the classic method for semi-infinite programs (Hettich and Kortanek, SIAM
//! Review 35, 1993). Limits are drawn in by a margin, so that it ends after finitely many rounds and what is
//! rounded to f32 still keeps them. That no limit is exceeded is not concluded from the peaks; it is proved afterwards.

use super::finer::{Beside, FinerProgram};
use super::guess::slowed_guess;
use super::{Diagnosis, Effort, Progress, robust_problem};
use crate::movefile::{LimitsAt, MoveFile};
use crate::nlp::{Iteration, NlpSolver, Outcome, Settings, Start, Status};
use crate::ocp::{
    CollocationNlp, Courses, Guess, Limited, Mesh, OptimalControlProblem, Peak, Sample, Scaling,
    Solution, Transcription, lgr::Rule,
};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

/// What a peak may use up of the margin by which the limits are drawn in.
const USABLE: f64 = 0.5;

/// Share of the tolerance to which the barrier is lowered. Beyond that the solution presses against its limits until its
/// polynomials swing between the places, for a gain below the tolerance.
const BARRIER: f64 = 0.9;

/// Peaks that come this close to their limit (share of it) are held too: the next solution may press them further.
const NEAR: f64 = 0.1;

/// Path functions that stay farther away than this (share of the limit) all along are left out of the next program: most of
/// its rows are theirs. If they come near again, they are back in the one after it.
const FAR: f64 = 0.5;

/// Rounds after which the peaks are taken as they are.
const ROUNDS: usize = 10;

/// Rounds in a row that bring no peak nearer to its limit, after which they are taken as they are too.
const STUCK: usize = 3;

/// Iterations that a round after the first may take.
const ITERATIONS_PER_ROUND: usize = 150;

/// The first round only finds out where the limits matter.
const FIRST_TOLERANCE: f64 = 1e-5;

/// Iterations that the first round may take without what most motions stay far away from. Those that end take 20 to 30.
const UNGUARDED_ITERATIONS: usize = 60;

/// How much longer the last answer is made where a round leads nowhere from it: far from all limits.
const SLOWER: f64 = 1.5;

/// Peaks nearer to a place than this, in mean distances of the points, are held by it as long as they keep their limit; a
/// violated one that is nearer than the other moves it half the way. Rows that say nearly the same make a program hard to solve.
const HELD: f64 = 0.2;
const SAME: f64 = 0.02;

/// The finer mesh has this many points more in every interval; there the solver has this many iterations.
const MORE_POINTS: usize = 2;
const FINER_ITERATIONS: usize = 100;

/// A solved program.
#[derive(Clone)]
pub(super) struct Solved {
    pub(super) transcription: Arc<Transcription>,
    pub(super) outcome: Outcome,
    pub(super) solution: Solution,
    /// Where limits hold between the points.
    samples: Vec<Sample>,
}

/// What attempts have in common.
pub(super) struct Attempt<'a> {
    pub(super) file: &'a MoveFile,
    pub(super) problem: Arc<OptimalControlProblem>,
    margin: f64,
    solver: &'a dyn NlpSolver,
    progress: &'a Rc<RefCell<Progress>>,
}

impl<'a> Attempt<'a> {
    /// At a problem of a file; limits that have to hold everywhere are drawn in by a share of them.
    pub(super) fn new(
        file: &'a MoveFile,
        problem: OptimalControlProblem,
        solver: &'a dyn NlpSolver,
        progress: &'a Rc<RefCell<Progress>>,
        margin: f64,
    ) -> Self {
        Self {
            file,
            problem: Arc::new(drawn_in(file, problem, margin)),
            margin,
            solver,
            progress,
        }
    }

    /// The same at another problem, of another file.
    pub(super) fn at<'b>(&self, file: &'b MoveFile, problem: OptimalControlProblem) -> Attempt<'b>
    where
        'a: 'b,
    {
        Attempt::new(file, problem, self.solver, self.progress, self.margin)
    }

    fn everywhere(&self) -> bool {
        self.file.solver.limits == LimitsAt::Everywhere
    }

    /// Solves on a mesh from a first guess, in at most so many iterations in the first round, and adds what it cost to `effort`.
    pub(super) fn solve(
        &self,
        mesh: Mesh,
        guess: &Guess,
        max_iterations: usize,
        effort: &mut Effort,
        beside: &mut Beside<'_, '_>,
    ) -> Result<Solved, Box<Diagnosis>> {
        let started = Instant::now();
        let samples = if self.everywhere() {
            self.grid(&mesh)
        } else {
            Vec::new()
        };
        let scaling = Scaling::automatic(&self.problem, guess);
        let first = Transcription::with_scaling(Arc::clone(&self.problem), mesh, scaling)
            .with_samples(&samples);
        effort.setup += started.elapsed();
        if self.everywhere() {
            let tolerance = self.file.solver.tolerance.max(FIRST_TOLERANCE);
            let settings = self.settings(tolerance, max_iterations);
            let solved = match self.unguarded(&first, guess, &settings, effort)? {
                Some(solved) => solved,
                None => self.solved_at_once(first, guess, &settings, effort)?,
            };
            self.rounds(solved, effort, beside)
        } else {
            let settings = self.settings(self.file.solver.tolerance, max_iterations);
            let solved = self.solved_at_once(first, guess, &settings, effort)?;
            beside.begin(self.finer(&solved.transcription, &solved));
            beside.own_duration(solved.solution.duration_s);
            Ok(solved)
        }
    }

    /// Solves a program from a guess.
    fn solved_at_once(
        &self,
        program: Transcription,
        guess: &Guess,
        settings: &Settings,
        effort: &mut Effort,
    ) -> Result<Solved, Box<Diagnosis>> {
        let start = Start {
            x: program.unknowns(guess),
            warm: None,
        };
        let program = Arc::new(program);
        let outcome = self.run(&program, start, settings, effort)?;
        Ok(Solved {
            solution: program.solution(&outcome.x),
            samples: program.samples(),
            transcription: program,
            outcome,
        })
    }

    /// Solves a program without what most motions stay far away from: a quarter of its path rows and some of its iterations.
    /// `None` where that leads nowhere, or past it.
    fn unguarded(
        &self,
        program: &Transcription,
        guess: &Guess,
        settings: &Settings,
        effort: &mut Effort,
    ) -> Result<Option<Solved>, Box<Diagnosis>> {
        let guards = &self.problem.guards;
        if guards.is_empty() {
            return Ok(None);
        }
        let others = (0..self.problem.sizes.path).filter(|row| !guards.contains(row));
        let program = program
            .on_mesh(program.mesh().clone())
            .with_path(others.collect());
        let settings = Settings {
            max_iterations: settings.max_iterations.min(UNGUARDED_ITERATIONS),
            ..*settings
        };
        let solved = match self.solved_at_once(program, guess, &settings, effort) {
            Err(diagnosis)
                if diagnosis.status == Status::Stopped
                    || effort.iterations >= self.file.solver.max_iterations =>
            {
                return Err(diagnosis);
            }
            other => other.ok(),
        };
        let solved = solved.filter(|solved| {
            let courses = Courses::new(&self.problem, &solved.solution);
            let past =
                |peak: &Peak| matches!(peak.limited, Limited::Path(row) if guards.contains(&row));
            !courses.peaks(0.0).iter().any(past)
        });
        effort.restarts += usize::from(solved.is_none());
        Ok(solved)
    }

    /// From an answer that keeps other limits, or these limits at fewer places, to one that keeps these everywhere.
    pub(super) fn rounds(
        &self,
        mut solved: Solved,
        effort: &mut Effort,
        beside: &mut Beside<'_, '_>,
    ) -> Result<Solved, Box<Diagnosis>> {
        let settings = self.settings(self.file.solver.tolerance, ITERATIONS_PER_ROUND);
        let (mut least, mut stuck) = (f64::INFINITY, 0);
        for round in 0..=ROUNDS {
            let courses = Courses::new(&self.problem, &solved.solution);
            let mut peaks = courses.peaks(-FAR);
            let path = self.near_path(&peaks);
            peaks.retain(|peak| peak.excess > -NEAR);
            let kept = peaks.iter().all(|peak| peak.excess <= USABLE * self.margin);
            // The first answer comes from elsewhere.
            if round > 0 && kept {
                break;
            }
            let worst = peaks.iter().fold(0.0_f64, |m, peak| m.max(peak.excess));
            stuck = if worst < least { 0 } else { stuck + 1 };
            least = least.min(worst);
            if stuck > STUCK {
                break;
            }
            self.renew(&mut solved.samples, &courses, &peaks);
            let (mesh, scaling) = (solved.transcription.mesh(), solved.transcription.scaling());
            let problem = self.nearer(&solved.solution);
            let next = Transcription::with_scaling(problem, mesh.clone(), scaling.clone())
                .with_path(path)
                .with_samples(&solved.samples);
            let next = Arc::new(next);
            if round == 0 {
                beside.begin(self.finer(&next, &solved));
            }
            let outcome = self.run_or_restart(&next, &solved, &settings, effort)?;
            solved.solution = next.solution(&outcome.x);
            solved.transcription = next;
            solved.outcome = outcome;
            beside.own_duration(solved.solution.duration_s);
        }
        Ok(solved)
    }

    /// The problem, with the bounds of a robust one on what is left drawn close around a solution.
    fn nearer(&self, solution: &Solution) -> Arc<OptimalControlProblem> {
        let robust = self.file.robust.as_ref();
        robust
            .filter(|_| !self.problem.ends.is_empty())
            .and_then(|robust| robust_problem(self.file, robust, Some(solution)).ok())
            .map_or_else(
                || Arc::clone(&self.problem),
                |problem| Arc::new(drawn_in(self.file, problem, self.margin)),
            )
    }

    fn settings(&self, tolerance: f64, max_iterations: usize) -> Settings {
        Settings {
            tolerance,
            max_iterations,
            least_barrier: match self.file.solver.limits {
                LimitsAt::Nodes => 0.0,
                LimitsAt::Everywhere => tolerance * BARRIER,
            },
        }
    }

    /// Solves a program from an answer to another: with its multipliers, or without them, or from the answer slowed down.
    fn run_or_restart(
        &self,
        program: &Arc<Transcription>,
        last: &Solved,
        settings: &Settings,
        effort: &mut Effort,
    ) -> Result<Outcome, Box<Diagnosis>> {
        let near = program.start_from(&last.transcription, &last.outcome);
        let without_multipliers = || near.x.clone();
        let slowed = || program.unknowns(&slowed_guess(self.file, &last.solution, SLOWER));
        let others: [&dyn Fn() -> Vec<f64>; 2] = [&without_multipliers, &slowed];
        let mut outcome = self.run(program, near.clone(), settings, effort);
        for x in others {
            match &outcome {
                Err(failed) if failed.status != Status::Stopped => {}
                _ => break,
            }
            effort.restarts += 1;
            let start = Start { x: x(), warm: None };
            outcome = self.run(program, start, settings, effort);
        }
        outcome
    }

    /// One run of the solver.
    fn run(
        &self,
        transcription: &Arc<Transcription>,
        start: Start,
        settings: &Settings,
        effort: &mut Effort,
    ) -> Result<Outcome, Box<Diagnosis>> {
        let started = Instant::now();
        let left = self
            .file
            .solver
            .max_iterations
            .saturating_sub(effort.iterations);
        let settings = Settings {
            max_iterations: settings.max_iterations.min(left),
            ..*settings
        };
        let nlp = CollocationNlp::new(Arc::clone(transcription), start.x, start.warm);
        effort.variables = transcription.variables();
        effort.constraints = transcription.constraints();
        effort.rounds += 1;
        let seconds_per_objective = transcription.scaling().objective;
        let (progress, before) = (Rc::clone(self.progress), effort.iterations);
        let monitor = Box::new(move |iteration: &Iteration| {
            let counted = Iteration {
                number: before + iteration.number,
                ..*iteration
            };
            (progress.borrow_mut())(&counted, iteration.objective * seconds_per_objective)
        });
        let outcome = self.solver.solve(Box::new(nlp.clone()), &settings, monitor);
        effort.status = outcome.status;
        effort.iterations += outcome.iterations;
        effort.solve += started.elapsed();
        if outcome.status == Status::Solved {
            Ok(outcome)
        } else {
            Err(Box::new(Diagnosis::of(transcription, &nlp, &outcome)))
        }
    }

    /// A program on a finer mesh, to be started from an answer. Its limits hold at the same places.
    fn finer(&self, program: &Transcription, solved: &Solved) -> FinerProgram {
        let transcription = program.on_mesh(program.mesh().with_more_points(MORE_POINTS));
        FinerProgram {
            start: transcription.start_from(&solved.transcription, &solved.outcome),
            transcription: Arc::new(transcription),
            settings: self.settings(self.file.solver.tolerance, FINER_ITERATIONS),
        }
    }

    /// The path functions that peaks are near to.
    fn near_path(&self, peaks: &[Peak]) -> Vec<usize> {
        let near = |row: usize| peaks.iter().any(|peak| peak.limited == Limited::Path(row));
        // Equations hold wherever the solution goes.
        let equation = |row: usize| self.problem.path[row].bounds.size() == 0.0;
        (0..self.problem.sizes.path)
            .filter(|&row| near(row) || equation(row))
            .collect()
    }

    /// Where controls are limited from the start: at the end of every interval, where LGR has none, and between the
    /// points. They touch their limits most of the time, and their polynomials swing.
    fn grid(&self, mesh: &Mesh) -> Vec<Sample> {
        let mut samples = Vec::new();
        for (interval, spec) in mesh.intervals().iter().enumerate() {
            let Ok(rule) = Rule::new(spec.points) else {
                continue;
            };
            let middles = rule
                .support
                .windows(2)
                .map(|pair| (pair[0] + pair[1]) / 2.0);
            for local in middles.chain([1.0]) {
                let controls = self.problem.controls.iter().enumerate();
                let limited = controls.filter(|(_, control)| control.bounds.size().is_finite());
                samples.extend(limited.map(|(index, control)| Sample {
                    interval,
                    local,
                    limited: Limited::Control(index),
                    bounds: control.bounds,
                }));
            }
        }
        samples
    }

    /// Brings the samples up to date with a solution and adds its peaks.
    fn renew(&self, samples: &mut Vec<Sample>, courses: &Courses<'_>, peaks: &[Peak]) {
        for peak in peaks {
            let distance = 2.0 / courses.points(peak.interval) as f64;
            let nearest = (samples.iter_mut())
                .filter(|s| s.interval == peak.interval && s.limited == peak.limited)
                .map(|s| ((s.local - peak.local).abs() / distance, s))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let keeps = peak.excess <= USABLE * self.margin;
            match nearest {
                Some((near, _)) if keeps && near < HELD => {}
                // Moved all the way, place and peak can change sides for ever.
                Some((near, sample)) if near < SAME => {
                    sample.local = (sample.local + peak.local) / 2.0;
                }
                _ => samples.push(courses.sample(peak.interval, peak.local, peak.limited)),
            }
        }
        for sample in samples {
            *sample = courses.sample(sample.interval, sample.local, sample.limited);
        }
    }
}

/// A problem with its limits drawn in by a margin where they have to hold everywhere.
fn drawn_in(file: &MoveFile, problem: OptimalControlProblem, margin: f64) -> OptimalControlProblem {
    match file.solver.limits {
        LimitsAt::Nodes => problem,
        LimitsAt::Everywhere => problem.tightened(margin),
    }
}
