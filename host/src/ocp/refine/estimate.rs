//! How wrong a solution is in every interval, without knowing the answer.
//!
//! Patterson, Hager, Rao, "A ph mesh refinement method for optimal control", Optim. Control Appl. Meth. 36 (2015), section
//! 4.1: in an interval of N points the dynamics along the interpolated solution are integrated by the LGR rule of N + 1 points,
//!
//! ```text
//! X̂(ξᵢ) = X(−1) + (h/2) Σⱼ I_ij f(X(ξⱼ), U(ξⱼ)),    I = D₁..ₘ⁻¹,
//! ```
//!
//! and the largest |X̂ − X|, relative to the size of the state, is the error. The paper divides by 1 + max |X|, which depends on
//! the unit of X; here it is the range of the state. The running cost is integrated alike, as one more state.

use crate::ocp::lgr::Rule;
use crate::ocp::{OptimalControlProblem, Solution, solution::Place};
use nalgebra::{DMatrix, DVector};

/// What is known of one interval.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct IntervalError {
    /// Relative error of the state or cost that is most wrong.
    pub(super) dynamics: f64,
    /// Decay of the Legendre coefficients of that state's slope, decades per degree.
    pub(super) decay: f64,
    /// Largest last Legendre coefficient of a control over the control's size, times the interval's share of T.
    pub(super) control: f64,
    /// Decay of that control's Legendre coefficients.
    pub(super) control_decay: f64,
}

/// Errors of all intervals.
pub(super) fn errors(problem: &OptimalControlProblem, solution: &Solution) -> Vec<IntervalError> {
    let sizes = problem.sizes;
    let mut scale: Vec<f64> = (solution.states.row_iter())
        .map(|row| range(row.max() - row.min(), row.amax()))
        .collect();
    scale.push(range(running_cost(problem, solution).abs(), 0.0));
    let control_scale: Vec<f64> = (solution.controls.row_iter())
        .map(|row| range(row.max() - row.min(), row.amax()))
        .collect();
    let mut first_point = 0;
    let lengths: Vec<f64> = solution.intervals_s().map(|(_, length)| length).collect();
    let mut all = Vec::with_capacity(lengths.len());
    for (interval, length_s) in lengths.into_iter().enumerate() {
        let here = Interval {
            problem,
            solution,
            interval,
            first_point,
            length_s,
        };
        let rule = &solution.rules[interval];
        let (dynamics, worst) = here.dynamics(&scale);
        let slopes = here.slopes_at(rule);
        let floor = 2.0 * scale[worst] / length_s * NOISE;
        let decay = decay(&legendre(rule, slopes.row(worst).iter()), floor);
        let (mut control, mut control_decay) = (0.0, f64::INFINITY);
        for (index, scale) in control_scale.iter().enumerate().take(sizes.controls) {
            let values = solution.controls.row(index);
            let coefficients = legendre(rule, values.columns(first_point, rule.points()).iter());
            let last = coefficients[rule.points() - 1].abs() / scale;
            let size = last * solution.mesh.intervals()[interval].fraction;
            if size > control {
                control = size;
                control_decay = self::decay(&coefficients, scale * NOISE);
            }
        }
        all.push(IntervalError {
            dynamics,
            decay,
            control,
            control_decay,
        });
        first_point += rule.points();
    }
    all
}

/// Relative size below which coefficients are rounding and the solver's tolerance.
const NOISE: f64 = 1e-9;

/// The size to compare with: what a quantity moves, else what it is, else one.
fn range(moved: f64, size: f64) -> f64 {
    if moved > NOISE * size && moved > 0.0 {
        moved
    } else if size > 0.0 {
        size
    } else {
        1.0
    }
}

struct Interval<'a> {
    problem: &'a OptimalControlProblem,
    solution: &'a Solution,
    interval: usize,
    first_point: usize,
    length_s: f64,
}

