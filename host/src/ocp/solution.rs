//! The continuous answer: polynomials through the nodes of every interval.

use super::lgr::{Rule, lagrange_basis};
use super::mesh::Mesh;
use nalgebra::DMatrix;

/// States and controls as piecewise polynomials of time.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Duration T, s.
    pub duration_s: f64,
    /// The mesh it lives on.
    pub mesh: Mesh,
    /// Collocation rule of each interval.
    pub rules: Vec<Rule>,
    /// States at the support points, one column each: the collocation points in the order of time and the end.
    pub states: DMatrix<f64>,
    /// Controls at the collocation points, one column each.
    pub controls: DMatrix<f64>,
}

/// Where a moment lies in the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Index of the interval.
    pub interval: usize,
    /// Index of the interval's first point among all points.
    pub first_point: usize,
    /// Local coordinate in [−1, 1].
    pub local: f64,
}

impl Solution {
    /// Start and length of every interval, s.
    pub fn intervals_s(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let mut start = 0.0;
        self.mesh.intervals().iter().map(move |interval| {
            let length = interval.fraction * self.duration_s;
            let this = (start, length);
            start += length;
            this
        })
    }

    /// Times of the support points, s: one for each column of `states`.
    #[must_use]
    pub fn support_times_s(&self) -> Vec<f64> {
        let mut times = Vec::with_capacity(self.states.ncols());
        for ((start, length), rule) in self.intervals_s().zip(&self.rules) {
            let points = rule.support[..rule.points()].iter();
            times.extend(points.map(|x| start + length * (x + 1.0) / 2.0));
        }
        times.push(self.duration_s);
        times
    }

    /// The interval that a share s ∈ [0, 1] of the duration falls into.
    #[must_use]
    pub fn place(&self, share: f64) -> Place {
        let (mut start, mut first_point) = (0.0, 0);
        let intervals = self.mesh.intervals();
        for (interval, spec) in intervals.iter().enumerate() {
            if share <= start + spec.fraction || interval + 1 == intervals.len() {
                let local = 2.0 * (share - start) / spec.fraction - 1.0;
                return Place {
                    interval,
                    first_point,
                    local: local.clamp(-1.0, 1.0),
                };
            }
            start += spec.fraction;
            first_point += spec.points;
        }
        Place {
            interval: 0,
            first_point: 0,
            local: -1.0,
        }
    }

    /// State polynomials at a place.
    #[must_use]
    pub fn state_at(&self, place: Place) -> Vec<f64> {
        combine(&self.states, place.first_point, &self.bases(place).0)
    }

    /// Bases of the state polynomials (N + 1) and of the control polynomials (N) at a place.
    pub(super) fn bases(&self, place: Place) -> (Vec<f64>, Vec<f64>) {
        let rule = &self.rules[place.interval];
        let (mut states, mut controls) = (vec![0.0; rule.support.len()], vec![0.0; rule.points()]);
        lagrange_basis(&rule.support, &rule.barycentric, place.local, &mut states);
        lagrange_basis(
            &rule.support[..rule.points()],
            &rule.control_barycentric,
            place.local,
            &mut controls,
        );
        (states, controls)
    }

    /// Control polynomials at a place: through the collocation points, extrapolated to the end of the interval.
    #[must_use]
    pub fn control_at(&self, place: Place) -> Vec<f64> {
        combine(&self.controls, place.first_point, &self.bases(place).1)
    }

    /// State polynomials at a share of the duration.
    #[must_use]
    pub fn state_at_share(&self, share: f64) -> Vec<f64> {
        self.state_at(self.place(share))
    }

    /// Control polynomials at a share of the duration.
    #[must_use]
    pub fn control_at_share(&self, share: f64) -> Vec<f64> {
        self.control_at(self.place(share))
    }
}

fn combine(values: &DMatrix<f64>, first: usize, basis: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; values.nrows()];
    for (column, weight) in basis.iter().enumerate() {
        for (slot, value) in sum.iter_mut().zip(values.column(first + column).iter()) {
            *slot += weight * value;
        }
    }
    sum
}
