//! Pounce, a pure-Rust primal–dual interior-point solver of Ipopt's design: the default, needs no
//! system library.

use super::warm::WarmStart;
use super::{Iteration, Monitor, Multipliers, NlpProblem, NlpSolver, Outcome, Settings, Status};
use pounce_rs::pounce_algorithm::application::{
    default_backend_factory_with_sink, feral_config_from_options,
};
use pounce_rs::pounce_common::SolverException;
use pounce_rs::pounce_restoration::resto_alg_builder::RestoAlgorithmBuilder;
use pounce_rs::pounce_restoration::resto_inner_solver::make_default_restoration_factory_provider;
use pounce_rs::{
    AlgorithmMode, ApplicationReturnStatus, BoundsInfo, IndexStyle, IpoptApplication, IpoptCq,
    IpoptData, IterStats, NlpInfo, Solution, SparsityRequest, StartingPoint, TNLP,
};
use std::cell::RefCell;
use std::rc::Rc;

/// The default solver.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pounce;

/// Pounce's view of a problem.
struct Adapter {
    problem: Box<dyn NlpProblem>,
    monitor: Monitor,
    outcome: Option<Outcome>,
    /// Iterations of finished runs and of the present one: the solver may begin anew by itself and counts from zero then.
    before: usize,
    present: usize,
    /// The last one that the monitor saw.
    seen: Option<usize>,
    max_iterations: usize,
    /// Whether the iterations, not the monitor, ended the solve.
    used_up: bool,
    /// Where the constraints were last evaluated, and the largest violation there.
    x: Vec<f64>,
    violation: f64,
}

impl NlpSolver for Pounce {
    fn name(&self) -> &'static str {
        "pounce 0.14.0"
    }

    fn solve(
        &self,
        mut problem: Box<dyn NlpProblem>,
        settings: &Settings,
        monitor: Monitor,
    ) -> Outcome {
        let x = problem.start().x.clone();
        let warm = WarmStart::of(&mut *problem, settings);
        let mut app = IpoptApplication::new();
        if !settings.possible() || configure(&mut app, settings, warm).is_err() {
            return Outcome::invalid(x);
        }
        install_restoration(&mut app);
        let adapter = Rc::new(RefCell::new(Adapter {
            problem,
            monitor,
            outcome: None,
            before: 0,
            present: 0,
            seen: None,
            max_iterations: settings.max_iterations,
            used_up: false,
            x: x.clone(),
            violation: f64::NAN,
        }));
        let status = app.optimize_tnlp(Rc::clone(&adapter) as Rc<RefCell<dyn TNLP>>);
        let mut adapter = adapter.borrow_mut();
        let outcome = adapter.outcome.take();
        Outcome {
            status: if adapter.used_up {
                Status::IterationLimit
            } else {
                translate(status)
            },
            iterations: adapter.before + adapter.present,
            ..outcome.unwrap_or_else(|| Outcome::invalid(x))
        }
    }
}

fn configure(
    app: &mut IpoptApplication,
    settings: &Settings,
    warm: Option<WarmStart>,
) -> Result<(), SolverException> {
    app.initialize()?;
    let iterations = i32::try_from(settings.max_iterations).unwrap_or(i32::MAX);
    let options = app.options_mut();
    let mut text = |key, value| options.set_string_value(key, value, true, true);
    text("sb", "yes")?;
    // The solver refines the steps of the whole system itself; refining those of the factorised one
    // as well took about a tenth of the time. Without it, solves that need no restoration of
    // feasibility take the same iterations.
    text("feral_refine", "no")?;
    // Variables paired with their equations before ordering: a ninth fewer instructions for the paper's move, in as many
    // iterations. The solver looks at a matrix's shape to choose, and chooses otherwise here.
    text("feral_ordering_preprocess", "ldlt_compress")?;
    if warm.is_some() {
        text("warm_start_init_point", "yes")?;
    }
    let mut number = |key, value| options.set_numeric_value(key, value, true, true);
    number("tol", settings.tolerance)?;
    number("acceptable_tol", settings.tolerance * 100.0)?;
    number("mu_target", settings.least_barrier)?;
    // The solver would relax bounds by 1e-8: limits are limits.
    number("bound_relax_factor", 0.0)?;
    if let Some(WarmStart { barrier, distance }) = warm {
        for key in [
            "warm_start_bound_push",
            "warm_start_bound_frac",
            "warm_start_slack_bound_push",
            "warm_start_slack_bound_frac",
            "warm_start_mult_bound_push",
        ] {
            number(key, distance)?;
        }
        number("mu_init", barrier)?;
    }
    let mut integer = |key, value| options.set_integer_value(key, value, true, true);
    integer("print_level", 0)?;
    integer("max_iter", iterations)?;
    Ok(())
}

