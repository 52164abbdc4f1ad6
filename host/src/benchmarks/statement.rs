//! Problems written down briefly: states with their ends, controls, a cost at the end.

use crate::autodiff::Scalar;
use crate::ocp::{Bounds, Exact, Model, OptimalControlProblem, Quantity, Sizes};

/// A state: its name, its value at start and end (bounds), and its bounds all along.
pub(super) struct State {
    name: &'static str,
    initial: Bounds,
    terminal: Bounds,
    always: Bounds,
}

impl State {
    /// A state that starts at `from` and is free otherwise.
    pub(super) const fn from(name: &'static str, from: f64) -> Self {
        Self {
            name,
            initial: Bounds::fixed(from),
            terminal: Bounds::FREE,
            always: Bounds::FREE,
        }
    }

    /// The same state, ending at `to`.
    pub(super) const fn to(self, to: f64) -> Self {
        Self {
            terminal: Bounds::fixed(to),
            ..self
        }
    }

    /// The same state, bounded.
    pub(super) const fn within(self, lower: f64, upper: f64) -> Self {
        Self {
            always: Bounds::new(lower, upper),
            ..self
        }
    }
}

/// What is minimised at the end, in addition to the running cost.
#[derive(Clone, Copy)]
pub(super) enum Cost {
    /// Nothing.
    None,
    /// T.
    Duration,
    /// −xᵢ(T).
    Minus(usize),
}

struct End {
    states: usize,
    cost: Cost,
}

impl Model for End {
    fn variables(&self) -> usize {
        2 * self.states + 1
    }
    fn values(&self) -> usize {
        1
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = match self.cost {
            Cost::None => S::constant(0.0),
            Cost::Duration => z[2 * self.states],
            Cost::Minus(state) => -z[self.states + state],
        };
    }
}

/// A problem without path and end functions; `stage` gives f and then L.
pub(super) fn problem(
    stage: impl Model + 'static,
    cost: Cost,
    states: Vec<State>,
    controls: Vec<(&'static str, Bounds)>,
    duration_s: Bounds,
) -> OptimalControlProblem {
    let end = End {
        states: states.len(),
        cost,
    };
    OptimalControlProblem {
        sizes: Sizes {
            states: states.len(),
            controls: controls.len(),
            path: 0,
            endpoint: 0,
        },
        stage: Box::new(Exact::new(stage)),
        endpoint: Box::new(Exact::new(end)),
        initial: states.iter().map(|state| state.initial).collect(),
        terminal: states.iter().map(|state| state.terminal).collect(),
        states: (states.iter())
            .map(|state| Quantity::new(state.name, state.always))
            .collect(),
        controls: (controls.into_iter())
            .map(|(name, bounds)| Quantity::new(name, bounds))
            .collect(),
        path: vec![],
        ends: vec![],
        rates: vec![],
        guards: vec![],
        duration_s,
    }
}
