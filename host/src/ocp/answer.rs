//! One solve of a problem on a mesh: polynomials, objective, costates and effort.

use super::costate::Costates;
use super::{CollocationNlp, Guess, Mesh, OptimalControlProblem, Solution, Transcription};
use crate::nlp::{Monitor, NlpSolver, Settings, Status};
use std::sync::Arc;

/// Where a solve on one mesh ended.
#[derive(Clone, Debug)]
pub struct Answer {
    /// How.
    pub status: Status,
    /// The polynomials.
    pub solution: Solution,
    /// Value of the objective, in its own unit.
    pub objective: f64,
    /// Costates at the collocation points.
    pub costates: Costates,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Variables of the nonlinear program.
    pub variables: usize,
}

impl Answer {
    /// Solves `problem` on `mesh`, started from `guess` and scaled by it.
    #[must_use]
    pub fn of(
        problem: &Arc<OptimalControlProblem>,
        mesh: Mesh,
        guess: &Guess,
        solver: &dyn NlpSolver,
        settings: &Settings,
        monitor: Monitor,
    ) -> Self {
        let transcription = Arc::new(Transcription::new(Arc::clone(problem), mesh, guess));
        let start = transcription.unknowns(guess);
        let nlp = CollocationNlp::new(Arc::clone(&transcription), start, None);
        let outcome = solver.solve(Box::new(nlp), settings, monitor);
        Self {
            status: outcome.status,
            solution: transcription.solution(&outcome.x),
            objective: outcome.objective * transcription.scaling().objective,
            costates: Costates::of(&transcription, &outcome.multipliers),
            iterations: outcome.iterations,
            variables: transcription.variables(),
        }
    }
}
