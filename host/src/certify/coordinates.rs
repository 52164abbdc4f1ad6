//! The machine's coordinates as shipped beside a trajectory: what elastic displacement and stress depend on.

use crate::ocp::Solution;
use serde::{Deserialize, Serialize};
use stillpoint_shared::Trajectory;

/// Values of all generalised coordinates at the support points, f32, on the intervals and points of a trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coordinates {
    /// Number of coordinates.
    pub count: u8,
    /// Interval after interval, node after node: N + 1 rows of `count` values each, in the units of the machine.
    pub values: Vec<f32>,
}

impl Coordinates {
    /// The coordinates of a solution of a move with `axes` axes: states are torques, coordinates, rates.
    #[must_use]
    pub fn of(solution: &Solution, axes: usize) -> Self {
        let count = (solution.states.nrows() - axes) / 2;
        let mut values = Vec::new();
        let mut first = 0;
        for rule in &solution.rules {
            for node in first..=first + rule.points() {
                let state = solution.states.column(node);
                values.extend(state.iter().skip(axes).take(count).map(|&q| q as f32));
            }
            first += rule.points();
        }
        Self {
            count: count as u8,
            values,
        }
    }

    /// How many values go with a trajectory.
    pub(super) fn expected(&self, trajectory: &Trajectory) -> usize {
        let rows: usize = trajectory.intervals().map(|i| i.points + 1).sum();
        rows * usize::from(self.count)
    }
}
