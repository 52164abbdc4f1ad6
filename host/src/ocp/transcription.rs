//! Multi-interval LGR collocation: an [`OptimalControlProblem`] on a [`Mesh`] becomes a sparse nonlinear program.
//!
//! Unknowns, scaled to the order of one, in the order of time: x and u at each collocation point, x at the end, T.
//! Rows: at each collocation point i of an interval that takes the share w of T, the defects
//!
//! ```text
//! Σⱼ D_ij xⱼ − (w T / 2) f(x_i, u_i) = 0
//! ```
//!
//! and the path function; at the end the path function where it does not need a control; then the end function; then
//! limits at places between the points ([`Sample`]).
//! The running cost is integrated by the rule's quadrature.

use super::guess::Guess;
use super::lgr::Rule;
use super::mesh::Mesh;
use super::problem::{Bounds, OptimalControlProblem};
use super::sample::{Limited, Sample, SampleRow};
use super::scaling::Scaling;
use super::solution::Solution;
use nalgebra::DMatrix;
use std::sync::Arc;

mod nlp;
mod samples;
mod structure;
mod transfer;
pub use nlp::CollocationNlp;
pub use transfer::Hamiltonian;

/// A problem on a mesh.
#[derive(Debug)]
pub struct Transcription {
    pub(super) problem: Arc<OptimalControlProblem>,
    pub(super) mesh: Mesh,
    pub(super) rules: Vec<Rule>,
    pub(super) scaling: Scaling,
    pub(super) points: Vec<Point>,
    /// Path functions imposed at the points.
    pub(super) point_path: Vec<usize>,
    /// Those of them that can be imposed at the end, where there is no control.
    pub(super) end_path: Vec<usize>,
    pub(super) samples: Vec<SampleRow>,
}

/// A collocation point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Interval it belongs to.
    pub(super) interval: usize,
    /// First point of that interval.
    pub(super) first: usize,
    /// Index within the interval.
    pub(super) index: usize,
    /// w/2: ∂t/∂ξ over T.
    pub(super) half_share: f64,
}

/// What a row of the nonlinear program is, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct RowMeaning {
    /// Name of the state whose dynamics it is, or of the path or end quantity.
    pub name: String,
    /// Whether it is a defect of the dynamics.
    pub defect: bool,
    /// Moment as share of the duration.
    pub share: f64,
    /// Physical value per unit of the scaled row.
    pub scale: f64,
    /// Bounds in physical units.
    pub bounds: Bounds,
}

/// What a variable of the nonlinear program is, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct VariableMeaning {
    /// Name of the state or control.
    pub name: String,
    /// Moment as share of the duration.
    pub share: f64,
}

impl Transcription {
    /// Transcribes a problem on a mesh, scaled by a first guess.
    ///
    /// # Panics
    /// Never for a [`Mesh`], whose intervals all have at least two points.
    #[must_use]
    pub fn new(problem: Arc<OptimalControlProblem>, mesh: Mesh, guess: &Guess) -> Self {
        let scaling = Scaling::automatic(&problem, guess);
        Self::with_scaling(problem, mesh, scaling)
    }

    /// Transcribes a problem on a mesh with a given scaling.
    ///
    /// # Panics
    /// Never for a [`Mesh`], whose intervals all have at least two points.
    #[must_use]
    pub fn with_scaling(problem: Arc<OptimalControlProblem>, mesh: Mesh, scaling: Scaling) -> Self {
        let rules: Vec<Rule> = mesh
            .intervals()
            .iter()
            .map(|interval| {
                Rule::new(interval.points).expect("a mesh has at least two points in an interval")
            })
            .collect();
        let mut points = Vec::with_capacity(mesh.points());
        for (interval, spec) in mesh.intervals().iter().enumerate() {
            let first = points.len();
            points.extend((0..spec.points).map(|index| Point {
                interval,
                first,
                index,
                half_share: spec.fraction / 2.0,
            }));
        }
        let all: Vec<usize> = (0..problem.sizes.path).collect();
        Self {
            problem,
            mesh,
            rules,
            scaling,
            points,
            point_path: Vec::new(),
            end_path: Vec::new(),
            samples: Vec::new(),
        }
        .with_path(all)
    }

    /// The same with these path functions alone imposed at the points, in ascending order: the others are not limited there.
    #[must_use]
    pub fn with_path(mut self, rows: Vec<usize>) -> Self {
        let at_end = rows
            .iter()
            .copied()
            .filter(|&row| !self.problem.path_needs_control(row));
        self.end_path = at_end.collect();
        self.point_path = rows;
        self
    }

