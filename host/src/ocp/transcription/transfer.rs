//! Multipliers on another mesh, and what they say about the answer.
//!
//! The multipliers Λ of the defects are the costates times the quadrature weights (Garg et al., Automatica 46, 2010): on a
//! mesh of the same duration, a multiplier per weight and share of the interval is a density that does not depend on it.

use super::Transcription;
use crate::nlp::{Multipliers, Outcome, Start};
use crate::ocp::guess::Guess;

/// The Hamiltonian H = L + λ·f along an answer. The problem does not depend on time, so H is constant, and equal to −∂Φ/∂T where the
/// duration is free: −1 for the fastest move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hamiltonian {
    /// Its mean over the duration.
    pub mean: f64,
    /// Root of the mean square of its deviation from the mean.
    pub spread: f64,
    /// Its largest deviation from the mean at a collocation point.
    pub largest: f64,
}

impl Transcription {
    /// Share of the duration that a collocation point stands for: half its interval's share times its weight.
    fn weight(&self, point: usize) -> f64 {
        let at = self.points[point];
        at.half_share * self.rules[at.interval].weights[at.index]
    }

    /// Start of this program from the answer of one of the same problem and scaling, whose samples are the first of this
    /// one's.
    #[must_use]
    pub fn start_from(&self, other: &Self, outcome: &Outcome) -> Start {
        let shares: Vec<f64> = (0..other.points.len())
            .map(|point| other.share(point))
            .collect();
        let states = self.problem.sizes.states;
        let width = self.stage_width();
        let old = &outcome.multipliers;
        let mut new = Multipliers {
            constraints: vec![0.0; self.constraints()],
            lower: vec![0.0; self.variables()],
            upper: vec![0.0; self.variables()],
        };
        for point in 0..self.points.len() {
            for (near, part) in neighbours(&shares, self.share(point)) {
                let factor = part * self.weight(point) / other.weight(near);
                let (to, from) = (point * self.rows_per_point(), near * other.rows_per_point());
                add(
                    &mut new.constraints[to..],
                    &old.constraints[from..],
                    states,
                    factor,
                );
                for (row, &path) in (to + states..).zip(&self.point_path) {
                    if let Some(own) = other.point_row(states + path) {
                        new.constraints[row] += factor * old.constraints[from + own];
                    }
                }
                let (to, from) = (self.node(point), other.node(near));
                add(&mut new.lower[to..], &old.lower[from..], width, factor);
                add(&mut new.upper[to..], &old.upper[from..], width, factor);
            }
        }
        // The end, the duration and the samples are the same on both.
        let (to, from) = (self.node(self.points.len()), other.node(other.points.len()));
        add(&mut new.lower[to..], &old.lower[from..], usize::MAX, 1.0);
        add(&mut new.upper[to..], &old.upper[from..], usize::MAX, 1.0);
        for &path in &self.end_path {
            let rows = [self, other].map(|program| program.end_path_row(states + path));
            if let [Some(to), Some(from)] = rows {
                new.constraints[to] = old.constraints[from];
            }
        }
        let (to, from) = [self, other]
            .map(|t| t.end_rows() + t.end_path.len())
            .into();
        add(
            &mut new.constraints[to..],
            &old.constraints[from..],
            usize::MAX,
            1.0,
        );
        Start {
            x: if self.mesh == other.mesh {
                outcome.x.clone()
            } else {
                self.unknowns(&Guess::from_solution(other.solution(&outcome.x)))
            },
            warm: Some(new),
        }
    }

    /// The Hamiltonian of an answer.
    #[must_use]
    pub fn hamiltonian(&self, outcome: &Outcome) -> Hamiltonian {
        let sizes = self.problem.sizes;
        let mut z = vec![0.0; self.stage_width()];
        let mut stage = vec![0.0; sizes.stage_values()];
        let values: Vec<(f64, f64)> = (0..self.points.len())
            .map(|point| {
                self.stage_variables(&outcome.x, point, &mut z);
                self.problem.stage.values(&z, &mut stage);
                let multipliers = &outcome.multipliers.constraints[point * self.rows_per_point()..];
                let sum: f64 = (0..sizes.states)
                    .map(|i| multipliers[i] * stage[i] / self.scaling.states[i])
                    .sum();
                // The defects subtract f.
                let at = self.points[point];
                let costate = sum / self.rules[at.interval].weights[at.index];
                let cost = stage[sizes.states + sizes.path];
                (self.weight(point), cost - costate * self.scaling.objective)
            })
            .collect();
        let mean: f64 = values.iter().map(|(weight, h)| weight * h).sum();
        let square: f64 = values
            .iter()
            .map(|(weight, h)| weight * (h - mean).powi(2))
            .sum();
        Hamiltonian {
            mean,
            spread: square.sqrt(),
            largest: values.iter().fold(0.0, |m, (_, h)| m.max((h - mean).abs())),
        }
    }
}

/// The points around a share of the duration, with their parts in linear interpolation.
fn neighbours(shares: &[f64], share: f64) -> [(usize, f64); 2] {
    let after = shares
        .partition_point(|&s| s <= share)
        .min(shares.len() - 1)
        .max(1);
    let (left, right) = (shares[after - 1], shares[after]);
    let part = ((share - left) / (right - left)).clamp(0.0, 1.0);
    [(after - 1, 1.0 - part), (after, part)]
}

/// Adds the first `count` numbers times a factor.
fn add(to: &mut [f64], from: &[f64], count: usize, factor: f64) {
    for (to, from) in to.iter_mut().zip(from).take(count) {
        *to += factor * from;
    }
}
