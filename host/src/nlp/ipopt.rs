//! Ipopt through `ipopt-sys`, for whoever has it installed: cargo feature `ipopt`.
//!
//! The only unsafe code of this crate. `ipopt-sys` binds a C shim around Ipopt's TNLP; the rules
//! that keep it sound:
//! - the shim hands every callback the [`Session`] that [`Problem::solve`] gave it, and nothing
//!   else touches it meanwhile;
//! - Ipopt does not check indices, so structures are checked and converted once, before it sees
//!   them;
//! - a panic ends in the callback it happens in, and the solve ends as [`Status::Invalid`].
//!
//! As for any Ipopt, a file `ipopt.opt` in the working directory overrides options: the way to
//! choose a linear solver.
#![allow(unsafe_code)]

mod session;

use super::warm::WarmStart;
use super::{Iteration, Monitor, Multipliers, NlpProblem, NlpSolver, Outcome, Settings, Status};
use ipopt_sys as sys;
use session::{Entries, Session};
use std::ffi::CStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::{Mutex, PoisonError};
use sys::{
    CNLP_Bool as Bool, CNLP_Index as Index, CNLP_Number as Number, CNLP_UserDataPtr as UserData,
};

/// Ipopt, with whatever linear solver it was built with (Debian: MUMPS).
#[derive(Clone, Copy, Debug, Default)]
pub struct Ipopt;

/// MUMPS keeps state in globals, and Ipopt guards it only since 3.14: solves take turns.
static TURN: Mutex<()> = Mutex::new(());

impl NlpSolver for Ipopt {
    fn name(&self) -> &'static str {
        // The shim has no way to ask the library for its version.
        "ipopt (ipopt-sys 0.6)"
    }

    fn solve(
        &self,
        problem: Box<dyn NlpProblem>,
        settings: &Settings,
        monitor: Monitor,
    ) -> Outcome {
        let x = problem.start().x.clone();
        let Some(mut session) = Session::new(problem, monitor) else {
            return Outcome::invalid(x);
        };
        let warm = WarmStart::of(&mut *session.problem, settings);
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(mut ipopt) = Problem::new() else {
            return Outcome::invalid(x);
        };
        // What it refuses it would complain about on standard output.
        if !settings.possible() || !ipopt.configure(settings, warm) {
            return Outcome::invalid(x);
        }
        ipopt.solve(&mut session)
    }
}

/// The shim's problem; owned.
struct Problem(sys::CNLP_ProblemPtr);

impl Drop for Problem {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `cnlp_create_problem` and is freed here only.
        unsafe { sys::cnlp_free_problem(self.0) }
    }
}

impl Problem {
    fn new() -> Option<Self> {
        const C_INDICES: Index = 0;
        let mut pointer = ptr::null_mut();
        // SAFETY: `pointer` outlives the call. The shim keeps the callbacks and calls them only
        // during `cnlp_solve`.
        let status = unsafe {
            sys::cnlp_create_problem(
                &raw mut pointer,
                C_INDICES,
                Some(sizes),
                Some(initial),
                Some(bounds),
                Some(objective),
                Some(constraints),
                Some(gradient),
                Some(jacobian),
                Some(hessian),
                None,
            )
        };
        let created = status == sys::CNLP_CreateProblemStatus_CNLP_SUCCESS && !pointer.is_null();
        created.then_some(Self(pointer))
    }

    /// Whether the solver took all options.
    fn configure(&mut self, settings: &Settings, warm: Option<WarmStart>) -> bool {
        let iterations = Index::try_from(settings.max_iterations).unwrap_or(Index::MAX);
        let mut taken = self.text(c"sb", c"yes")
            && self.integer(c"print_level", 0)
            && self.integer(c"max_iter", iterations)
            && self.number(c"tol", settings.tolerance)
            && self.number(c"acceptable_tol", settings.tolerance * 100.0)
            && self.number(c"mu_target", settings.least_barrier)
            // The solver would relax bounds by 1e-8: limits are limits.
            && self.number(c"bound_relax_factor", 0.0);
        if let Some(WarmStart { barrier, distance }) = warm {
            taken = taken
                && self.text(c"warm_start_init_point", c"yes")
                && self.number(c"warm_start_bound_push", distance)
                && self.number(c"warm_start_bound_frac", distance)
                && self.number(c"warm_start_slack_bound_push", distance)
                && self.number(c"warm_start_slack_bound_frac", distance)
                && self.number(c"warm_start_mult_bound_push", distance)
                && self.number(c"mu_init", barrier);
        }
        taken
    }

