//! Costates from the multipliers of the nonlinear program.
//!
//! Garg et al., "Direct trajectory optimization and costate estimation of finite-horizon and infinite-horizon optimal
//! control problems using a Radau pseudospectral method", Comput. Optim. Appl. 49 (2011): with the Lagrangian J + Λ·defects
//! and the Hamiltonian H = L + λ·f, the costate at a collocation point is λ = −Λ/w with the quadrature weight w. They are
//! values of a polynomial of degree N − 1 in every interval.

use super::lgr::lagrange_basis;
use super::problem::OptimalControlProblem;
use super::solution::{Place, Solution};
use super::transcription::Transcription;
use crate::nlp::Multipliers;
use nalgebra::DMatrix;

/// Costates λ, in units of the objective per unit of the state.
#[derive(Clone, Debug)]
pub struct Costates {
    /// One column for each collocation point.
    pub values: DMatrix<f64>,
}

impl Costates {
    /// Costates of a solved transcription; zero if there are no multipliers.
    #[must_use]
    pub fn of(transcription: &Transcription, multipliers: &Multipliers) -> Self {
        let scaling = transcription.scaling();
        let states = transcription.problem.sizes.states;
        let values = DMatrix::from_fn(states, transcription.points.len(), |state, point| {
            let at = transcription.points[point];
            let weight = transcription.rules[at.interval].weights[at.index];
            let row = point * transcription.rows_per_point() + state;
            let multiplier = multipliers.constraints.get(row).copied().unwrap_or(0.0);
            -multiplier * scaling.objective / (weight * scaling.states[state])
        });
        Self { values }
    }

    /// Costates at a place of the mesh that `solution` lives on.
    #[must_use]
    pub fn at(&self, solution: &Solution, place: Place) -> Vec<f64> {
        let rule = &solution.rules[place.interval];
        let nodes = &rule.support[..rule.points()];
        let mut basis = vec![0.0; nodes.len()];
        lagrange_basis(nodes, &rule.control_barycentric, place.local, &mut basis);
        let columns = self.values.columns(place.first_point, nodes.len());
        (columns.row_iter())
            .map(|row| row.iter().zip(&basis).map(|(value, b)| value * b).sum())
            .collect()
    }
}

/// The Hamiltonian and its derivatives with respect to the controls at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct HamiltonianAt {
    /// H = L + λ·f.
    pub value: f64,
    /// ∂H/∂u, the switching functions of a problem that is affine in its controls.
    pub by_control: Vec<f64>,
}

impl HamiltonianAt {
    /// At states x, controls u and costates λ.
    #[must_use]
    pub fn at(problem: &OptimalControlProblem, x: &[f64], u: &[f64], costates: &[f64]) -> Self {
        let sizes = problem.sizes;
        let z: Vec<f64> = x.iter().chain(u).copied().collect();
        let structure = &problem.stage.structure().jacobian;
        let mut values = vec![0.0; sizes.stage_values()];
        let mut entries = vec![0.0; structure.len()];
        problem.stage.jacobian(&z, &mut values, &mut entries);
        let cost = sizes.states + sizes.path;
        let weight = |row: usize| match row {
            row if row < sizes.states => costates[row],
            row if row == cost => 1.0,
            _ => 0.0,
        };
        let mut by_control = vec![0.0; sizes.controls];
        for (entry, &(row, variable)) in entries.iter().zip(structure) {
            if let Some(control) = variable.checked_sub(sizes.states) {
                by_control[control] += weight(row) * entry;
            }
        }
        Self {
            value: values.iter().enumerate().map(|(r, v)| weight(r) * v).sum(),
            by_control,
        }
    }
}
