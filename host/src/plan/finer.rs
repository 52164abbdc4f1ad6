//! What a finer mesh would change: the program of an answer solved on it, beside the rounds that lead to that answer.

use crate::nlp::{NlpSolver, Settings, Start, Status};
use crate::ocp::{CollocationNlp, Transcription};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Scope, ScopedJoinHandle};

/// The duration on a finer mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finer {
    /// Collocation points of that mesh.
    pub points: usize,
    /// Duration there, s.
    pub duration_s: f64,
    /// Duration on the plan's own mesh with limits at the same places, s. Later rounds may have added places to the plan.
    pub own_s: f64,
}

/// A program on a finer mesh, ready to be solved.
pub(super) struct FinerProgram {
    pub(super) transcription: Arc<Transcription>,
    pub(super) start: Start,
    pub(super) settings: Settings,
}

impl FinerProgram {
    /// Number of points and duration (s), if the solver ends and is not stopped before.
    fn solve(self, solver: &dyn NlpSolver, stop: Arc<AtomicBool>) -> Option<(usize, f64)> {
        let program = self.transcription;
        let nlp = CollocationNlp::new(Arc::clone(&program), self.start.x, self.start.warm);
        let monitor = Box::new(move |_: &_| !stop.load(Ordering::Relaxed));
        let outcome = solver.solve(Box::new(nlp), &self.settings, monitor);
        (outcome.status == Status::Solved).then(|| {
            let duration_s = program.solution(&outcome.x).duration_s;
            (program.mesh().points(), duration_s)
        })
    }
}

/// Solves finer programs beside what else goes on, one at a time: the solver works on one core most of the time.
pub(super) struct Beside<'scope, 'env> {
    scope: &'scope Scope<'scope, 'env>,
    solver: &'env dyn NlpSolver,
    running: Option<Running<'scope>>,
}

struct Running<'scope> {
    handle: ScopedJoinHandle<'scope, Option<(usize, f64)>>,
    stop: Arc<AtomicBool>,
    own_s: Option<f64>,
}

impl<'scope, 'env> Beside<'scope, 'env> {
    pub(super) fn new(scope: &'scope Scope<'scope, 'env>, solver: &'env dyn NlpSolver) -> Self {
        Self {
            scope,
            solver,
            running: None,
        }
    }

    /// Begins with a program and gives the one before it up.
    pub(super) fn begin(&mut self, program: FinerProgram) {
        self.stop();
        let stop = Arc::new(AtomicBool::new(false));
        let (solver, flag) = (self.solver, Arc::clone(&stop));
        self.running = Some(Running {
            handle: self.scope.spawn(move || program.solve(solver, flag)),
            stop,
            own_s: None,
        });
    }

    /// Tells the duration (s) on the plan's own mesh, as soon as it is known; later ones are other programs'.
    pub(super) fn own_duration(&mut self, duration_s: f64) {
        if let Some(running) = &mut self.running {
            running.own_s.get_or_insert(duration_s);
        }
    }

    /// Gives up what runs.
    pub(super) fn stop(&mut self) {
        if let Some(running) = self.running.take() {
            running.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Waits for the answer.
    pub(super) fn finish(&mut self) -> Option<Finer> {
        let running = self.running.take()?;
        let answer = running.handle.join();
        let (points, duration_s) =
            answer.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Some(Finer {
            points,
            duration_s,
            own_s: running.own_s?,
        })
    }
}