/// A new application has no restoration phase: without one, hard starts fail at the first blocked
/// line search.
fn install_restoration(app: &mut IpoptApplication) {
    let feral = feral_config_from_options(app.options());
    let sink = app.restoration_summary_sink();
    let ma57 =
        pounce_rs::pounce_algorithm::application::ma57_config_from_options(app.options(), "resto.");
    let builder = app.algorithm_builder_from_options();
    app.set_restoration_factory_provider(make_default_restoration_factory_provider(
        RestoAlgorithmBuilder::new(),
        builder,
        move || {
            let (feral, ma57, sink) = (feral.clone(), ma57.clone(), sink.clone());
            Box::new(move || {
                default_backend_factory_with_sink(feral.clone(), ma57.clone(), sink.clone())
            })
        },
    ));
}

fn translate(status: ApplicationReturnStatus) -> Status {
    use ApplicationReturnStatus as S;
    match status {
        S::SolveSucceeded | S::FeasiblePointFound => Status::Solved,
        S::SolvedToAcceptableLevel => Status::Acceptable,
        S::InfeasibleProblemDetected => Status::Infeasible,
        S::MaximumIterationsExceeded => Status::IterationLimit,
        S::UserRequestedStop => Status::Stopped,
        S::SearchDirectionBecomesTooSmall
        | S::DivergingIterates
        | S::RestorationFailed
        | S::ErrorInStepComputation => Status::Stalled,
        _ => Status::Invalid,
    }
}

fn fill_structure(structure: &[(usize, usize)], rows: &mut [i32], columns: &mut [i32]) {
    for ((row, column), &(r, c)) in rows.iter_mut().zip(columns).zip(structure) {
        *row = r as i32;
        *column = c as i32;
    }
}

impl TNLP for Adapter {
    fn get_nlp_info(&mut self) -> Option<NlpInfo> {
        let p = &self.problem;
        Some(NlpInfo {
            n: i32::try_from(p.variable_bounds().len()).ok()?,
            m: i32::try_from(p.constraint_bounds().len()).ok()?,
            nnz_jac_g: i32::try_from(p.jacobian_structure().len()).ok()?,
            nnz_h_lag: i32::try_from(p.hessian_structure().len()).ok()?,
            index_style: IndexStyle::C,
        })
    }

    fn get_bounds_info(&mut self, b: BoundsInfo<'_>) -> bool {
        for (i, bounds) in self.problem.variable_bounds().iter().enumerate() {
            (b.x_l[i], b.x_u[i]) = (bounds.lower, bounds.upper);
        }
        for (i, bounds) in self.problem.constraint_bounds().iter().enumerate() {
            (b.g_l[i], b.g_u[i]) = (bounds.lower, bounds.upper);
        }
        true
    }

    fn get_starting_point(&mut self, sp: StartingPoint<'_>) -> bool {
        let start = self.problem.start();
        sp.x.copy_from_slice(&start.x);
        if let Some(warm) = &start.warm {
            if sp.init_z {
                sp.z_l.copy_from_slice(&warm.lower);
                sp.z_u.copy_from_slice(&warm.upper);
            }
            if sp.init_lambda {
                sp.lambda.copy_from_slice(&warm.constraints);
            }
        }
        true
    }

