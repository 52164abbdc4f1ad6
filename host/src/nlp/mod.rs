//! Nonlinear programming: the problem as sparse exact derivatives, and the solvers behind one trait.

#[cfg(feature = "ipopt")]
mod ipopt;
mod pounce;
mod warm;

#[cfg(feature = "ipopt")]
pub use ipopt::Ipopt;
pub use pounce::Pounce;

use crate::ocp::Bounds;
use std::fmt;

/// minimise f(x) subject to g_L ≤ g(x) ≤ g_U, x_L ≤ x ≤ x_U.
pub trait NlpProblem {
    /// Bounds of the variables.
    fn variable_bounds(&self) -> &[Bounds];
    /// Bounds of the constraints.
    fn constraint_bounds(&self) -> &[Bounds];
    /// (row, column) of every Jacobian entry; duplicates add up.
    fn jacobian_structure(&self) -> &[(usize, usize)];
    /// (row, column ≤ row) of every entry of the Lagrangian's Hessian; duplicates add up.
    fn hessian_structure(&self) -> &[(usize, usize)];
    /// Where to start.
    fn start(&self) -> &Start;
    /// f(x).
    fn objective(&mut self, x: &[f64]) -> f64;
    /// ∇f(x).
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]);
    /// g(x).
    fn constraints(&mut self, x: &[f64], values: &mut [f64]);
    /// ∂g/∂x in the order of the structure.
    fn jacobian(&mut self, x: &[f64], entries: &mut [f64]);
    /// Hessian of `objective_factor · f + multipliers · g` in the order of the structure.
    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        entries: &mut [f64],
    );
}

/// First guess; with multipliers, a warm start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// Variables.
    pub x: Vec<f64>,
    /// Multipliers of a neighbouring solution.
    pub warm: Option<Multipliers>,
}

/// Lagrange multipliers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Multipliers {
    /// Of the constraints.
    pub constraints: Vec<f64>,
    /// Of the lower bounds, ≥ 0.
    pub lower: Vec<f64>,
    /// Of the upper bounds, ≥ 0.
    pub upper: Vec<f64>,
}

/// What a user may set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Scaled optimality and feasibility tolerance.
    pub tolerance: f64,
    /// Most iterations.
    pub max_iterations: usize,
    /// Where an interior-point solver stops lowering its barrier; 0 lets it go on to the bounds as far as it can. A value
    /// below the tolerance still meets the tolerance.
    pub least_barrier: f64,
}

impl Settings {
    /// Whether a solver can aim at this.
    fn possible(&self) -> bool {
        self.tolerance > 0.0
            && self.tolerance.is_finite()
            && (0.0..1.0).contains(&self.least_barrier)
    }
}

/// One iteration, as it is logged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Number, from 0.
    pub number: usize,
    /// Objective.
    pub objective: f64,
    /// Largest constraint violation.
    pub primal_infeasibility: f64,
    /// Largest violation of the stationarity condition.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Whether the solver is restoring feasibility.
    pub restoring: bool,
}

/// Sees every iteration; `false` ends the solve.
pub type Monitor = Box<dyn FnMut(&Iteration) -> bool>;

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Converged to the tolerance.
    Solved,
    /// Converged to a hundred times the tolerance, not further.
    Acceptable,
    /// Converged to a point where the constraints are least violated, but are.
    Infeasible,
    /// Iterations used up.
    IterationLimit,
    /// The monitor ended it.
    Stopped,
    /// No further progress: restoration or step computation failed.
    Stalled,
    /// The problem was refused, or a function is not a number at the start.
    Invalid,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Solved => "solved",
            Self::Acceptable => "acceptable",
            Self::Infeasible => "infeasible",
            Self::IterationLimit => "iteration limit",
            Self::Stopped => "stopped",
            Self::Stalled => "stalled",
            Self::Invalid => "invalid",
        })
    }
}

/// Where a solve ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How.
    pub status: Status,
    /// Variables.
    pub x: Vec<f64>,
    /// f(x).
    pub objective: f64,
    /// g(x).
    pub constraints: Vec<f64>,
    /// Multipliers.
    pub multipliers: Multipliers,
    /// Iterations used.
    pub iterations: usize,
}

impl Outcome {
    /// A solve that came to nothing.
    fn invalid(x: Vec<f64>) -> Self {
        Self {
            status: Status::Invalid,
            x,
            objective: f64::NAN,
            constraints: Vec::new(),
            multipliers: Multipliers::default(),
            iterations: 0,
        }
    }
}

/// A solver of [`NlpProblem`]s.
pub trait NlpSolver: Sync {
    /// Name and version, for reports.
    fn name(&self) -> &'static str;
    /// Solves from the problem's start; always returns where it ended.
    fn solve(&self, problem: Box<dyn NlpProblem>, settings: &Settings, monitor: Monitor)
    -> Outcome;
}
