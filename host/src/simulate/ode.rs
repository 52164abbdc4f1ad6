//! Ordinary differential equations x′ = f(t, x) with error control: one function used by everybody.
//!
//! Verner's "most efficient" pair of orders 7 and 6 in the crate `differential-equations`: the equations here are smooth, so
//! a high order pays, and samples come from its own interpolant without shortening steps. (The crate's DOP853 is quicker to
//! the end, but its interpolant lacks digits: 1.5e-5 at a tolerance of 1e-8 on a sine, where this one has 7e-10.)

use std::cell::Cell;

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
    /// It takes too many steps.
    #[error(
        "the motion cannot be computed beyond {time_s:.6} s: it takes too many steps at the accuracy asked for"
    )]
    Steps {
        /// Last time reached.
        time_s: f64,
    },
    /// Times or tolerances make no sense.
    #[error("{0}")]
    Input(&'static str),
}

/// Slope where f has none: steps that touch it are far beyond any tolerance, so they are rejected and shortened, and
/// the solution is followed up to where f ends. (NaN would pass the crate's error norm.)
const NO_SLOPE: f64 = 1e100;
/// States beyond this come from such slopes.
const LARGEST_STATE: f64 = 1e60;

/// Steps, rejected ones included, after which the integration gives up.
const MOST_STEPS: usize = 1_000_000;

/// Shortest step over the whole span: shorter ones would no longer change the time.
const SHORTEST_STEP: f64 = 1e-14;

struct System<F> {
    f: F,
    evaluations: Cell<usize>,
}

impl<F: Fn(f64, &[f64], &mut [f64]) -> Option<()>> ODE<f64, Vec<f64>> for System<F> {
    fn diff(&self, t: f64, y: &Vec<f64>, dydt: &mut Vec<f64>) {
        self.evaluations.set(self.evaluations.get() + 1);
        let defined = (self.f)(t, y, dydt).is_some();
        if !defined || dydt.iter().any(|x| !x.is_finite()) {
            dydt.fill(NO_SLOPE);
        }
    }
}

/// Takes the samples from the dense output.
struct Sampler<'a> {
    wanted_s: &'a [f64],
    samples: Samples,
    reached_s: f64,
    lost: bool,
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
        if y.iter().any(|x| x.is_nan() || x.abs() > LARGEST_STATE) {
            self.lost = true;
            return ControlFlag::Terminate;
        }
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
        lost: false,
    };
    if to_s > from_s {
        let absolute: Vec<f64> = tolerance
            .scale
            .iter()
            .map(|s| s * tolerance.relative)
            .collect();
        let mut method = ExplicitRungeKutta::rkv766e()
            .rtol(tolerance.relative)
            .atol(absolute)
            .h_min((to_s - from_s) * SHORTEST_STEP)
            .max_steps(MOST_STEPS);
        let system = System {
            f,
            evaluations: Cell::new(0),
        };
        let start = start.to_vec();
        let result = solve_ode(&mut method, &system, from_s, to_s, &start, &mut sampler);
        sampler.samples.evaluations = system.evaluations.get();
        let time_s = sampler.reached_s;
        match result {
            Ok(_) if sampler.lost => return Err(OdeError::Undefined { time_s }),
            Ok(_) => {}
            // What is left is shorter than the shortest step.
            Err(_) if !sampler.lost && to_s - time_s <= (to_s - from_s) * SHORTEST_STEP => {}
            // The crate calls it stiffness when a hundred steps in a row are rejected.
            Err(Error::StepSize { .. } | Error::Stiffness { .. }) => {
                return Err(OdeError::Undefined { time_s });
            }
            Err(_) => return Err(OdeError::Steps { time_s }),
        }
    }
    // The last step may end an ulp before the end.
    let end = sampler.samples.end.clone();
    sampler.samples.states.resize(times_s.len(), end);
    Ok(sampler.samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tolerance(relative: f64) -> Tolerance {
        Tolerance {
            relative,
            scale: vec![1.0; 2],
        }
    }

    fn oscillator(_: f64, x: &[f64], slope: &mut [f64]) -> Option<()> {
        slope.copy_from_slice(&[x[1], -x[0]]);
        Some(())
    }

    #[test]
    fn samples_between_the_steps_are_as_exact_as_the_end() {
        let times: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.1).collect();
        let solution = integrate(
            oscillator,
            (0.0, 10.0),
            &[0.0, 1.0],
            &tolerance(1e-10),
            &times,
        )
        .expect("smooth");
        assert_eq!(solution.states.len(), times.len());
        for (time, state) in times.iter().zip(&solution.states) {
            assert!((state[0] - time.sin()).abs() < 1e-8, "{time}");
            assert!((state[1] - time.cos()).abs() < 1e-8, "{time}");
        }
        assert!((solution.end[0] - 10.0_f64.sin()).abs() < 1e-9);
        assert!((10..2000).contains(&solution.evaluations));
    }

    /// x′ = √(1 − t) ends at t = 1: the solution is followed up to there.
    #[test]
    fn the_end_of_the_equations_is_an_error_with_its_time() {
        let f = |t: f64, _: &[f64], slope: &mut [f64]| {
            slope.fill((t < 1.0).then(|| (1.0 - t).sqrt())?);
            Some(())
        };
        let error = integrate(f, (0.0, 2.0), &[0.0, 0.0], &tolerance(1e-8), &[]);
        let Err(OdeError::Undefined { time_s }) = error else {
            unreachable!("{error:?}");
        };
        assert!((time_s - 1.0).abs() < 1e-6, "{time_s}");
    }

    #[test]
    fn nonsense_is_refused() {
        let run = |span, relative, times: &[f64]| {
            integrate(oscillator, span, &[0.0, 1.0], &tolerance(relative), times).is_err()
        };
        assert!(!run((0.0, 1.0), 1e-6, &[0.5]));
        assert!(run((1.0, 0.0), 1e-6, &[]));
        assert!(run((0.0, f64::NAN), 1e-6, &[]));
        assert!(run((0.0, 1.0), 0.0, &[]));
        assert!(run((0.0, 1.0), 1e-6, &[0.5, 0.2]));
        assert!(run((0.0, 1.0), 1e-6, &[1.5]));
    }
}