    fn eval_f(&mut self, x: &[f64], _new_x: bool) -> Option<f64> {
        let value = self.problem.objective(x);
        value.is_finite().then_some(value)
    }

    fn eval_grad_f(&mut self, x: &[f64], _new_x: bool, gradient: &mut [f64]) -> bool {
        self.problem.gradient(x, gradient);
        true
    }

    fn eval_g(&mut self, x: &[f64], _new_x: bool, g: &mut [f64]) -> bool {
        self.problem.constraints(x, g);
        self.x.copy_from_slice(x);
        let bounds = self.problem.constraint_bounds().iter();
        let violations = bounds.zip(&*g).map(|(bounds, g)| bounds.violation(*g));
        self.violation = violations.fold(0.0, f64::max);
        g.iter().all(|value| value.is_finite())
    }

    fn eval_jac_g(&mut self, x: Option<&[f64]>, _new_x: bool, mode: SparsityRequest<'_>) -> bool {
        match (mode, x) {
            (SparsityRequest::Structure { irow, jcol }, _) => {
                fill_structure(self.problem.jacobian_structure(), irow, jcol);
            }
            (SparsityRequest::Values { values }, Some(x)) => self.problem.jacobian(x, values),
            (SparsityRequest::Values { .. }, None) => return false,
        }
        true
    }

    fn eval_h(
        &mut self,
        x: Option<&[f64]>,
        _new_x: bool,
        objective_factor: f64,
        multipliers: Option<&[f64]>,
        _new_multipliers: bool,
        mode: SparsityRequest<'_>,
    ) -> bool {
        match (mode, x, multipliers) {
            (SparsityRequest::Structure { irow, jcol }, _, _) => {
                fill_structure(self.problem.hessian_structure(), irow, jcol);
            }
            (SparsityRequest::Values { values }, Some(x), Some(multipliers)) => {
                self.problem
                    .hessian(x, objective_factor, multipliers, values);
            }
            _ => return false,
        }
        true
    }

    fn intermediate_callback(
        &mut self,
        stats: IterStats,
        _data: &IpoptData,
        _cq: &IpoptCq,
    ) -> bool {
        let restoring = stats.mode == AlgorithmMode::RestorationPhaseMode;
        // While restoring feasibility the solver reports the problem it solves for that, not ours.
        let (objective, primal_infeasibility) = if restoring {
            (self.problem.objective(&self.x), self.violation)
        } else {
            (stats.obj_value, stats.inf_pr)
        };
        if self.used_up {
            return false;
        }
        let present = usize::try_from(stats.iter).unwrap_or(0);
        let before = if present < self.present {
            self.before + self.present
        } else {
            self.before
        };
        let number = before + present;
        // A run that the solver begins by itself has to do with what is left.
        self.used_up =
            number > self.max_iterations || (before > 0 && number == self.max_iterations);
        if self.used_up {
            return false;
        }
        (self.before, self.present) = (before, present);
        // The iterate from which the solver restores feasibility comes twice.
        if self.seen.replace(number) == Some(number) {
            return true;
        }
        (self.monitor)(&Iteration {
            number,
            objective,
            primal_infeasibility,
            dual_infeasibility: stats.inf_du,
            barrier: stats.mu,
            restoring,
        })
    }

    fn finalize_solution(&mut self, s: Solution<'_>, _data: &IpoptData, _cq: &IpoptCq) {
        self.outcome = Some(Outcome {
            // The application knows the status and the number of iterations; the caller fills them
            // in.
            status: Status::Invalid,
            iterations: 0,
            x: s.x.to_vec(),
            objective: s.obj_value,
            constraints: s.g.to_vec(),
            multipliers: Multipliers {
                constraints: s.lambda.to_vec(),
                lower: s.z_l.to_vec(),
                upper: s.z_u.to_vec(),
            },
        });
    }
}