    fn text(&mut self, key: &CStr, value: &CStr) -> bool {
        // SAFETY: the problem is alive; the shim copies both strings.
        unsafe { sys::cnlp_add_str_option(self.0, key.as_ptr(), value.as_ptr()) != 0 }
    }

    fn number(&mut self, key: &CStr, value: f64) -> bool {
        // SAFETY: the problem is alive; the shim copies the string.
        unsafe { sys::cnlp_add_num_option(self.0, key.as_ptr(), value) != 0 }
    }

    fn integer(&mut self, key: &CStr, value: Index) -> bool {
        // SAFETY: the problem is alive; the shim copies the string.
        unsafe { sys::cnlp_add_int_option(self.0, key.as_ptr(), value) != 0 }
    }

    fn solve(&mut self, session: &mut Session) -> Outcome {
        // SAFETY: the problem is alive; the callback has the type it is called with.
        unsafe { sys::cnlp_set_intermediate_callback(self.0, Some(iteration)) };
        // SAFETY: the session outlives the call and is reached through this pointer only until it
        // returns.
        let end = unsafe { sys::cnlp_solve(self.0, (&raw mut *session).cast()) };
        let status = translate(end.status);
        // Then the shim may hold nothing at all.
        if session.panicked || status == Status::Invalid {
            return Outcome {
                iterations: session.iterations,
                ..Outcome::invalid(std::mem::take(&mut session.x))
            };
        }
        let (n, m) = (session.variables, session.constraints);
        // SAFETY: a status other than invalid means that the shim asked for the sizes, and then it
        // holds arrays of n and m numbers until the problem is freed, which `self` keeps from
        // happening before they are copied.
        let copy = |data: *const Number, length| unsafe { input(data, length) }.to_vec();
        Outcome {
            status,
            x: copy(end.data.x, n),
            objective: end.obj_val,
            constraints: copy(end.g, m),
            multipliers: Multipliers {
                constraints: copy(end.data.mult_g, m),
                lower: copy(end.data.mult_x_L, n),
                upper: copy(end.data.mult_x_U, n),
            },
            iterations: session.iterations,
        }
    }
}

fn translate(status: sys::CNLP_ApplicationReturnStatus) -> Status {
    use ipopt_sys as s;
    match status {
        s::CNLP_ApplicationReturnStatus_CNLP_SOLVE_SUCCEEDED
        | s::CNLP_ApplicationReturnStatus_CNLP_FEASIBLE_POINT_FOUND => Status::Solved,
        s::CNLP_ApplicationReturnStatus_CNLP_SOLVED_TO_ACCEPTABLE_LEVEL => Status::Acceptable,
        s::CNLP_ApplicationReturnStatus_CNLP_INFEASIBLE_PROBLEM_DETECTED => Status::Infeasible,
        s::CNLP_ApplicationReturnStatus_CNLP_MAXIMUM_ITERATIONS_EXCEEDED => Status::IterationLimit,
        s::CNLP_ApplicationReturnStatus_CNLP_USER_REQUESTED_STOP => Status::Stopped,
        s::CNLP_ApplicationReturnStatus_CNLP_SEARCH_DIRECTION_BECOMES_TOO_SMALL
        | s::CNLP_ApplicationReturnStatus_CNLP_DIVERGING_ITERATES
        | s::CNLP_ApplicationReturnStatus_CNLP_RESTORATION_FAILED
        | s::CNLP_ApplicationReturnStatus_CNLP_ERROR_IN_STEP_COMPUTATION => Status::Stalled,
        _ => Status::Invalid,
    }
}

