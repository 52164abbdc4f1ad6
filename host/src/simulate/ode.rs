//! Ordinary differential equations x′ = f(t, x) with error control: one function used by everybody.
//!
//! DOP853 of Hairer, Nørsett and Wanner in the crate `differential-equations`: order 8 suits the smooth equations
//! here, and its dense output of order 7 gives samples without shortening steps.

use differential_equations::control::ControlFlag;
use differential_equations::error::Error;
use differential_equations::interpolate::Interpolation;
use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::ode::{ODE, solve_ode};
use differential_equations::solout::Solout;
use differential_equations::solution::Solution;

/// How far a solution may stray.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Error per step allowed, relative to the component's size plus its scale.
    pub relative: f64,
    /// Size that matters, per component; errors far below `relative` times this are not looked at.
    pub scale: Vec<f64>,
}

/// A solution at the times asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// The times asked for.
    pub time_s: Vec<f64>,
    /// The states at these times.
    pub states: Vec<Vec<f64>>,
    /// State at the end.
    pub end: Vec<f64>,
    /// Number of evaluations of f.
    pub evaluations: usize,
}

/// Why a differential equation could not be solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OdeError {
    /// f has no value at the state reached.
    #[error(
        "the motion cannot be continued beyond {time_s:.6} s: the equations have no solution there"
    )]
    Undefined {
        /// Last time reached.
        time_s: f64,
    },
    /// The steps became too many or too small.
    #[error(
        "the motion cannot be computed beyond {time_s:.6} s to the accuracy asked for: {reason}"
    )]
    Stuck {
        /// Last time reached.
        time_s: f64,
        /// What happened.
        reason: &'static str,
    },
    /// Times or tolerances make no sense.
    #[error("{0}")]
    Input(&'static str),
}

struct System<F>(F);

impl<F: Fn(f64, &[f64], &mut [f64]) -> Option<()>> ODE<f64, Vec<f64>> for System<F> {
    fn diff(&self, t: f64, y: &Vec<f64>, dydt: &mut Vec<f64>) {
        if (self.0)(t, y, dydt).is_none() {
            // A step into NaN is rejected and halved, so the solution is followed up to where f ends.
            dydt.fill(f64::NAN);
        }
    }
}

/// Takes the samples from the dense output.
struct Sampler<'a> {
    wanted_s: &'a [f64],
    samples: Samples,
    reached_s: f64,
}

impl Solout<f64, Vec<f64>> for Sampler<'_> {
    fn solout<I>(
        &mut self,
        t: f64,
        _t_prev: f64,
        y: &Vec<f64>,
        _y_prev: &Vec<f64>,
        interpolator: &mut I,
        _solution: &mut Solution<f64, Vec<f64>>,
    ) -> ControlFlag<f64, Vec<f64>>
    where
        I: Interpolation<f64, Vec<f64>> + ?Sized,
    {
        while let Some(&wanted) = self.wanted_s.get(self.samples.states.len()) {
            if wanted > t {
                break;
            }
            // Before the first step there is nothing to interpolate.
            let state = (wanted < t).then(|| interpolator.interpolate(wanted).ok());
            self.samples
                .states
                .push(state.flatten().unwrap_or_else(|| y.clone()));
        }
        self.reached_s = t;
        self.samples.end.clone_from(y);
        ControlFlag::Continue
    }
}

/// Integrates x′ = f(t, x) from `from_s` to `to_s`, sampled at `times_s` (ascending, within the span).
///
/// `f` writes x′ and returns `None` where it has no value.
///
/// # Errors
/// [`OdeError`]: the motion up to there is lost, what is returned says where.
pub fn integrate(
    f: impl Fn(f64, &[f64], &mut [f64]) -> Option<()>,
    (from_s, to_s): (f64, f64),
    start: &[f64],
    tolerance: &Tolerance,
    times_s: &[f64],
) -> Result<Samples, OdeError> {
    let sensible = tolerance.relative > 0.0
        && tolerance.scale.len() == start.len()
        && tolerance.scale.iter().all(|s| *s > 0.0)
        && start.iter().all(|x| x.is_finite());
    if !sensible {
        return Err(OdeError::Input(
            "tolerances must be positive, one scale per state, and the state finite",
        ));
    }
    let in_order = times_s.iter().all(|t| (from_s..=to_s).contains(t)) && times_s.is_sorted();
    if !in_order || from_s.partial_cmp(&to_s).is_none_or(|o| o.is_gt()) {
        return Err(OdeError::Input(
            "sampling times must ascend and lie between start and end",
        ));
    }
    let mut sampler = Sampler {
        wanted_s: times_s,
        samples: Samples {
            time_s: times_s.to_vec(),
            states: Vec::with_capacity(times_s.len()),
            end: start.to_vec(),
            evaluations: 0,
        },
        reached_s: from_s,
    };
    if to_s > from_s {
        let absolute: Vec<f64> = tolerance
            .scale
            .iter()
            .map(|s| s * tolerance.relative)
            .collect();
        let mut method = ExplicitRungeKutta::dop853()
            .rtol(tolerance.relative)
            .atol(absolute);
        let system = System(f);
        let start = start.to_vec();
        let result = solve_ode(&mut method, &system, from_s, to_s, &start, &mut sampler);
        let reached_s = sampler.reached_s;
        match result {
            Ok(solution) => sampler.samples.evaluations = solution.evals.function,
            Err(error) => {
                let mut slope = vec![0.0; start.len()];
                let end = &sampler.samples.end;
                let defined = (system.0)(reached_s, end, &mut slope).is_some();
                return Err(match error {
                    Error::StepSize { .. } if !defined || slope.iter().all(|x| x.is_finite()) => {
                        OdeError::Undefined { time_s: reached_s }
                    }
                    Error::StepSize { .. } => stuck(reached_s, "the steps became too small"),
                    Error::MaxSteps { .. } => stuck(reached_s, "too many steps"),
                    Error::Stiffness { .. } => stuck(reached_s, "the equations are stiff"),
                    _ => stuck(reached_s, "the solver gave up"),
                });
            }
        }
    }
    // The last step may end an ulp before the end.
    let end = sampler.samples.end.clone();
    sampler.samples.states.resize(times_s.len(), end);
    Ok(sampler.samples)
}

fn stuck(time_s: f64, reason: &'static str) -> OdeError {
    OdeError::Stuck { time_s, reason }
}
