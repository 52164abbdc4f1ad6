//! Values and exact derivatives of the transcribed problem.

use super::Transcription;
use crate::nlp::{Multipliers, NlpProblem, Start};
use crate::ocp::problem::Bounds;
use std::sync::Arc;

/// The nonlinear program of a [`Transcription`], with a start.
#[derive(Clone)]
pub struct CollocationNlp {
    transcription: Arc<Transcription>,
    start: Start,
    variable_bounds: Vec<Bounds>,
    constraint_bounds: Vec<Bounds>,
    jacobian_structure: Vec<(usize, usize)>,
    /// First Jacobian entry of every collocation point.
    jacobian_offsets: Vec<usize>,
    hessian_structure: Vec<(usize, usize)>,
    timed: Vec<usize>,
    /// Stage functions where they were last evaluated: objective and constraints, and the two derivatives, share them.
    values: Evaluated,
    derivatives: Evaluated,
}

/// Stage values and Jacobian entries at all support points of one iterate.
#[derive(Clone, Default)]
struct Evaluated {
    x: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
}

impl CollocationNlp {
    /// The program, started from scaled unknowns and, for a warm start, multipliers.
    #[must_use]
    pub fn new(transcription: Arc<Transcription>, x: Vec<f64>, warm: Option<Multipliers>) -> Self {
        let (jacobian_structure, jacobian_offsets) = transcription.jacobian_structure();
        Self {
            start: Start { x, warm },
            variable_bounds: transcription.variable_bounds(),
            constraint_bounds: transcription.constraint_bounds(),
            jacobian_structure,
            jacobian_offsets,
            hessian_structure: transcription.hessian_structure(),
            timed: transcription.timed_columns(),
            values: Evaluated::default(),
            derivatives: Evaluated::default(),
            transcription,
        }
    }

    fn evaluate(&mut self, x: &[f64]) {
        let t = &self.transcription;
        if self.values.x == x {
            return;
        }
        let width = t.problem.sizes.stage_values();
        self.values.values.resize((t.points.len() + 1) * width, 0.0);
        let mut z = vec![0.0; t.stage_width()];
        for (point, out) in self.values.values.chunks_exact_mut(width).enumerate() {
            t.stage_variables(x, point, &mut z);
            t.problem.stage.values(&z, out);
        }
        self.values.x = x.to_vec();
    }

    fn differentiate(&mut self, x: &[f64]) {
        let t = &self.transcription;
        if self.derivatives.x == x {
            return;
        }
        let width = t.problem.sizes.stage_values();
        let entries = t.problem.stage.structure().jacobian.len();
        let Evaluated {
            values,
            entries: all,
            ..
        } = &mut self.derivatives;
        values.resize((t.points.len() + 1) * width, 0.0);
        all.resize((t.points.len() + 1) * entries, 0.0);
        let mut work: Vec<_> = values
            .chunks_exact_mut(width)
            .zip(all.chunks_exact_mut(entries))
            .collect();
        in_parallel(&mut work, |point, (out, entries)| {
            let mut z = vec![0.0; t.stage_width()];
            t.stage_variables(x, point, &mut z);
            t.problem.stage.jacobian(&z, out, entries);
        });
        self.derivatives.x = x.to_vec();
    }

    /// ∫L dt by quadrature: weight of a point's running cost, without T.
    fn cost_weight(&self, point: usize) -> f64 {
        let at = self.transcription.points[point];
        at.half_share * self.transcription.rules[at.interval].weights[at.index]
    }
}

/// Runs `work(index, item)` over all items on the machine's cores.
fn in_parallel<T: Send>(items: &mut [T], work: impl Fn(usize, &mut T) + Sync) {
    let threads = std::thread::available_parallelism()
        .map_or(1, usize::from)
        .min(8);
    let chunk = items.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let work = &work;
        let mut chunks = items.chunks_mut(chunk).enumerate();
        let own = chunks.next();
        for (index, part) in chunks {
            scope.spawn(move || {
                for (i, item) in part.iter_mut().enumerate() {
                    work(index * chunk + i, item);
                }
            });
        }
        if let Some((_, part)) = own {
            for (i, item) in part.iter_mut().enumerate() {
                work(i, item);
            }
        }
    });
}

