//! A problem with its controls held at bounds on a sequence of arcs, and the arcs' durations free.
//!
//! All arcs run in parallel over the common time s ∈ [0, 1]: arc k has states of its own and the duration d_k, which is one
//! more state, constant,
//!
//! ```text
//! dxₖ/ds = dₖ f(xₖ, ūₖ),   ddₖ/ds = 0,   xₖ(1) = xₖ₊₁(0),   T = Σ dₖ,   ∫ Σ dₖ L(xₖ, ūₖ) ds.
//! ```
//!
//! So it is an ordinary problem without controls and of fixed duration 1, whose solution is smooth: the transcription converges
//! on it as fast as f is smooth, and the switching times are among the unknowns. Variables are the states of all arcs, then
//! the durations.

use crate::ocp::problem::{Differentiable, OptimalControlProblem, Structure};
use std::sync::Arc;

/// f, p and L of all arcs.
pub(super) struct LiftedStage {
    problem: Arc<OptimalControlProblem>,
    /// Controls ū of every arc.
    controls: Vec<Vec<f64>>,
    structure: Structure,
    /// State columns that f or L depends on: they meet dₖ in a product.
    timed: Vec<usize>,
}

impl LiftedStage {
    pub(super) fn new(problem: Arc<OptimalControlProblem>, controls: Vec<Vec<f64>>) -> Self {
        let sizes = problem.sizes;
        let (n, arcs) = (sizes.states, controls.len());
        let own = problem.stage.structure();
        let cost = sizes.states + sizes.path;
        let timed = (0..n)
            .filter(|&column| {
                (own.jacobian.iter()).any(|&(r, c)| c == column && (r < n || r == cost))
            })
            .collect();
        let mut this = Self {
            problem: Arc::clone(&problem),
            controls,
            structure: Structure::default(),
            timed,
        };
        for arc in 0..arcs {
            for &(row, column) in own.jacobian.iter().filter(|(_, column)| *column < n) {
                this.structure
                    .jacobian
                    .push((this.row(arc, row), arc * n + column));
            }
            for row in (0..n).chain([cost]) {
                this.structure
                    .jacobian
                    .push((this.row(arc, row), this.duration(arc)));
            }
            for &(row, column) in own.hessian.iter().filter(|(row, _)| *row < n) {
                this.structure
                    .hessian
                    .push((arc * n + row, arc * n + column));
            }
            for &column in &this.timed {
                this.structure
                    .hessian
                    .push((this.duration(arc), arc * n + column));
            }
        }
        this
    }

    fn arcs(&self) -> usize {
        self.controls.len()
    }

    /// Variable of an arc's duration.
    fn duration(&self, arc: usize) -> usize {
        self.arcs() * self.problem.sizes.states + arc
    }

    /// Row of a value of the problem's stage on an arc.
    fn row(&self, arc: usize, row: usize) -> usize {
        let sizes = self.problem.sizes;
        let states = self.arcs() * (sizes.states + 1);
        if row < sizes.states {
            arc * sizes.states + row
        } else if row < sizes.states + sizes.path {
            states + arc * sizes.path + row - sizes.states
        } else {
            states + self.arcs() * sizes.path
        }
    }

    /// Variables of the problem's stage on an arc.
    fn arguments(&self, z: &[f64], arc: usize) -> Vec<f64> {
        let n = self.problem.sizes.states;
        z[arc * n..][..n]
            .iter()
            .chain(&self.controls[arc])
            .copied()
            .collect()
    }

    /// Puts an arc's values in their rows; the cost adds up.
    fn put(&self, arc: usize, duration: f64, values: &[f64], out: &mut [f64]) {
        let sizes = self.problem.sizes;
        for (row, value) in values.iter().enumerate() {
            let timed = row < sizes.states || row == sizes.states + sizes.path;
            out[self.row(arc, row)] += if timed { duration * value } else { *value };
        }
    }
}

impl Differentiable for LiftedStage {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let mut values = vec![0.0; self.problem.sizes.stage_values()];
        for arc in 0..self.arcs() {
            self.problem
                .stage
                .values(&self.arguments(z, arc), &mut values);
            self.put(arc, z[self.duration(arc)], &values, out);
        }
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        out.fill(0.0);
        let sizes = self.problem.sizes;
        let (n, cost) = (sizes.states, sizes.states + sizes.path);
        let own = &self.problem.stage.structure().jacobian;
        let mut values = vec![0.0; sizes.stage_values()];
        let mut derivatives = vec![0.0; own.len()];
        let mut slots = entries.iter_mut();
        let mut push = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        for arc in 0..self.arcs() {
            let duration = z[self.duration(arc)];
            let arguments = self.arguments(z, arc);
            self.problem
                .stage
                .jacobian(&arguments, &mut values, &mut derivatives);
            self.put(arc, duration, &values, out);
            for (entry, &(row, column)) in derivatives.iter().zip(own) {
                if column < n {
                    let timed = row < n || row == cost;
                    push(if timed { duration * entry } else { *entry });
                }
            }
            values[..n].iter().for_each(|&value| push(value));
            push(values[cost]);
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let sizes = self.problem.sizes;
        let (n, cost) = (sizes.states, sizes.states + sizes.path);
        let own = self.problem.stage.structure();
        let mut values = vec![0.0; sizes.stage_values()];
        let mut derivatives = vec![0.0; own.jacobian.len()];
        let mut second = vec![0.0; own.hessian.len()];
        let mut slots = entries.iter_mut();
        let mut push = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        for arc in 0..self.arcs() {
            let duration = z[self.duration(arc)];
            let arguments = self.arguments(z, arc);
            let mut own_weights: Vec<f64> = (0..sizes.stage_values())
                .map(|row| weights[self.row(arc, row)])
                .collect();
            self.problem
                .stage
                .jacobian(&arguments, &mut values, &mut derivatives);
            let mut cross = vec![0.0; n];
            for (entry, &(row, column)) in derivatives.iter().zip(&own.jacobian) {
                if column < n && (row < n || row == cost) {
                    cross[column] += own_weights[row] * entry;
                }
            }
            for (row, weight) in own_weights.iter_mut().enumerate() {
                if row < n || row == cost {
                    *weight *= duration;
                }
            }
            self.problem
                .stage
                .hessian(&arguments, &own_weights, &mut second);
            for (entry, &(row, _)) in second.iter().zip(&own.hessian) {
                if row < n {
                    push(*entry);
                }
            }
            self.timed.iter().for_each(|&column| push(cross[column]));
        }
    }
}

