//! What is tried where no plan comes of a move, or one that does not hold, before it is given up.

use super::refinement;
use crate::movefile::MoveFile;

/// Another way to plan a move.
pub(super) struct Way {
    /// Distance kept from singular poses; see [`crate::movefile::Solver::clearance`].
    clearance: f64,
    /// How many times as many intervals.
    intervals: usize,
}

/// One after the other: near singular poses a machine's functions are too sharp for the polynomials of a coarse mesh, so first the
/// move is led farther around them.
pub(super) const WAYS: [Way; 3] = [
    Way {
        clearance: 0.3,
        intervals: 1,
    },
    Way {
        clearance: 0.3,
        intervals: 2,
    },
    Way {
        clearance: 0.3,
        intervals: 4,
    },
];

/// What the way before came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Failure {
    /// The solver found nothing.
    Unsolved,
    /// What it found does not hold.
    Untrue,
}

impl Way {
    /// The move to plan in this way; `None` where nothing would be different or the board has no room.
    pub(super) fn instead_of(&self, file: &MoveFile, failure: Failure) -> Option<MoveFile> {
        let mut other = file.clone();
        other.solver.clearance = self.clearance;
        other.mesh.intervals *= self.intervals;
        let worthwhile = if self.intervals > 1 {
            // More equations are no easier to solve.
            failure == Failure::Untrue && refinement::fits(&other)
        } else {
            // Only some machines have any.
            !file.machine.regularities(&file.from).is_empty()
        };
        worthwhile.then_some(other)
    }
}
