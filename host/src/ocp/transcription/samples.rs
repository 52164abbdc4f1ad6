//! Rows of the limits between the points; see [`crate::ocp::Sample`]. Everything is scaled as at the nodes.

use super::Transcription;
use crate::ocp::sample::Limited;

impl Transcription {
    /// Values of the samples' rows from those of the stage functions at all support points.
    pub(super) fn sample_values(&self, x: &[f64], stage: &[f64], values: &mut [f64]) {
        let sizes = self.problem.sizes;
        for (slot, row) in values.iter_mut().zip(&self.samples) {
            let at_nodes = row.basis.iter().zip(row.first..);
            let sum = |value: &dyn Fn(usize) -> f64| -> f64 {
                at_nodes.clone().map(|(l, node)| l * value(node)).sum()
            };
            *slot = match row.sample.limited {
                Limited::State(i) => {
                    sum(&|node| x[self.node(node) + i])
                        + self.scaling.shift[i] / self.scaling.states[i]
                }
                Limited::Control(i) => sum(&|node| x[self.node(node) + sizes.states + i]),
                Limited::Path(i) | Limited::Slope(i) => {
                    let width = sizes.stage_values();
                    sum(&|node| stage[node * width + sizes.states + i]) / self.scaling.path[i]
                }
            };
        }
    }

    /// Entries of the Jacobian in the samples' rows.
    pub(super) fn samples_structure(&self, entries: &mut Vec<(usize, usize)>) {
        let states = self.problem.sizes.states;
        for (index, row) in self.samples.iter().enumerate() {
            let own = self.sample_rows() + index;
            for node in (row.first..).take(row.basis.len()) {
                let base = self.node(node);
                match row.sample.limited {
                    Limited::State(i) => entries.push((own, base + i)),
                    Limited::Control(i) => entries.push((own, base + states + i)),
                    Limited::Path(i) | Limited::Slope(i) => {
                        let columns = self.path_entries(i).map(|(_, column)| (own, base + column));
                        entries.extend(columns);
                    }
                }
            }
        }
    }

    /// Fills them, from the Jacobian entries of the stage functions at all support points.
    pub(super) fn samples_jacobian<'a>(
        &self,
        stage: &[f64],
        mut slots: impl Iterator<Item = &'a mut f64>,
    ) {
        let per_node = self.problem.stage.structure().jacobian.len();
        let mut put = |value: f64| {
            if let Some(slot) = slots.next() {
                *slot = value;
            }
        };
        for row in &self.samples {
            for (l, node) in row.basis.iter().zip(row.first..) {
                let (Limited::Path(i) | Limited::Slope(i)) = row.sample.limited else {
                    put(*l);
                    continue;
                };
                for (entry, column) in self.path_entries(i) {
                    let derivative = stage[node * per_node + entry];
                    put(l * derivative * self.stage_scale(column) / self.scaling.path[i]);
                }
            }
        }
    }

    /// What the samples' multipliers add to those of the path rows, support point by support point.
    pub(super) fn sample_weights(&self, multipliers: &[f64]) -> Vec<f64> {
        let path = self.problem.sizes.path;
        let mut weights = vec![0.0; (self.points.len() + 1) * path];
        for (row, multiplier) in self.samples.iter().zip(multipliers) {
            if let Limited::Path(i) | Limited::Slope(i) = row.sample.limited {
                for (l, node) in row.basis.iter().zip(row.first..) {
                    weights[node * path + i] += l * multiplier;
                }
            }
        }
        weights
    }

    /// Jacobian entries of a path function: index in the stage's structure, and variable.
    fn path_entries(&self, path: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let own = self.problem.sizes.states + path;
        let entries = self.problem.stage.structure().jacobian.iter().enumerate();
        entries.filter_map(move |(index, &(row, column))| (row == own).then_some((index, column)))
    }
}
