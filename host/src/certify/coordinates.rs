//! The machine's coordinates as shipped beside a trajectory: what elastic displacement and stress depend on.

use super::CertifyError;
use crate::machine::Plant;
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
    /// `count` states of a solution from state `first_state` on.
    #[must_use]
    pub fn of(solution: &Solution, first_state: usize, count: usize) -> Self {
        let mut values = Vec::new();
        let mut first = 0;
        for rule in &solution.rules {
            for node in first..=first + rule.points() {
                let state = solution.states.column(node);
                values.extend(
                    state
                        .iter()
                        .skip(first_state)
                        .take(count)
                        .map(|&q| q as f32),
                );
            }
            first += rule.points();
        }
        Self {
            count: count as u8,
            values,
        }
    }

    /// Whether they go with a trajectory of a machine.
    pub(super) fn check(
        &self,
        trajectory: &Trajectory,
        plant: &dyn Plant,
    ) -> Result<(), CertifyError> {
        let (found, machine) = (usize::from(self.count), plant.coordinate_count());
        if found != machine {
            return Err(CertifyError::CoordinateCount { found, machine });
        }
        let rows: usize = trajectory.intervals().map(|i| i.points + 1).sum();
        let (found, expected) = (self.values.len(), rows * machine);
        if found != expected {
            return Err(CertifyError::Coordinates { found, expected });
        }
        Ok(())
    }
}