impl NlpProblem for CollocationNlp {
    fn variable_bounds(&self) -> &[Bounds] {
        &self.variable_bounds
    }
    fn constraint_bounds(&self) -> &[Bounds] {
        &self.constraint_bounds
    }
    fn jacobian_structure(&self) -> &[(usize, usize)] {
        &self.jacobian_structure
    }
    fn hessian_structure(&self) -> &[(usize, usize)] {
        &self.hessian_structure
    }
    fn start(&self) -> &Start {
        &self.start
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.evaluate(x);
        let t = &self.transcription;
        let sizes = t.problem.sizes;
        let mut ends = vec![0.0; sizes.endpoint_values()];
        t.problem
            .endpoint
            .values(&t.endpoint_variables(x), &mut ends);
        let running: f64 = (0..t.points.len())
            .map(|p| {
                self.cost_weight(p)
                    * self.values.values[p * sizes.stage_values() + sizes.states + sizes.path]
            })
            .sum();
        (ends[0] + t.duration(x) * running) / t.scaling.objective
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.differentiate(x);
        gradient.fill(0.0);
        let t = &self.transcription;
        let sizes = t.problem.sizes;
        let (cost, width) = (sizes.states + sizes.path, sizes.stage_values());
        let structure = &t.problem.stage.structure().jacobian;
        for point in 0..t.points.len() {
            let weight = self.cost_weight(point) / t.scaling.objective;
            let value = self.derivatives.values[point * width + cost];
            gradient[t.duration_variable()] += weight * t.scaling.duration_s * value;
            let entries = &self.derivatives.entries[point * structure.len()..][..structure.len()];
            for (entry, &(row, variable)) in entries.iter().zip(structure) {
                if row == cost {
                    gradient[t.node(point) + variable] +=
                        weight * t.duration(x) * entry * t.stage_scale(variable);
                }
            }
        }
        let ends = &t.problem.endpoint;
        let mut values = vec![0.0; t.problem.sizes.endpoint_values()];
        let mut entries = vec![0.0; ends.structure().jacobian.len()];
        ends.jacobian(&t.endpoint_variables(x), &mut values, &mut entries);
        for (entry, &(row, variable)) in entries.iter().zip(&ends.structure().jacobian) {
            if row == 0 {
                gradient[t.endpoint_variable(variable)] +=
                    entry * t.endpoint_scale(variable) / t.scaling.objective;
            }
        }
    }

    fn constraints(&mut self, x: &[f64], values: &mut [f64]) {
        self.evaluate(x);
        let t = &self.transcription;
        let sizes = t.problem.sizes;
        let width = sizes.stage_values();
        let duration = t.duration(x);
        for (point, at) in t.points.iter().enumerate() {
            let rows = &mut values[point * t.rows_per_point()..][..t.rows_per_point()];
            let stage = &self.values.values[point * width..][..width];
            let d = t.rules[at.interval].differentiation.row(at.index);
            for state in 0..sizes.states {
                let slope: f64 = (d.iter().enumerate())
                    .map(|(j, d)| d * x[t.node(at.first + j) + state])
                    .sum();
                rows[state] =
                    slope - at.half_share * duration * stage[state] / t.scaling.states[state];
            }
            for (slot, &path) in rows[sizes.states..].iter_mut().zip(&t.point_path) {
                *slot = stage[sizes.states + path] / t.scaling.path[path];
            }
        }
        let end = &self.values.values[t.points.len() * width..];
        let mut row = t.end_rows();
        for &path in &t.end_path {
            values[row] = end[sizes.states + path] / t.scaling.path[path];
            row += 1;
        }
        let mut ends = vec![0.0; sizes.endpoint_values()];
        t.problem
            .endpoint
            .values(&t.endpoint_variables(x), &mut ends);
        for ((slot, value), scale) in values[row..]
            .iter_mut()
            .zip(&ends[1..])
            .zip(&t.scaling.ends)
        {
            *slot = value / scale;
        }
        t.sample_values(x, &self.values.values, &mut values[t.sample_rows()..]);
    }