    /// The same with limits at places between the points, in place of any it had.
    #[must_use]
    pub fn with_samples(mut self, samples: &[Sample]) -> Self {
        let mut firsts = vec![0; self.rules.len()];
        for point in &self.points {
            firsts[point.interval] = point.first;
        }
        let rows = samples.iter().map(|sample| {
            let on_points = match sample.limited {
                Limited::State(_) => false,
                Limited::Control(_) | Limited::Slope(_) => true,
                Limited::Path(row) => self.problem.path_needs_control(row),
            };
            let rule = &self.rules[sample.interval];
            SampleRow::new(*sample, firsts[sample.interval], rule, on_points)
        });
        self.samples = rows.collect();
        self
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The same problem, scaling, path functions and samples on another mesh of as many intervals.
    #[must_use]
    pub fn on_mesh(&self, mesh: Mesh) -> Self {
        Self::with_scaling(Arc::clone(&self.problem), mesh, self.scaling.clone())
            .with_path(self.point_path.clone())
            .with_samples(&self.samples())
    }

    /// Its limits between the points.
    #[must_use]
    pub fn samples(&self) -> Vec<Sample> {
        self.samples.iter().map(|row| row.sample).collect()
    }

    /// The scaling in use.
    #[must_use]
    pub fn scaling(&self) -> &Scaling {
        &self.scaling
    }

    pub(super) fn stage_width(&self) -> usize {
        self.problem.sizes.stage_variables()
    }

    /// First variable of a support point (the end is the one after the last collocation point).
    pub(super) fn node(&self, point: usize) -> usize {
        point * self.stage_width()
    }

    pub(super) fn duration_variable(&self) -> usize {
        self.node(self.points.len()) + self.problem.sizes.states
    }

    /// Number of variables.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.duration_variable() + 1
    }

    pub(super) fn rows_per_point(&self) -> usize {
        self.problem.sizes.states + self.point_path.len()
    }

    /// Row, among those of a point, of a stage value: of f, or of a path function imposed at the points.
    pub(super) fn point_row(&self, value: usize) -> Option<usize> {
        let states = self.problem.sizes.states;
        match value.checked_sub(states) {
            None => Some(value),
            Some(path) => Some(states + self.point_path.binary_search(&path).ok()?),
        }
    }

    pub(super) fn end_rows(&self) -> usize {
        self.points.len() * self.rows_per_point()
    }

    /// Number of constraints.
    #[must_use]
    pub fn constraints(&self) -> usize {
        self.sample_rows() + self.samples.len()
    }

    /// First row of the samples.
    pub(super) fn sample_rows(&self) -> usize {
        self.end_rows() + self.end_path.len() + self.problem.sizes.endpoint
    }

    /// Scale and name of what a sample limits.
    fn limited(&self, limited: Limited) -> (f64, &str) {
        let scale = match limited {
            Limited::State(i) => self.scaling.states[i],
            Limited::Control(i) => self.scaling.controls[i],
            Limited::Path(i) | Limited::Slope(i) => self.scaling.path[i],
        };
        (scale, &self.problem.quantity(limited).name)
    }

    /// Scale of a stage variable (x then u).
    pub(super) fn stage_scale(&self, variable: usize) -> f64 {
        let states = self.problem.sizes.states;
        if variable < states {
            self.scaling.states[variable]
        } else {
            self.scaling.controls[variable - states]
        }
    }

    /// Physical stage variables at a support point from scaled unknowns; at the end the controls are zero.
    pub(super) fn stage_variables(&self, x: &[f64], point: usize, z: &mut [f64]) {
        let states = self.problem.sizes.states;
        let base = self.node(point);
        for (i, slot) in z.iter_mut().enumerate() {
            *slot = if i < states {
                x[base + i] * self.scaling.states[i] + self.scaling.shift[i]
            } else if point < self.points.len() {
                x[base + i] * self.scaling.controls[i - states]
            } else {
                0.0
            };
        }
    }

    /// (x(0), x(T), T) in physical units.
    pub(super) fn endpoint_variables(&self, x: &[f64]) -> Vec<f64> {
        let states = self.problem.sizes.states;
        let mut z = vec![0.0; 2 * states + 1];
        self.stage_variables(x, 0, &mut z[..states]);
        self.stage_variables(x, self.points.len(), &mut z[states..2 * states]);
        z[2 * states] = self.duration(x);
        z
    }

    pub(super) fn duration(&self, x: &[f64]) -> f64 {
        x[self.duration_variable()] * self.scaling.duration_s
    }

