//! One attempt: from a first guess to a solution that keeps its limits, at the points or everywhere.
//!
//! Everywhere, by exchange: limits hold at the points and at some places between them; the peaks of the solution's
//! polynomials are found, those that reach beyond their limits become places too, and the program is solved again from
//! where it ended, until no peak is left. This is the classic method for semi-infinite programs (Hettich and Kortanek, SIAM
//! Review 35, 1993). Limits are drawn in by a margin, so that it ends after finitely many rounds and what is
//! rounded to f32 still keeps them. That no limit is exceeded is not concluded from the peaks; it is proved afterwards.

use super::{Diagnosis, Effort, Finer, Progress, robust_problem};
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
const USABLE: f64 = 0.8;

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

/// The first round only finds out where the limits matter.
const FIRST_TOLERANCE: f64 = 1e-3;

/// The finer mesh has this many points more in every interval; there the solver has this many iterations.
const MORE_POINTS: usize = 2;
const FINER_ITERATIONS: usize = 100;

/// A solved program.
pub(super) struct Solved {
    pub(super) transcription: Arc<Transcription>,
    pub(super) outcome: Outcome,
    pub(super) solution: Solution,
}

/// What attempts have in common.
pub(super) struct Attempt<'a> {
    file: &'a MoveFile,
    problem: Arc<OptimalControlProblem>,
    margin: f64,
    solver: &'a dyn NlpSolver,
    progress: &'a Rc<RefCell<Progress>>,
}

impl<'a> Attempt<'a> {
    /// At the problem of a file; limits that have to hold everywhere are drawn in by a share of them.
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

    /// Solves from a first guess and adds what it cost to `effort`.
    pub(super) fn solve(
        &self,
        guess: &Guess,
        max_iterations: usize,
        effort: &mut Effort,
    ) -> Result<Solved, Box<Diagnosis>> {
        let started = Instant::now();
        let mesh = Mesh::uniform(self.file.mesh.intervals, self.file.mesh.points);
        let scaling = Scaling::automatic(&self.problem, guess);
        let program =
            |problem: &Arc<OptimalControlProblem>, path: Vec<usize>, samples: &[Sample]| {
                let problem = Arc::clone(problem);
                let whole = Transcription::with_scaling(problem, mesh.clone(), scaling.clone());
                Arc::new(whole.with_path(path).with_samples(samples))
            };
        let everywhere = self.file.solver.limits == LimitsAt::Everywhere;
        let mut samples = if everywhere {
            self.grid(&mesh)
        } else {
            Vec::new()
        };
        let all = (0..self.problem.sizes.path).collect();
        let mut problem = Arc::clone(&self.problem);
        let mut transcription = program(&problem, all, &samples);
        let mut start = Start {
            x: transcription.unknowns(guess),
            warm: None,
        };
        effort.setup += started.elapsed();
        let last_iteration = effort.iterations + max_iterations;
        for round in 0.. {
            let first = everywhere && round == 0;
            let tolerance = self.file.solver.tolerance;
            let settings = Settings {
                tolerance: if first {
                    tolerance.max(FIRST_TOLERANCE)
                } else {
                    tolerance
                },
                max_iterations: last_iteration.saturating_sub(effort.iterations),
                least_barrier: self.least_barrier(),
            };
            let outcome = self.run(&transcription, start, &settings, effort)?;
            let solution = transcription.solution(&outcome.x);
            let courses = Courses::new(&self.problem, &solution);
            let mut peaks = if everywhere {
                courses.peaks(-FAR)
            } else {
                Vec::new()
            };
            let path = self.near_path(&peaks);
            peaks.retain(|peak| peak.excess > -NEAR);
            let highest = peaks
                .iter()
                .fold(f64::NEG_INFINITY, |m, peak| m.max(peak.excess));
            if !first && (highest <= USABLE * self.margin || round == ROUNDS) {
                return Ok(Solved {
                    transcription,
                    outcome,
                    solution,
                });
            }
            renew(&mut samples, &courses, &peaks);
            problem = self.nearer(problem, &solution);
            let next = program(&problem, path, &samples);
            start = next.start_from(&transcription, &outcome);
            transcription = next;
        }
        unreachable!("the last round returns")
    }

    /// A robust problem with its bounds on what is left drawn close around a solution; any other as it is.
    fn nearer(
        &self,
        problem: Arc<OptimalControlProblem>,
        solution: &Solution,
    ) -> Arc<OptimalControlProblem> {
        let Some(robust) = self
            .file
            .robust
            .as_ref()
            .filter(|_| !problem.ends.is_empty())
        else {
            return problem;
        };
        match robust_problem(self.file, robust, Some(solution)) {
            Ok(nearer) => Arc::new(drawn_in(self.file, nearer, self.margin)),
            Err(_) => problem,
        }
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
        let outcome = self.solver.solve(Box::new(nlp.clone()), settings, monitor);
        effort.status = outcome.status;
        effort.iterations += outcome.iterations;
        effort.solve += started.elapsed();
        if outcome.status == Status::Solved {
            Ok(outcome)
        } else {
            Err(Box::new(Diagnosis::of(transcription, &nlp, &outcome)))
        }
    }

    /// The duration of an answer's program on a finer mesh, started from the answer. Its limits hold at the same places.
    pub(super) fn finer(&self, solved: &Solved) -> Option<Finer> {
        let mesh = solved.transcription.mesh().with_more_points(MORE_POINTS);
        let points = mesh.points();
        let finer = Arc::new(solved.transcription.on_mesh(mesh));
        let start = finer.start_from(&solved.transcription, &solved.outcome);
        let settings = Settings {
            tolerance: self.file.solver.tolerance,
            max_iterations: FINER_ITERATIONS,
            least_barrier: self.least_barrier(),
        };
        let nlp = CollocationNlp::new(Arc::clone(&finer), start.x, start.warm);
        let outcome = self
            .solver
            .solve(Box::new(nlp), &settings, Box::new(|_| true));
        if std::env::var("FINER").is_ok() {
            eprintln!("finer {:?} {}", outcome.status, outcome.iterations);
        }
        (outcome.status == Status::Solved).then(|| Finer {
            points,
            duration_s: finer.solution(&outcome.x).duration_s,
        })
    }

    fn least_barrier(&self) -> f64 {
        match self.file.solver.limits {
            LimitsAt::Nodes => 0.0,
            LimitsAt::Everywhere => self.file.solver.tolerance * BARRIER,
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
}

/// The problem with its limits drawn in by a margin where they have to hold everywhere.
fn drawn_in(file: &MoveFile, problem: OptimalControlProblem, margin: f64) -> OptimalControlProblem {
    match file.solver.limits {
        LimitsAt::Nodes => problem,
        LimitsAt::Everywhere => problem.tightened(margin),
    }
}

/// Brings the samples up to date with a solution and adds its peaks.
fn renew(samples: &mut Vec<Sample>, courses: &Courses<'_>, peaks: &[Peak]) {
    for sample in &mut *samples {
        *sample = courses.sample(sample.interval, sample.local, sample.limited);
    }
    let new = peaks
        .iter()
        .map(|peak| courses.sample(peak.interval, peak.local, peak.limited));
    samples.extend(new);
}