impl Interval<'_> {
    fn place(&self, local: f64) -> Place {
        Place {
            interval: self.interval,
            first_point: self.first_point,
            local,
        }
    }

    /// f and L at the points of a rule along the interpolated solution: (states + 1) × points.
    fn slopes_at(&self, rule: &Rule) -> DMatrix<f64> {
        let sizes = self.problem.sizes;
        let mut slopes = DMatrix::zeros(sizes.states + 1, rule.points());
        let mut values = vec![0.0; sizes.stage_values()];
        for (mut column, &local) in slopes.column_iter_mut().zip(&rule.support) {
            let place = self.place(local);
            let mut z = self.solution.state_at(place);
            z.extend(self.solution.control_at(place));
            self.problem.stage.values(&z, &mut values);
            column
                .rows_mut(0, sizes.states)
                .copy_from_slice(&values[..sizes.states]);
            column[sizes.states] = values[sizes.states + sizes.path];
        }
        slopes
    }

    /// Largest relative error, and the state (or, after the last, the cost) that it belongs to.
    fn dynamics(&self, scale: &[f64]) -> (f64, usize) {
        let own = &self.solution.rules[self.interval];
        let Ok(finer) = Rule::new(own.points() + 1) else {
            // Beyond the largest rule nothing can be compared.
            return (f64::INFINITY, 0);
        };
        let slopes = self.slopes_at(&finer);
        let count = finer.points();
        let integration = finer.differentiation.columns(1, count).into_owned().lu();
        let states = self.problem.sizes.states;
        let (mut worst, mut of) = (0.0, 0);
        for (row, scale) in scale.iter().enumerate().take(states) {
            let right: DVector<f64> = slopes.row(row).transpose() * (self.length_s / 2.0);
            let Some(rise) = integration.solve(&right) else {
                return (f64::INFINITY, row);
            };
            let start = self.solution.states[(row, self.first_point)];
            for (rise, &local) in rise.iter().zip(&finer.support[1..]) {
                let interpolated = self.solution.state_at(self.place(local))[row];
                let error = (start + rise - interpolated).abs() / scale;
                if error > worst {
                    (worst, of) = (error, row);
                }
            }
        }
        let by = |rule: &Rule, slopes: &DMatrix<f64>| -> f64 {
            let costs = slopes.row(states);
            let weighted = costs.iter().zip(&rule.weights);
            weighted.map(|(cost, w)| cost * w).sum::<f64>() * self.length_s / 2.0
        };
        let cost = (by(&finer, &slopes) - by(own, &self.slopes_at(own))).abs() / scale[states];
        if cost > worst {
            (cost, states)
        } else {
            (worst, of)
        }
    }
}

/// ∫L dt by the rule of every interval.
fn running_cost(problem: &OptimalControlProblem, solution: &Solution) -> f64 {
    let sizes = problem.sizes;
    let mut values = vec![0.0; sizes.stage_values()];
    let (mut sum, mut point) = (0.0, 0);
    for ((_, length_s), rule) in solution.intervals_s().zip(&solution.rules) {
        for weight in &rule.weights {
            let x = solution.states.column(point);
            let u = solution.controls.column(point);
            let z: Vec<f64> = x.iter().chain(u.iter()).copied().collect();
            problem.stage.values(&z, &mut values);
            sum += weight * length_s / 2.0 * values[sizes.states + sizes.path];
            point += 1;
        }
    }
    sum
}

/// Legendre coefficients of the polynomial of degree N − 1 through values at the N points; exact, as the rule integrates
/// degree 2N − 2.
fn legendre<'a>(rule: &Rule, values: impl Iterator<Item = &'a f64>) -> Vec<f64> {
    let mut coefficients = vec![0.0; rule.points()];
    for ((value, weight), x) in values.zip(&rule.weights).zip(&rule.support) {
        let (mut previous, mut present) = (0.0, 1.0);
        for (degree, slot) in coefficients.iter_mut().enumerate() {
            let n = degree as f64;
            *slot += (n + 0.5) * weight * present * value;
            (previous, present) = (
                present,
                ((2.0 * n + 1.0) * x * present - n * previous) / (n + 1.0),
            );
        }
    }
    coefficients
}

/// σ of the line through log₁₀ |aⱼ| ≈ c − σ j (Liu, Hager, Rao, "Adaptive mesh refinement method for optimal control using decay
/// rates of Legendre polynomial coefficients", IEEE Trans. Control Syst. Technol. 26, 2018); coefficients below `floor` count
/// as the floor, and only the first of them counts.
fn decay(coefficients: &[f64], floor: f64) -> f64 {
    let mut logs: Vec<f64> = Vec::with_capacity(coefficients.len());
    let last = coefficients.iter().rposition(|c| c.abs() > floor);
    let Some(last) = last else {
        return f64::INFINITY;
    };
    for c in coefficients.iter().take(last + 2) {
        logs.push(c.abs().max(floor).log10());
    }
    let count = logs.len() as f64;
    if logs.len() < 2 {
        return f64::INFINITY;
    }
    let (mean_j, mean) = ((count - 1.0) / 2.0, logs.iter().sum::<f64>() / count);
    let (mut over, mut under) = (0.0, 0.0);
    for (j, log) in logs.iter().enumerate() {
        let gap = j as f64 - mean_j;
        over += gap * (log - mean);
        under += gap * gap;
    }
    -over / under
}