    /// Scaled unknowns of a guess.
    #[must_use]
    pub fn unknowns(&self, guess: &Guess) -> Vec<f64> {
        let states = self.problem.sizes.states;
        let mut x = vec![0.0; self.variables()];
        let mut start = 0.0;
        let mut shares = Vec::with_capacity(self.points.len() + 1);
        for (spec, rule) in self.mesh.intervals().iter().zip(&self.rules) {
            let points = rule.support[..spec.points].iter();
            shares.extend(points.map(|p| start + spec.fraction * (p + 1.0) / 2.0));
            start += spec.fraction;
        }
        shares.push(1.0);
        for (point, share) in shares.into_iter().enumerate() {
            let (state, control) = guess.at(share);
            let base = self.node(point);
            for (i, value) in state.iter().enumerate() {
                x[base + i] = (value - self.scaling.shift[i]) / self.scaling.states[i];
            }
            if point < self.points.len() {
                for (i, value) in control.iter().enumerate() {
                    x[base + states + i] = value / self.scaling.controls[i];
                }
            }
        }
        x[self.duration_variable()] = guess.duration_s() / self.scaling.duration_s;
        x
    }

    /// The piecewise polynomials of scaled unknowns.
    #[must_use]
    pub fn solution(&self, x: &[f64]) -> Solution {
        let sizes = self.problem.sizes;
        let mut states = DMatrix::zeros(sizes.states, self.points.len() + 1);
        let mut controls = DMatrix::zeros(sizes.controls, self.points.len());
        let mut z = vec![0.0; self.stage_width()];
        for point in 0..=self.points.len() {
            self.stage_variables(x, point, &mut z);
            states.column_mut(point).copy_from_slice(&z[..sizes.states]);
            if point < self.points.len() {
                controls
                    .column_mut(point)
                    .copy_from_slice(&z[sizes.states..]);
            }
        }
        Solution {
            duration_s: self.duration(x),
            mesh: self.mesh.clone(),
            rules: self.rules.clone(),
            states,
            controls,
        }
    }

    /// Share of the duration at a support point.
    pub(super) fn share(&self, point: usize) -> f64 {
        let Some(at) = self.points.get(point) else {
            return 1.0;
        };
        self.share_of(at.interval, self.rules[at.interval].support[at.index])
    }

    /// Share of the duration at a place.
    fn share_of(&self, interval: usize, local: f64) -> f64 {
        let (before, from) = self.mesh.intervals().split_at(interval);
        let before: f64 = before.iter().map(|i| i.fraction).sum();
        before + from[0].fraction / 2.0 * (local + 1.0)
    }

    /// What each row means.
    #[must_use]
    pub fn row_meanings(&self) -> Vec<RowMeaning> {
        let problem = &self.problem;
        let mut rows = Vec::with_capacity(self.constraints());
        let path = |row: usize, share| RowMeaning {
            name: problem.path[row].name.clone(),
            defect: false,
            share,
            scale: self.scaling.path[row],
            bounds: problem.path[row].bounds,
        };
        for point in 0..self.points.len() {
            let share = self.share(point);
            rows.extend(
                problem
                    .states
                    .iter()
                    .zip(&self.scaling.states)
                    .map(|(state, &scale)| RowMeaning {
                        name: state.name.clone(),
                        defect: true,
                        share,
                        scale,
                        bounds: Bounds::fixed(0.0),
                    }),
            );
            rows.extend(self.point_path.iter().map(|&row| path(row, share)));
        }
        rows.extend(self.end_path.iter().map(|&row| path(row, 1.0)));
        rows.extend(
            problem
                .ends
                .iter()
                .zip(&self.scaling.ends)
                .map(|(end, &scale)| RowMeaning {
                    name: end.name.clone(),
                    defect: false,
                    share: 1.0,
                    scale,
                    bounds: end.bounds,
                }),
        );
        rows.extend(self.samples.iter().map(|row| {
            let (scale, name) = self.limited(row.sample.limited);
            RowMeaning {
                name: name.to_owned(),
                defect: false,
                share: self.share_of(row.sample.interval, row.sample.local),
                scale,
                bounds: row.sample.bounds,
            }
        }));
        rows
    }

    /// What each variable means; its duration is not among them.
    #[must_use]
    pub fn variable_meanings(&self) -> Vec<VariableMeaning> {
        let problem = &self.problem;
        let mut all = Vec::with_capacity(self.variables());
        for point in 0..=self.points.len() {
            let share = self.share(point);
            let controls = if point < self.points.len() {
                problem.controls.as_slice()
            } else {
                &[]
            };
            all.extend(
                problem
                    .states
                    .iter()
                    .chain(controls)
                    .map(|quantity| VariableMeaning {
                        name: quantity.name.clone(),
                        share,
                    }),
            );
        }
        all
    }
}