/// An array of the solver; empty where it has none.
///
/// # Safety
/// `data` is null or valid for reading `length` numbers as long as the slice is used.
unsafe fn input<'a>(data: *const Number, length: Index) -> &'a [Number] {
    match usize::try_from(length) {
        // SAFETY: by this function's contract.
        Ok(length) if length > 0 && !data.is_null() => unsafe {
            std::slice::from_raw_parts(data, length)
        },
        _ => &[],
    }
}

/// An array of the solver to write to, cleared first: what it allocates is not initialised.
///
/// # Safety
/// `data` is null or valid for writing `length` items as long as the slice is used, and nothing
/// else refers to it.
unsafe fn output<'a, T: Zeroable>(data: *mut T, length: Index) -> &'a mut [T] {
    match usize::try_from(length) {
        Ok(length) if length > 0 && !data.is_null() => {
            // SAFETY: by this function's contract, and zero bytes are a value of every `Zeroable`.
            unsafe {
                data.write_bytes(0, length);
                std::slice::from_raw_parts_mut(data, length)
            }
        }
        _ => &mut [],
    }
}

/// Hands over a structure.
///
/// # Safety
/// Both are null or valid for writing `count` integers, and do not overlap.
unsafe fn hand_over(
    entries: &Entries,
    rows: *mut Index,
    columns: *mut Index,
    count: Index,
) -> bool {
    // SAFETY: by this function's contract.
    let (rows, columns) = unsafe { (output(rows, count), output(columns, count)) };
    rows.copy_from_slice(&entries.rows);
    columns.copy_from_slice(&entries.columns);
    true
}

/// Types for which zero bytes are a value.
trait Zeroable {}
impl Zeroable for Number {}
impl Zeroable for Index {}

