//! Sums of squares of affine functions, f(z) = Σ (c + g·z)²: energies and amplitudes.

use super::problem::{Differentiable, Structure};

/// c + g·z.
#[derive(Clone, Debug, PartialEq)]
pub struct Affine {
    /// c.
    pub constant: f64,
    /// g, one for each variable.
    pub gradient: Vec<f64>,
}

impl Affine {
    /// The same times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            constant: factor * self.constant,
            gradient: self.gradient.iter().map(|g| factor * g).collect(),
        }
    }

    /// The sum with another one of the same variables.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let pairs = self.gradient.iter().zip(&other.gradient);
        Self {
            constant: self.constant + other.constant,
            gradient: pairs.map(|(a, b)| a + b).collect(),
        }
    }

    /// Its value.
    #[must_use]
    pub fn at(&self, z: &[f64]) -> f64 {
        let products = self.gradient.iter().zip(z).map(|(g, z)| g * z);
        self.constant + products.sum::<f64>()
    }
}

/// A vector function, each value a sum of squares. All its derivatives are dense.
#[derive(Clone, Debug)]
pub struct Squares {
    rows: Vec<Vec<Affine>>,
    variables: usize,
    structure: Structure,
}

impl Squares {
    /// Rows of functions of as many variables.
    #[must_use]
    pub fn new(rows: Vec<Vec<Affine>>, variables: usize) -> Self {
        let columns = |row: usize| (0..variables).map(move |c| (row, c));
        Self {
            structure: Structure {
                jacobian: (0..rows.len()).flat_map(columns).collect(),
                hessian: (0..variables)
                    .flat_map(|r| (0..=r).map(move |c| (r, c)))
                    .collect(),
            },
            rows,
            variables,
        }
    }
}

impl Differentiable for Squares {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        for (slot, row) in out.iter_mut().zip(&self.rows) {
            *slot = row.iter().map(|f| f.at(z).powi(2)).sum();
        }
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        self.values(z, out);
        entries.fill(0.0);
        let rows = entries.chunks_exact_mut(self.variables);
        for (row, entries) in self.rows.iter().zip(rows) {
            for function in row {
                let value = function.at(z);
                for (entry, g) in entries.iter_mut().zip(&function.gradient) {
                    *entry += 2.0 * value * g;
                }
            }
        }
    }

    fn hessian(&self, _z: &[f64], weights: &[f64], entries: &mut [f64]) {
        entries.fill(0.0);
        for (row, weight) in self.rows.iter().zip(weights) {
            for Affine { gradient: g, .. } in row {
                for (entry, &(r, c)) in entries.iter_mut().zip(&self.structure.hessian) {
                    *entry += 2.0 * weight * g[r] * g[c];
                }
            }
        }
    }
}