    fn jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        self.differentiate(x);
        let t = &self.transcription;
        let sizes = t.problem.sizes;
        let structure = &t.problem.stage.structure().jacobian;
        let duration = t.duration(x);
        let row_scale = |row: usize| {
            if row < sizes.states {
                1.0 / t.scaling.states[row]
            } else {
                1.0 / t.scaling.path[row - sizes.states]
            }
        };
        for (point, at) in t.points.iter().enumerate() {
            let mut slots = entries[self.jacobian_offsets[point]..].iter_mut();
            let mut put = |value: f64| {
                if let Some(slot) = slots.next() {
                    *slot = value;
                }
            };
            let d = t.rules[at.interval].differentiation.row(at.index);
            for _ in 0..sizes.states {
                d.iter().for_each(|&d| put(d));
            }
            let derivatives =
                &self.derivatives.entries[point * structure.len()..][..structure.len()];
            for (entry, &(row, variable)) in derivatives.iter().zip(structure) {
                if t.point_row(row).is_some() {
                    let factor = if row < sizes.states {
                        -at.half_share * duration
                    } else {
                        1.0
                    };
                    put(factor * entry * row_scale(row) * t.stage_scale(variable));
                }
            }
            let stage = &self.derivatives.values[point * sizes.stage_values()..];
            for (state, slope) in stage[..sizes.states].iter().enumerate() {
                put(-at.half_share * t.scaling.duration_s * slope * row_scale(state));
            }
        }
        let mut slots = entries[self.jacobian_offsets[t.points.len()]..].iter_mut();
        let end = &self.derivatives.entries[t.points.len() * structure.len()..];
        for (entry, &(row, variable)) in end.iter().zip(structure) {
            if t.end_path_row(row).is_some()
                && let Some(slot) = slots.next()
            {
                *slot = entry * row_scale(row) * t.stage_scale(variable);
            }
        }
        let ends = &t.problem.endpoint;
        let mut values = vec![0.0; sizes.endpoint_values()];
        let mut derivatives = vec![0.0; ends.structure().jacobian.len()];
        ends.jacobian(&t.endpoint_variables(x), &mut values, &mut derivatives);
        for (entry, &(row, variable)) in derivatives.iter().zip(&ends.structure().jacobian) {
            if row > 0
                && let Some(slot) = slots.next()
            {
                *slot = entry * t.endpoint_scale(variable) / t.scaling.ends[row - 1];
            }
        }
        t.samples_jacobian(&self.derivatives.entries, slots);
    }

    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        entries: &mut [f64],
    ) {
        self.differentiate(x);
        let t = &self.transcription;
        let sizes = t.problem.sizes;
        let problem = &t.problem;
        let cost = sizes.states + sizes.path;
        let duration = t.duration(x);
        let factor = objective_factor / t.scaling.objective;
        let stage_entries = problem.stage.structure().hessian.len();
        let jacobian = &problem.stage.structure().jacobian;
        let per_point = stage_entries + self.timed.len();
        let between = t.sample_weights(&multipliers[t.sample_rows()..]);

        let (at_points, at_end) = entries.split_at_mut(t.points.len() * per_point);
        let mut work: Vec<&mut [f64]> = at_points.chunks_exact_mut(per_point).collect();
        in_parallel(&mut work, |point, slots| {
            let at = t.points[point];
            let rows = &multipliers[point * t.rows_per_point()..][..t.rows_per_point()];
            // Multiplier of each stage value, per unit of T for f and L.
            let mut weights = vec![0.0; sizes.stage_values()];
            for state in 0..sizes.states {
                weights[state] = -at.half_share * rows[state] / t.scaling.states[state];
            }
            weights[cost] = factor * self.cost_weight(point);
            let (own, timed) = slots.split_at_mut(stage_entries);
            timed.fill(0.0);
            let derivatives = &self.derivatives.entries[point * jacobian.len()..][..jacobian.len()];
            for (entry, &(row, variable)) in derivatives.iter().zip(jacobian) {
                if (row < sizes.states || row == cost)
                    && let Ok(position) = self.timed.binary_search(&variable)
                {
                    timed[position] +=
                        weights[row] * entry * t.stage_scale(variable) * t.scaling.duration_s;
                }
            }
            for (row, weight) in weights.iter_mut().enumerate() {
                if row < sizes.states || row == cost {
                    *weight *= duration;
                } else {
                    let path = row - sizes.states;
                    let own = t.point_row(row).map_or(0.0, |own| rows[own]);
                    *weight = (own + between[point * sizes.path + path]) / t.scaling.path[path];
                }
            }
            let mut z = vec![0.0; t.stage_width()];
            t.stage_variables(x, point, &mut z);
            problem.stage.hessian(&z, &weights, own);
            for (slot, &(r, c)) in own.iter_mut().zip(&problem.stage.structure().hessian) {
                *slot *= t.stage_scale(r) * t.stage_scale(c);
            }
        });

        let mut slots = at_end.iter_mut();
        if t.end_hessian().next().is_some() {
            let mut weights = vec![0.0; sizes.stage_values()];
            for (path, between) in between[t.points.len() * sizes.path..].iter().enumerate() {
                let row = t.end_path_row(sizes.states + path);
                let own = row.map_or(0.0, |row| multipliers[row]);
                weights[sizes.states + path] = (own + between) / t.scaling.path[path];
            }
            let mut z = vec![0.0; t.stage_width()];
            t.stage_variables(x, t.points.len(), &mut z);
            let mut own = vec![0.0; stage_entries];
            problem.stage.hessian(&z, &weights, &mut own);
            for ((index, (r, c)), slot) in t.end_hessian().zip(&mut slots) {
                *slot = own[index] * t.stage_scale(r) * t.stage_scale(c);
            }
        }
        let ends = &problem.endpoint;
        let mut weights = vec![factor; sizes.endpoint_values()];
        for (row, scale) in t.scaling.ends.iter().enumerate() {
            weights[1 + row] = multipliers[t.end_rows() + t.end_path.len() + row] / scale;
        }
        let mut own = vec![0.0; ends.structure().hessian.len()];
        ends.hessian(&t.endpoint_variables(x), &weights, &mut own);
        for ((entry, &(r, c)), slot) in own.iter().zip(&ends.structure().hessian).zip(slots) {
            *slot = entry * t.endpoint_scale(r) * t.endpoint_scale(c);
        }
    }
}

impl Transcription {
    /// Scale of an end variable (x(0), x(T), T).
    fn endpoint_scale(&self, variable: usize) -> f64 {
        let states = self.problem.sizes.states;
        if variable < 2 * states {
            self.scaling.states[variable % states]
        } else {
            self.scaling.duration_s
        }
    }
}