fn all_finite(values: &[Number]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Runs a callback's work: 1 for `true`, 0 for `false` and for a panic, after which nothing runs
/// any more.
///
/// # Safety
/// `user_data` is the session given to `cnlp_solve`, and no other callback is running.
unsafe fn run(user_data: UserData, work: impl FnOnce(&mut Session) -> bool) -> Bool {
    // SAFETY: by this function's contract.
    let session = unsafe { &mut *user_data.cast::<Session>() };
    if session.panicked {
        return 0;
    }
    let done = catch_unwind(AssertUnwindSafe(|| work(session)));
    session.panicked = done.is_err();
    Bool::from(done.unwrap_or(false))
}

unsafe extern "C" fn sizes(
    n: *mut Index,
    m: *mut Index,
    jacobian: *mut Index,
    hessian: *mut Index,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session and four integers of its own; it reads them even after a
    // refusal, so they are always written.
    unsafe {
        let session = &*user_data.cast::<Session>();
        (*n, *m) = (session.variables, session.constraints);
        (*jacobian, *hessian) = (session.jacobian.count, session.hessian.count);
    }
    1
}

unsafe extern "C" fn initial(
    n: Index,
    wants_x: Bool,
    x: *mut Number,
    wants_z: Bool,
    lower: *mut Number,
    upper: *mut Number,
    m: Index,
    wants_lambda: Bool,
    lambda: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session, and arrays of n and m numbers where it wants them
    // filled.
    unsafe {
        run(user_data, |session| {
            let start = session.problem.start();
            if wants_x != 0 {
                output(x, n).copy_from_slice(&start.x);
            }
            let Some(warm) = &start.warm else {
                return wants_z == 0 && wants_lambda == 0;
            };
            if wants_z != 0 {
                output(lower, n).copy_from_slice(&warm.lower);
                output(upper, n).copy_from_slice(&warm.upper);
            }
            if wants_lambda != 0 {
                output(lambda, m).copy_from_slice(&warm.constraints);
            }
            true
        })
    }
}

unsafe extern "C" fn bounds(
    n: Index,
    x_lower: *mut Number,
    x_upper: *mut Number,
    m: Index,
    g_lower: *mut Number,
    g_upper: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session and arrays of n and m numbers.
    unsafe {
        run(user_data, |session| {
            let write = |all: &[crate::ocp::Bounds], lower: &mut [Number], upper: &mut [Number]| {
                for (bounds, (lower, upper)) in all.iter().zip(lower.iter_mut().zip(upper)) {
                    (*lower, *upper) = (bounds.lower, bounds.upper);
                }
            };
            write(
                session.problem.variable_bounds(),
                output(x_lower, n),
                output(x_upper, n),
            );
            write(
                session.problem.constraint_bounds(),
                output(g_lower, m),
                output(g_upper, m),
            );
            true
        })
    }
}

unsafe extern "C" fn objective(
    n: Index,
    x: *const Number,
    _new_x: Bool,
    value: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session, n numbers and one to write to.
    unsafe {
        run(user_data, |session| {
            *value = session.problem.objective(input(x, n));
            (*value).is_finite()
        })
    }
}

unsafe extern "C" fn gradient(
    n: Index,
    x: *const Number,
    _new_x: Bool,
    values: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session and two arrays of n numbers.
    unsafe {
        run(user_data, |session| {
            let (x, values) = (input(x, n), output(values, n));
            // Trial points need values only.
            session.x.copy_from_slice(x);
            session.problem.gradient(x, values);
            all_finite(values)
        })
    }
}

unsafe extern "C" fn constraints(
    n: Index,
    x: *const Number,
    _new_x: Bool,
    m: Index,
    values: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session and arrays of n and m numbers.
    unsafe {
        run(user_data, |session| {
            let values = output(values, m);
            session.problem.constraints(input(x, n), values);
            all_finite(values)
        })
    }
}

unsafe extern "C" fn jacobian(
    n: Index,
    x: *const Number,
    _new_x: Bool,
    _m: Index,
    count: Index,
    rows: *mut Index,
    columns: *mut Index,
    values: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session and either two arrays of `count` integers, or n numbers
    // and `count` numbers.
    unsafe {
        run(user_data, |session| {
            if values.is_null() {
                return hand_over(&session.jacobian, rows, columns, count);
            }
            let values = output(values, count);
            session.problem.jacobian(input(x, n), values);
            all_finite(values)
        })
    }
}

unsafe extern "C" fn hessian(
    n: Index,
    x: *const Number,
    _new_x: Bool,
    objective_factor: Number,
    m: Index,
    lambda: *const Number,
    _new_lambda: Bool,
    count: Index,
    rows: *mut Index,
    columns: *mut Index,
    values: *mut Number,
    user_data: UserData,
) -> Bool {
    // SAFETY: as for the Jacobian, with m multipliers besides.
    unsafe {
        run(user_data, |session| {
            if values.is_null() {
                return hand_over(&session.hessian, rows, columns, count);
            }
            let values = output(values, count);
            session
                .problem
                .hessian(input(x, n), objective_factor, input(lambda, m), values);
            all_finite(values)
        })
    }
}

unsafe extern "C" fn iteration(
    mode: sys::CNLP_AlgorithmMode,
    number: Index,
    objective: Number,
    primal_infeasibility: Number,
    dual_infeasibility: Number,
    barrier: Number,
    _step: Number,
    _regularisation: Number,
    _dual_step_length: Number,
    _primal_step_length: Number,
    _trials: Index,
    user_data: UserData,
) -> Bool {
    // SAFETY: the shim passes the session.
    unsafe {
        run(user_data, |session| {
            let number = usize::try_from(number).unwrap_or(0);
            session.iterations = number;
            (session.monitor)(&Iteration {
                number,
                objective,
                primal_infeasibility,
                dual_infeasibility,
                barrier,
                restoring: mode == sys::CNLP_AlgorithmMode_CNLP_RESTORATION_PHASE_MODE,
            })
        })
    }
}
