//! Reads the arcs off a solution: where each control lies at which bound.

use crate::ocp::{Answer, Bounds, HamiltonianAt, OptimalControlProblem};

/// A bound of a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The lower one.
    Lower,
    /// The upper one.
    Upper,
}

impl Side {
    fn other(self) -> Self {
        match self {
            Self::Lower => Self::Upper,
            Self::Upper => Self::Lower,
        }
    }
}

/// A piece of the motion on which every control lies at one of its bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct BangArc {
    /// Its duration, s.
    pub duration_s: f64,
    /// The bound that each control lies at.
    pub sides: Vec<Side>,
}

impl BangArc {
    /// Values of the controls.
    pub(super) fn controls(&self, problem: &OptimalControlProblem) -> Vec<f64> {
        (self.sides.iter().zip(&problem.controls))
            .map(|(side, control)| match side {
                Side::Lower => control.bounds.lower,
                Side::Upper => control.bounds.upper,
            })
            .collect()
    }
}

/// Share of a control's range within which it counts as being at a bound.
const AT_BOUND: f64 = 1e-3;

/// Whether the dynamics and the cost are affine in the controls and all controls are bounded: otherwise there is no reason
/// for controls to lie at bounds.
pub(super) fn affine(problem: &OptimalControlProblem) -> bool {
    let states = problem.sizes.states;
    let bounded =
        (problem.controls.iter()).all(|c| c.bounds.lower.is_finite() && c.bounds.upper.is_finite());
    let pairs = &problem.stage.structure().hessian;
    // A pair of controls has its column, the smaller index, among the controls.
    problem.sizes.controls > 0 && bounded && pairs.iter().all(|&(_, column)| column < states)
}

/// The arcs that an answer suggests, or `None` if some control is singular.
///
/// A control is at its lower bound where its switching function ∂H/∂u is positive, at its upper one where it is negative; its
/// zeros are the switches. Costates are smooth where the controls jump, so these zeros are more exact than the points.
pub(super) fn arcs(problem: &OptimalControlProblem, answer: &Answer) -> Option<Vec<BangArc>> {
    let solution = &answer.solution;
    let times = solution.support_times_s();
    let points = solution.controls.ncols();
    let switching: Vec<Vec<f64>> = (0..points)
        .map(|point| {
            let x: Vec<f64> = solution.states.column(point).iter().copied().collect();
            let u: Vec<f64> = solution.controls.column(point).iter().copied().collect();
            let costates: Vec<f64> = answer
                .costates
                .values
                .column(point)
                .iter()
                .copied()
                .collect();
            HamiltonianAt::at(problem, &x, &u, &costates).by_control
        })
        .collect();
    let side = |value: f64| {
        if value > 0.0 {
            Side::Lower
        } else {
            Side::Upper
        }
    };
    let mut sides = Vec::with_capacity(problem.sizes.controls);
    let mut switches: Vec<(f64, usize)> = Vec::new();
    for (control, quantity) in problem.controls.iter().enumerate() {
        if singular(answer, control, quantity.bounds) {
            return None;
        }
        let of = |point: usize| switching[point][control];
        sides.push(side(of(0)));
        for point in 1..points {
            let (before, after) = (of(point - 1), of(point));
            if side(before) != side(after) {
                let share = before / (before - after);
                let time = times[point - 1] + share * (times[point] - times[point - 1]);
                switches.push((time, control));
            }
        }
    }
    switches.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut all = Vec::with_capacity(switches.len() + 1);
    let mut start_s = 0.0;
    for (time_s, control) in switches {
        all.push(BangArc {
            duration_s: time_s - start_s,
            sides: sides.clone(),
        });
        sides[control] = sides[control].other();
        start_s = time_s;
    }
    all.push(BangArc {
        duration_s: solution.duration_s - start_s,
        sides,
    });
    Some(all)
}

/// Whether a control lies between its bounds all through some interval, as on a singular arc; where it only switches, some
/// point of the interval still has it at a bound.
fn singular(answer: &Answer, control: usize, bounds: Bounds) -> bool {
    let solution = &answer.solution;
    let near = AT_BOUND * (bounds.upper - bounds.lower);
    let row = solution.controls.row(control);
    let mut first = 0;
    solution.rules.iter().any(|rule| {
        let own = row.columns(first, rule.points());
        first += rule.points();
        (own.iter()).all(|&u| u > bounds.lower + near && u < bounds.upper - near)
    })
}
