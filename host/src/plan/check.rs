//! Is the answer true? A check that the solver knows nothing of: the dynamics integrated with error control under the
//! interpolated control.

use crate::ocp::{OptimalControlProblem, Solution};
use crate::simulate::ode::{OdeError, Tolerance, integrate};

/// Relative accuracy of the integration.
const INTEGRATION_TOLERANCE: f64 = 1e-10;

/// Where the machine really ends, against where it should.
#[derive(Clone, Debug, PartialEq)]
pub struct EndMiss {
    /// State by state, in the order of the problem.
    pub states: Vec<StateMiss>,
}

/// How far one state misses its planned end.
#[derive(Clone, Debug, PartialEq)]
pub struct StateMiss {
    /// Name, with unit.
    pub name: String,
    /// Reached minus planned, in the state's own unit.
    pub miss: f64,
    /// Between which values the plan moves it, in the same unit.
    pub range: f64,
    /// Whether it is a coordinate of the machine, not a torque or a rate.
    pub coordinate: bool,
}

impl StateMiss {
    /// Share of its range by which the state misses; 0 for a state that the plan does not move.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.range > 0.0 {
            self.miss.abs() / self.range
        } else {
            0.0
        }
    }
}

impl EndMiss {
    /// Largest miss of a coordinate, in its own unit (m, rad, 1/m).
    #[must_use]
    pub fn largest(&self) -> f64 {
        let coordinates = self.states.iter().filter(|state| state.coordinate);
        coordinates.fold(0.0, |m, state| m.max(state.miss.abs()))
    }

    /// The coordinate that misses by the largest share of its range.
    #[must_use]
    pub fn worst(&self) -> Option<&StateMiss> {
        let coordinates = self.states.iter().filter(|state| state.coordinate);
        coordinates.max_by(|a, b| a.relative().total_cmp(&b.relative()))
    }
}

/// Integrates ẋ = f(x, u(t)) over every interval in turn and compares the end with the planned one.
///
/// # Errors
/// [`OdeError`] when the machine cannot follow the control to the end.
pub fn end_miss(problem: &OptimalControlProblem, solution: &Solution) -> Result<EndMiss, OdeError> {
    let sizes = problem.sizes;
    let mut state: Vec<f64> = solution.states.column(0).iter().copied().collect();
    let tolerance = Tolerance {
        relative: INTEGRATION_TOLERANCE,
        scale: (0..sizes.states)
            .map(|i| solution.states.row(i).amax().max(1e-6))
            .collect(),
    };
    let mut start_share = 0.0;
    for (interval, spec) in solution.mesh.intervals().iter().enumerate() {
        let length_s = spec.fraction * solution.duration_s;
        let middle = solution.place(start_share + spec.fraction / 2.0);
        debug_assert_eq!(middle.interval, interval);
        let f = |time_s: f64, x: &[f64], slope: &mut [f64]| {
            let mut place = middle;
            place.local = 2.0 * time_s / length_s - 1.0;
            let z: Vec<f64> = x
                .iter()
                .copied()
                .chain(solution.control_at(place))
                .collect();
            let mut values = vec![0.0; sizes.stage_values()];
            problem.stage.values(&z, &mut values);
            slope.copy_from_slice(&values[..sizes.states]);
            slope.iter().all(|s| s.is_finite()).then_some(())
        };
        state = integrate(f, (0.0, length_s), &state, &tolerance, &[])?.end;
        start_share += spec.fraction;
    }
    let planned = solution.states.column(solution.states.ncols() - 1);
    let coordinates = (sizes.states - sizes.controls) / 2;
    let states = problem.states.iter().zip(&state).enumerate();
    Ok(EndMiss {
        states: states
            .map(|(index, (quantity, reached))| {
                let row = solution.states.row(index);
                StateMiss {
                    name: quantity.name.clone(),
                    miss: reached - planned[index],
                    range: row.max() - row.min(),
                    coordinate: (sizes.controls..sizes.controls + coordinates).contains(&index),
                }
            })
            .collect(),
    })
}
