//! Joins neighbouring intervals where one polynomial serves as well: refinement leaves short intervals behind where nothing
//! happens (Liu, Hager, Rao, "Adaptive mesh refinement method for optimal control using nonsmoothness detection and mesh size
//! reduction", J. Franklin Inst. 352, 2015, reduce a mesh for the same reason).

use super::estimate::IntervalError;
use crate::ocp::lgr::{Rule, lagrange_basis};
use crate::ocp::{Interval, Solution, solution::Place};

/// Share of the tolerance by which the common polynomials may differ from the two they replace.
const DIFFERENCE: f64 = 0.1;

/// Whether the intervals `index` and `index + 1`, which start at point `first`, can be one; and if so, which.
pub(super) fn joined(
    solution: &Solution,
    errors: &[IntervalError],
    (index, first): (usize, usize),
    tolerance: f64,
) -> Option<Interval> {
    let pair = solution.mesh.intervals().get(index..index + 2)?;
    let quiet = errors.get(index..index + 2)?;
    if quiet
        .iter()
        .any(|error| error.dynamics > DIFFERENCE * tolerance)
    {
        return None;
    }
    let whole = Interval {
        fraction: pair[0].fraction + pair[1].fraction,
        points: pair[0].points.max(pair[1].points),
    };
    let rule = Rule::new(whole.points).ok()?;
    let split = 2.0 * pair[0].fraction / whole.fraction - 1.0;
    // Where a place of the common interval lies in the two.
    let place = |local: f64| {
        let second = local > split;
        let (from, to) = if second { (split, 1.0) } else { (-1.0, split) };
        Place {
            interval: index + usize::from(second),
            first_point: first + if second { pair[0].points } else { 0 },
            local: 2.0 * (local - from) / (to - from) - 1.0,
        }
    };
    let states: Vec<_> = rule
        .support
        .iter()
        .map(|&x| solution.state_at(place(x)))
        .collect();
    let nodes = &rule.support[..whole.points];
    let controls: Vec<_> = nodes
        .iter()
        .map(|&x| solution.control_at(place(x)))
        .collect();
    let (state_sizes, control_sizes) = (sizes(&solution.states), sizes(&solution.controls));
    let agree = |at: f64| {
        let close =
            |nodes: &[f64], weights: &[f64], values: &[Vec<f64>], here: Vec<f64>, sizes: &[f64]| {
                let mut basis = vec![0.0; nodes.len()];
                lagrange_basis(nodes, weights, at, &mut basis);
                here.iter()
                    .zip(sizes)
                    .enumerate()
                    .all(|(row, (here, size))| {
                        let common: f64 = basis
                            .iter()
                            .zip(values)
                            .map(|(b, value)| b * value[row])
                            .sum();
                        (common - here).abs() <= DIFFERENCE * tolerance * size
                    })
            };
        let (x, u) = (solution.state_at(place(at)), solution.control_at(place(at)));
        close(&rule.support, &rule.barycentric, &states, x, &state_sizes)
            && close(
                nodes,
                &rule.control_barycentric,
                &controls,
                u,
                &control_sizes,
            )
    };
    let samples = 4 * whole.points;
    (0..=samples)
        .all(|k| agree(2.0 * k as f64 / samples as f64 - 1.0))
        .then_some(whole)
}

/// What every row moves; 1 for one that does not.
fn sizes(values: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    let ranges = values.row_iter().map(|row| row.max() - row.min());
    ranges
        .map(|range| if range > 0.0 { range } else { 1.0 })
        .collect()
}
