//! The next mesh: more points where the solution is smooth, shorter intervals where it is not.

use super::estimate::IntervalError;
use crate::ocp::{Interval, Mesh};

/// Points of an interval that was divided.
const FEWEST_POINTS: usize = 4;
/// Most points of an interval: more gain nothing before f64 ends.
const MOST_POINTS: usize = 20;
/// Legendre coefficients that fall more slowly than this, in decades per degree, belong to something that is not smooth.
const SMOOTH: f64 = 0.3;
/// Most parts that an interval is divided into at once.
const MOST_PARTS: usize = 4;
/// While the objective still moves, intervals whose control is at least this share as badly resolved as the worst are refined.
const MARKED: f64 = 0.1;

/// Why a mesh is refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// The dynamics are not met to the tolerance.
    Dynamics,
    /// The dynamics are, but the objective still moves.
    Objective,
}

/// The mesh after `mesh`, or `None` if nothing is left to refine.
pub(super) fn next(
    mesh: &Mesh,
    errors: &[IntervalError],
    tolerance: f64,
    reason: Reason,
) -> Option<Mesh> {
    let worst_control = errors.iter().fold(0.0_f64, |m, error| m.max(error.control));
    let mut changed = false;
    let mut intervals = Vec::with_capacity(2 * errors.len());
    for (interval, error) in mesh.intervals().iter().zip(errors) {
        // How many times too large the error is, and how fast it falls per point.
        let (excess, decay) = match reason {
            Reason::Dynamics => (error.dynamics / tolerance, error.decay),
            Reason::Objective
                if error.control >= MARKED * worst_control && worst_control > 1e-13 =>
            {
                (100.0, error.control_decay)
            }
            Reason::Objective => (0.0, 0.0),
        };
        if excess <= 1.0 {
            intervals.push(*interval);
            continue;
        }
        changed = true;
        intervals.extend(refined(*interval, excess, decay));
    }
    changed.then(|| Mesh::new(intervals))
}

fn refined(interval: Interval, excess: f64, decay: f64) -> Vec<Interval> {
    if decay >= SMOOTH {
        let more = (excess.log10() / decay)
            .ceil()
            .clamp(1.0, MOST_POINTS as f64) as usize;
        let points = interval.points + more;
        if points <= MOST_POINTS {
            return vec![Interval { points, ..interval }];
        }
    }
    let needed = (excess.ln() / (interval.points as f64).ln()).ceil();
    let parts = needed.clamp(2.0, MOST_PARTS as f64) as usize;
    let part = Interval {
        fraction: interval.fraction / parts as f64,
        points: if decay >= SMOOTH {
            interval.points.min(MOST_POINTS / 2)
        } else {
            FEWEST_POINTS
        },
    };
    vec![part; parts]
}
