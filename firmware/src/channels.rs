//! A trajectory's values channel by channel, and the basis of the interval at hand.

use stillpoint_shared::Basis;
use stillpoint_shared::status::Quantity;
use stillpoint_shared::trajectory::QUANTITIES;

/// The basis of the interval at hand, worked out where the previous interval had another one.
pub(crate) struct BasisAtHand(Basis);

impl BasisAtHand {
    pub(crate) const NONE: Self = Self(Basis::EMPTY);

    /// The basis of N = `points`; a trajectory's points have one, as its schedule could not be prepared
    /// otherwise.
    pub(crate) fn of(&mut self, points: usize) -> Option<&Basis> {
        if self.0.points() != points {
            self.0.prepare(points).ok()?;
        }
        Some(&self.0)
    }
}

/// Values of one quantity of one axis, node after node; over one interval or over all of them.
pub(crate) fn channel(
    coefficients: &[f32],
    axes: usize,
    quantity: Quantity,
    axis: usize,
) -> impl DoubleEndedIterator<Item = f32> + ExactSizeIterator {
    coefficients
        .iter()
        .skip(quantity as usize * axes + axis)
        .step_by((QUANTITIES * axes).max(1))
        .copied()
}
