//! A trajectory's nodes in f64, and its values channel by channel.

use stillpoint_shared::basis::MAX_SUPPORT;
use stillpoint_shared::lgr;
use stillpoint_shared::status::Quantity;
use stillpoint_shared::trajectory::QUANTITIES;

/// Support points of the interval at hand in f64, with their barycentric weights.
pub(crate) struct Nodes {
    points: usize,
    nodes: [f64; MAX_SUPPORT],
    weights: [f64; MAX_SUPPORT],
}

impl Nodes {
    pub(crate) const fn empty() -> Self {
        Self {
            points: 0,
            nodes: [0.0; MAX_SUPPORT],
            weights: [0.0; MAX_SUPPORT],
        }
    }

    /// Computes the points unless the previous interval had as many. A trajectory has at most
    /// `MAX_POINTS` in an interval.
    pub(crate) fn prepare(&mut self, points: usize) {
        if self.points == points {
            return;
        }
        self.points = points;
        if let (Some(nodes), Some(weights)) = (
            self.nodes.get_mut(..=points),
            self.weights.get_mut(..=points),
        ) {
            // Lengths agree: these cannot fail.
            let _ = lgr::support_nodes(nodes);
            let _ = lgr::barycentric_weights(nodes, weights);
        }
    }

    pub(crate) fn nodes(&self) -> &[f64] {
        self.nodes.get(..=self.points).unwrap_or_default()
    }

    pub(crate) fn weights(&self) -> &[f64] {
        self.weights.get(..=self.points).unwrap_or_default()
    }
}

/// One of the values of [`channel`]; zero beyond the last.
pub(crate) fn value(
    coefficients: &[f32],
    axes: usize,
    quantity: Quantity,
    axis: usize,
    node: usize,
) -> f32 {
    let place = (node * QUANTITIES + quantity as usize) * axes + axis;
    coefficients.get(place).copied().unwrap_or_default()
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
