//! Sums of norms of affine functions: what bounds the amplitude of a vibration.
//!
//! ```text
//! f(z) = Σ √(Σ (c + g·z)² + s²)
//! ```
//!
//! The small s makes it smooth where all functions vanish, and only larger: never by more than Σ s.

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
}

/// √(Σ (c + g·z)² + s²).
#[derive(Clone, Debug, PartialEq)]
pub struct Norm {
    /// s, positive.
    pub smoothing: f64,
    /// What is summed up.
    pub functions: Vec<Affine>,
}

/// A vector function, each value a sum of [`Norm`]s. All its derivatives are dense.
#[derive(Clone, Debug)]
pub struct Norms {
    rows: Vec<Vec<Norm>>,
    variables: usize,
    structure: Structure,
}

impl Norms {
    /// Rows of norms of functions of as many variables.
    #[must_use]
    pub fn new(rows: Vec<Vec<Norm>>, variables: usize) -> Self {
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

impl Norm {
    /// Values of the affine functions, and their norm.
    fn at(&self, z: &[f64]) -> (Vec<f64>, f64) {
        let values: Vec<f64> = (self.functions.iter())
            .map(|f| f.constant + f.gradient.iter().zip(z).map(|(g, z)| g * z).sum::<f64>())
            .collect();
        let sum: f64 = values.iter().map(|v| v * v).sum();
        (values, (sum + self.smoothing * self.smoothing).sqrt())
    }

    /// ∂(norm)/∂z = Σ value g / norm.
    fn slope(&self, values: &[f64], norm: f64, variables: usize) -> Vec<f64> {
        let mut slope = vec![0.0; variables];
        for (function, value) in self.functions.iter().zip(values) {
            for (slot, g) in slope.iter_mut().zip(&function.gradient) {
                *slot += value * g / norm;
            }
        }
        slope
    }
}

impl Differentiable for Norms {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        for (slot, row) in out.iter_mut().zip(&self.rows) {
            *slot = row.iter().map(|norm| norm.at(z).1).sum();
        }
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        entries.fill(0.0);
        let rows = entries.chunks_exact_mut(self.variables);
        for ((slot, row), entries) in out.iter_mut().zip(&self.rows).zip(rows) {
            *slot = 0.0;
            for term in row {
                let (values, norm) = term.at(z);
                *slot += norm;
                let slope = term.slope(&values, norm, self.variables);
                for (entry, slope) in entries.iter_mut().zip(slope) {
                    *entry += slope;
                }
            }
        }
    }

    /// ∂²(norm)/∂z² = (Σ g gᵀ − slope slopeᵀ) / norm.
    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        entries.fill(0.0);
        for (row, weight) in self.rows.iter().zip(weights) {
            for term in row {
                let (values, norm) = term.at(z);
                let slope = term.slope(&values, norm, self.variables);
                let factor = weight / norm;
                for (entry, &(r, c)) in entries.iter_mut().zip(&self.structure.hessian) {
                    let functions = term.functions.iter();
                    let sum: f64 = functions.map(|f| f.gradient[r] * f.gradient[c]).sum();
                    *entry += factor * (sum - slope[r] * slope[c]);
                }
            }
        }
    }
}
