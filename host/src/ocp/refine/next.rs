//! The next mesh: more points where the solution is smooth, shorter intervals where it is not.

use super::estimate::IntervalError;
use super::join::joined;
use crate::ocp::{Interval, Mesh, Solution};

/// Points of the parts of an interval that was divided, where the solution is not smooth and where it is.
const FEWEST_POINTS: usize = 4;
const SMOOTH_POINTS: usize = 10;
/// Most points of an interval. Numbers of points are even, so that there are eight different ones: the board prepares a basis
/// for each, and no more than that.
const MOST_POINTS: usize = 18;
/// Legendre coefficients that fall more slowly than this, in decades per degree, belong to something that is not smooth.
const SMOOTH: f64 = 0.3;
/// Most parts that an interval is divided into at once.
const MOST_PARTS: usize = 4;
/// While the objective still moves, intervals whose control is at least this share as badly resolved as the worst are refined.
const MARKED: f64 = 0.3;
/// How many times too large the error of such a control counts as.
const BADLY: f64 = 10.0;

/// Why a mesh is refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// The dynamics are not met to the tolerance.
    Dynamics,
    /// The dynamics are, but the objective still moves.
    Objective,
}

/// The mesh after that of `solution`, or `None` if nothing is left to refine.
pub(super) fn next(
    solution: &Solution,
    errors: &[IntervalError],
    tolerance: f64,
    reason: Reason,
) -> Option<Mesh> {
    let worst_control = errors.iter().fold(0.0_f64, |m, error| m.max(error.control));
    let mut changed = false;
    let mut intervals = Vec::with_capacity(2 * errors.len());
    let mut first = 0;
    let mut all = solution.mesh.intervals().iter().zip(errors).enumerate();
    while let Some((index, (interval, error))) = all.next() {
        let points = interval.points;
        // How many times too large the error is, and how fast it falls per point.
        let (excess, decay) = match reason {
            Reason::Dynamics => (error.dynamics / tolerance, error.decay),
            Reason::Objective
                if error.control >= MARKED * worst_control && worst_control > 1e-13 =>
            {
                (BADLY, error.control_decay)
            }
            Reason::Objective => (0.0, 0.0),
        };
        if excess > 1.0 {
            changed = true;
            intervals.extend(refined(*interval, excess, decay));
        } else if reason == Reason::Dynamics
            && let Some(whole) = joined(solution, errors, (index, first), tolerance)
        {
            intervals.push(whole);
            first += all.next().map_or(0, |(_, (skipped, _))| skipped.points);
        } else {
            intervals.push(*interval);
        }
        first += points;
    }
    changed.then(|| Mesh::new(intervals))
}

fn refined(interval: Interval, excess: f64, decay: f64) -> Vec<Interval> {
    if decay >= SMOOTH {
        let more = (excess.log10() / decay)
            .ceil()
            .clamp(1.0, MOST_POINTS as f64) as usize;
        let points = (interval.points + more).next_multiple_of(2);
        if points <= MOST_POINTS {
            return vec![Interval { points, ..interval }];
        }
    }
    let needed = (excess.ln() / (interval.points as f64).ln()).ceil();
    let parts = needed.clamp(2.0, MOST_PARTS as f64) as usize;
    let part = Interval {
        fraction: interval.fraction / parts as f64,
        points: if decay >= SMOOTH {
            SMOOTH_POINTS
        } else {
            FEWEST_POINTS
        },
    };
    vec![part; parts]
}