/// Φ and e of the first and the last arc, the joints between the arcs, and the sum of the durations.
pub(super) struct LiftedEnds {
    problem: Arc<OptimalControlProblem>,
    arcs: usize,
    structure: Structure,
}

impl LiftedEnds {
    pub(super) fn new(problem: Arc<OptimalControlProblem>, arcs: usize) -> Self {
        let own = problem.endpoint.structure();
        let mut this = Self {
            problem: Arc::clone(&problem),
            arcs,
            structure: Structure::default(),
        };
        for &(row, variable) in &own.jacobian {
            this.structure
                .jacobian
                .extend(this.variables(variable).map(|v| (row, v)));
        }
        let (n, width) = (problem.sizes.states, this.width());
        let mut row = problem.sizes.endpoint_values();
        for joint in 0..(arcs - 1) * n {
            this.structure.jacobian.push((row, joint + n));
            this.structure.jacobian.push((row, width + joint));
            row += 1;
        }
        let durations = this.variables(2 * n);
        this.structure.jacobian.extend(durations.map(|v| (row, v)));
        for &(row, column) in &own.hessian {
            for r in this.variables(row) {
                let columns = this.variables(column).filter(|c| *c <= r);
                this.structure.hessian.extend(columns.map(|c| (r, c)));
            }
        }
        this
    }

    /// States of the lifted problem.
    fn width(&self) -> usize {
        self.arcs * (self.problem.sizes.states + 1)
    }

    /// Variables that an end variable (x(0), x(T), T) of the problem stands for: T is the sum of all durations.
    fn variables(&self, variable: usize) -> std::ops::Range<usize> {
        let n = self.problem.sizes.states;
        let width = self.width();
        if variable < n {
            variable..variable + 1
        } else if variable < 2 * n {
            let own = width + (self.arcs - 1) * n + variable - n;
            own..own + 1
        } else {
            width + self.arcs * n..2 * width
        }
    }

    fn arguments(&self, z: &[f64]) -> Vec<f64> {
        (0..self.problem.sizes.endpoint_variables())
            .map(|variable| z[self.variables(variable)].iter().sum())
            .collect()
    }

    fn joints(&self, z: &[f64], out: &mut [f64]) {
        let (n, width) = (self.problem.sizes.states, self.width());
        let first = self.problem.sizes.endpoint_values();
        let joints = (self.arcs - 1) * n;
        for (joint, slot) in out[first..][..joints].iter_mut().enumerate() {
            *slot = z[width + joint] - z[joint + n];
        }
        out[first + joints] = z[self.variables(2 * n)].iter().sum();
    }
}

impl Differentiable for LiftedEnds {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        let own = self.problem.sizes.endpoint_values();
        self.problem
            .endpoint
            .values(&self.arguments(z), &mut out[..own]);
        self.joints(z, out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let sizes = self.problem.sizes;
        let own = &self.problem.endpoint.structure().jacobian;
        let mut derivatives = vec![0.0; own.len()];
        let values = &mut out[..sizes.endpoint_values()];
        self.problem
            .endpoint
            .jacobian(&self.arguments(z), values, &mut derivatives);
        self.joints(z, out);
        let of_problem = (derivatives.iter().zip(own))
            .flat_map(|(entry, &(_, variable))| self.variables(variable).map(move |_| *entry));
        let joints = (0..(self.arcs - 1) * sizes.states).flat_map(|_| [-1.0, 1.0]);
        let durations = (0..self.arcs).map(|_| 1.0);
        for (slot, value) in entries
            .iter_mut()
            .zip(of_problem.chain(joints).chain(durations))
        {
            *slot = value;
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let own = &self.problem.endpoint.structure().hessian;
        let mut second = vec![0.0; own.len()];
        let weights = &weights[..self.problem.sizes.endpoint_values()];
        self.problem
            .endpoint
            .hessian(&self.arguments(z), weights, &mut second);
        let mut slots = entries.iter_mut();
        for (entry, &(row, column)) in second.iter().zip(own) {
            for r in self.variables(row) {
                for slot in (&mut slots).take(self.variables(column).filter(|c| *c <= r).count()) {
                    *slot = *entry;
                }
            }
        }
    }
}
