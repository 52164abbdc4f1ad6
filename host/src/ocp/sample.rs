//! Limits between the collocation points.
//!
//! What is shipped and played are polynomials through the nodes, and a polynomial that keeps its limits at the nodes
//! overshoots between them; the control most of all at the end of an interval, where LGR has no point. A [`Sample`]
//! imposes a limit on such a polynomial at one more place. That is linear in the values at the nodes,
//!
//! ```text
//! Σⱼ ℓⱼ(ξ) yⱼ,    yⱼ = xⱼ (N + 1 support points), uⱼ (N points) or p(xⱼ, uⱼ)
//! ```
//!
//! so it needs no function value and no second derivative that the nodes do not need anyway.

use super::lgr::{Rule, lagrange_basis};
use super::problem::Bounds;

/// Whose polynomial is limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// A state.
    State(usize),
    /// A control.
    Control(usize),
    /// The polynomial through a path function's values at the nodes.
    Path(usize),
    /// The slope of what a path function is the rate of: the polynomial through its values at the N points alone, which like
    /// a control's has no point at the end.
    Slope(usize),
}

/// A limit at a place between the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index of the interval.
    pub interval: usize,
    /// Local coordinate in [−1, 1].
    pub local: f64,
    /// What is limited.
    pub limited: Limited,
    /// Its bounds, in its own unit.
    pub bounds: Bounds,
}

/// A sample with the basis that its polynomial has there.
#[derive(Clone, Debug)]
pub(super) struct SampleRow {
    pub(super) sample: Sample,
    /// First support point of the interval.
    pub(super) first: usize,
    /// ℓⱼ(ξ), from the first support point on.
    pub(super) basis: Vec<f64>,
}

impl SampleRow {
    /// `on_points`: whether the polynomial has the N collocation points only, as a control has.
    pub(super) fn new(sample: Sample, first: usize, rule: &Rule, on_points: bool) -> Self {
        let (nodes, weights) = if on_points {
            (&rule.support[..rule.points()], &rule.control_barycentric)
        } else {
            (rule.support.as_slice(), &rule.barycentric)
        };
        let mut basis = vec![0.0; nodes.len()];
        lagrange_basis(nodes, weights, sample.local, &mut basis);
        Self {
            sample,
            first,
            basis,
        }
    }
}
