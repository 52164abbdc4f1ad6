//! Any model written over [`Scalar`] becomes a [`Differentiable`] function: structure is traced once,
//! then each Jacobian column and each Hessian pair that can differ from zero is seeded.

use super::problem::{Differentiable, Structure};
use crate::autodiff::{Dual, Pattern, Scalar, SecondDual};

/// A vector function of `variables()` numbers, written over the scalar.
pub trait Model: Send + Sync {
    /// Length of the argument.
    fn variables(&self) -> usize;
    /// Length of the result.
    fn values(&self) -> usize;
    /// Evaluates the function.
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]);
}

/// A [`Model`] with its exact derivatives.
#[derive(Clone, Debug)]
pub struct Exact<M> {
    model: M,
    structure: Structure,
}

impl<M: Model> Exact<M> {
    /// Traces the structure of a model of at most 64 variables.
    pub fn new(model: M) -> Self {
        let n = model.variables();
        // The point only has to be generic; no branch of a smooth model depends on it.
        let z: Vec<Pattern> = (0..n)
            .map(|i| Pattern::seed(0.5 + 0.01 * i as f64, i))
            .collect();
        let mut out = vec![Pattern::constant(0.0); model.values()];
        model.evaluate(&z, &mut out);
        let mut structure = Structure::default();
        for (row, value) in out.iter().enumerate() {
            structure.jacobian.extend(
                (0..n)
                    .filter(|&c| value.first >> c & 1 == 1)
                    .map(|c| (row, c)),
            );
        }
        for row in 0..n {
            let pairs = out.iter().fold(0, |bits, value| bits | value.second[row]);
            structure
                .hessian
                .extend((0..=row).filter(|&c| pairs >> c & 1 == 1).map(|c| (row, c)));
        }
        Self { model, structure }
    }
}

impl<M: Model> Differentiable for Exact<M> {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        self.model.evaluate(z, out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let n = z.len();
        let mut arguments: Vec<Dual<1>> = z.iter().map(|&x| Dual::constant(x)).collect();
        let mut values = vec![Dual::constant(0.0); self.model.values()];
        let mut dense = vec![0.0; self.model.values() * n];
        for column in 0..n {
            arguments[column] = Dual::seed(z[column], 0);
            self.model.evaluate(&arguments, &mut values);
            arguments[column] = Dual::constant(z[column]);
            for (row, value) in values.iter().enumerate() {
                dense[row * n + column] = value.gradient[0];
            }
        }
        for (slot, value) in out.iter_mut().zip(&values) {
            *slot = value.value;
        }
        for (entry, &(row, column)) in entries.iter_mut().zip(&self.structure.jacobian) {
            *entry = dense[row * n + column];
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        type Pair = SecondDual<2, 3>;
        let mut arguments: Vec<Pair> = z.iter().map(|&x| Pair::constant(x)).collect();
        let mut values = vec![Pair::constant(0.0); self.model.values()];
        for (entry, &(row, column)) in entries.iter_mut().zip(&self.structure.hessian) {
            arguments[row] = Pair::seed(z[row], 0);
            if column != row {
                arguments[column] = Pair::seed(z[column], 1);
            }
            self.model.evaluate(&arguments, &mut values);
            arguments[row] = Pair::constant(z[row]);
            arguments[column] = Pair::constant(z[column]);
            // Packed lower triangle: (0,0), (1,0), (1,1).
            let slot = usize::from(row != column);
            *entry = values
                .iter()
                .zip(weights)
                .map(|(value, weight)| weight * value.hessian[slot])
                .sum();
        }
    }
}
