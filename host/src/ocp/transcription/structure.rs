//! Bounds and sparsity of the transcribed problem: computed once, in the order in which values are filled.

use super::Transcription;
use crate::ocp::problem::Bounds;

fn scaled(bounds: Bounds, shift: f64, scale: f64) -> Bounds {
    Bounds::new(
        (bounds.lower - shift) / scale,
        (bounds.upper - shift) / scale,
    )
}

impl Transcription {
    pub(super) fn variable_bounds(&self) -> Vec<Bounds> {
        let problem = &self.problem;
        let last = self.points.len();
        let mut all = Vec::with_capacity(self.variables());
        for point in 0..=last {
            for (i, state) in problem.states.iter().enumerate() {
                let mut bounds = state.bounds;
                if point == 0 {
                    bounds = bounds.intersect(problem.initial[i]);
                }
                if point == last {
                    bounds = bounds.intersect(problem.terminal[i]);
                }
                all.push(scaled(
                    bounds,
                    self.scaling.shift[i],
                    self.scaling.states[i],
                ));
            }
            if point < last {
                let controls = problem.controls.iter().zip(&self.scaling.controls);
                all.extend(controls.map(|(control, &scale)| scaled(control.bounds, 0.0, scale)));
            }
        }
        all.push(scaled(problem.duration_s, 0.0, self.scaling.duration_s));
        all
    }

    pub(super) fn constraint_bounds(&self) -> Vec<Bounds> {
        self.row_meanings()
            .iter()
            .map(|row| scaled(row.bounds, 0.0, row.scale))
            .collect()
    }

    /// Entries of the Jacobian that one collocation point owns; the order of `nlp::fill_jacobian_point`.
    fn jacobian_of_point(&self, point: usize, entries: &mut Vec<(usize, usize)>) {
        let states = self.problem.sizes.states;
        let at = self.points[point];
        let row = point * self.rows_per_point();
        for state in 0..states {
            let support = self.rules[at.interval].support.len();
            entries.extend((0..support).map(|j| (row + state, self.node(at.first + j) + state)));
        }
        for &(value, variable) in &self.problem.stage.structure().jacobian {
            if let Some(own) = self.point_row(value) {
                entries.push((row + own, self.node(point) + variable));
            }
        }
        entries.extend((0..states).map(|state| (row + state, self.duration_variable())));
    }

    pub(super) fn jacobian_structure(&self) -> (Vec<(usize, usize)>, Vec<usize>) {
        let mut entries = Vec::new();
        let mut offsets = Vec::with_capacity(self.points.len() + 1);
        for point in 0..self.points.len() {
            offsets.push(entries.len());
            self.jacobian_of_point(point, &mut entries);
        }
        offsets.push(entries.len());
        let last = self.node(self.points.len());
        for &(value, variable) in &self.problem.stage.structure().jacobian {
            if let Some(row) = self.end_path_row(value) {
                entries.push((row, last + variable));
            }
        }
        let ends = self.end_rows() + self.end_path.len();
        for &(value, variable) in &self.problem.endpoint.structure().jacobian {
            if value > 0 {
                entries.push((ends + value - 1, self.endpoint_variable(variable)));
            }
        }
        self.samples_structure(&mut entries);
        (entries, offsets)
    }

    /// Row of the nonlinear program that imposes stage value `value` at the end.
    pub(super) fn end_path_row(&self, value: usize) -> Option<usize> {
        let path = value.checked_sub(self.problem.sizes.states)?;
        let position = self.end_path.iter().position(|&row| row == path)?;
        Some(self.end_rows() + position)
    }

    /// Unknown that stands for an end variable (x(0), x(T), T).
    pub(super) fn endpoint_variable(&self, variable: usize) -> usize {
        let states = self.problem.sizes.states;
        if variable < states {
            variable
        } else if variable < 2 * states {
            self.node(self.points.len()) + variable - states
        } else {
            self.duration_variable()
        }
    }

    /// Columns of the stage functions that f or L depends on: they meet T in a product.
    pub(super) fn timed_columns(&self) -> Vec<usize> {
        let sizes = self.problem.sizes;
        let timed = |row: usize| row < sizes.states || row == sizes.states + sizes.path;
        (0..sizes.stage_variables())
            .filter(|&column| {
                let mut entries = self.problem.stage.structure().jacobian.iter();
                entries.any(|&(r, c)| c == column && timed(r))
            })
            .collect()
    }

    pub(super) fn hessian_structure(&self) -> Vec<(usize, usize)> {
        let mut entries = Vec::new();
        let stage = &self.problem.stage.structure().hessian;
        let timed = self.timed_columns();
        for point in 0..self.points.len() {
            let base = self.node(point);
            entries.extend(stage.iter().map(|&(r, c)| (base + r, base + c)));
            entries.extend(timed.iter().map(|&c| (self.duration_variable(), base + c)));
        }
        let base = self.node(self.points.len());
        entries.extend(self.end_hessian().map(|(_, (r, c))| (base + r, base + c)));
        for &(r, c) in &self.problem.endpoint.structure().hessian {
            entries.push((self.endpoint_variable(r), self.endpoint_variable(c)));
        }
        entries
    }

    /// Stage Hessian entries (with their index) that exist at the end, where only path rows count and no control is.
    pub(super) fn end_hessian(&self) -> impl Iterator<Item = (usize, (usize, usize))> + '_ {
        let states = self.problem.sizes.states;
        let sizes = self.problem.sizes;
        let needed = (0..sizes.path).any(|row| !self.problem.path_needs_control(row));
        let stage = self.problem.stage.structure().hessian.iter();
        stage
            .copied()
            .enumerate()
            .filter(move |&(_, (r, _))| needed && r < states)
    }
}
