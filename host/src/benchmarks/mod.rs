//! Optimal control problems with known answers: what the planner's transcription, refinement and search for switching
//! structures are measured by. None of them knows anything of machines.

mod brachistochrone;
mod bryson_denham;
mod floating_oscillator;
mod goddard;
mod hypersensitive;
mod rayleigh;
mod robot_arm;
mod run;
mod statement;
mod triple_integrator;
mod two_link_arm;
mod van_der_pol;

pub use run::{Approach, Measured, RunError, run};

use crate::ocp::{Guess, OptimalControlProblem};

/// A problem and what is known of its answer.
pub struct Benchmark {
    /// Short name, for the command line.
    pub name: &'static str,
    /// Optimal value of the objective.
    pub answer: f64,
    /// How far the answer may be wrong itself, relative; 0 where a formula gives it.
    pub uncertainty: f64,
    /// Where the problem and its answer come from.
    pub source: &'static str,
    /// The problem.
    pub problem: OptimalControlProblem,
    /// A guess that knows the ends and the rough duration, nothing else.
    pub guess: Guess,
}

impl Benchmark {
    /// |value − answer| / |answer|.
    #[must_use]
    pub fn error(&self, value: f64) -> f64 {
        ((value - self.answer) / self.answer).abs()
    }
}

/// All problems, in the order of the table in the docs.
#[must_use]
pub fn all() -> Vec<Benchmark> {
    vec![
        bryson_denham::benchmark(),
        hypersensitive::benchmark(),
        brachistochrone::benchmark(),
        triple_integrator::benchmark(),
        floating_oscillator::benchmark(),
        robot_arm::benchmark(),
        two_link_arm::benchmark(),
        rayleigh::benchmark(),
        goddard::benchmark(),
        van_der_pol::benchmark(),
    ]
}

/// The problem of a name.
#[must_use]
pub fn named(name: &str) -> Option<Benchmark> {
    all().into_iter().find(|benchmark| benchmark.name == name)
}
