//! A function put together from functions of some of its variables: its structure shows the blocks.

use super::problem::{Differentiable, Structure};

/// A function, the variables that it takes and the rows that it fills.
pub struct Part {
    /// The function.
    pub function: Box<dyn Differentiable>,
    /// For each of its variables the variable of the whole, ascending.
    pub variables: Vec<usize>,
    /// For each of its values the row of the whole.
    pub rows: Vec<usize>,
}

/// The sum of linear terms and [`Part`]s. No two of them may share an entry of the Jacobian or of the Hessian.
pub struct Parts {
    parts: Vec<Part>,
    linear: Vec<(usize, usize, f64)>,
    structure: Structure,
}

impl Parts {
    /// Of parts and of linear terms (row, variable, factor).
    #[must_use]
    pub fn new(parts: Vec<Part>, linear: Vec<(usize, usize, f64)>) -> Self {
        let mut structure = Structure::default();
        let terms = linear.iter().map(|&(row, variable, _)| (row, variable));
        structure.jacobian.extend(terms);
        for part in &parts {
            let own = part.function.structure();
            let jacobian = own.jacobian.iter();
            structure
                .jacobian
                .extend(jacobian.map(|&(r, c)| (part.rows[r], part.variables[c])));
            let hessian = own.hessian.iter();
            structure
                .hessian
                .extend(hessian.map(|&(r, c)| (part.variables[r], part.variables[c])));
        }
        Self {
            parts,
            linear,
            structure,
        }
    }

    fn add_linear(&self, z: &[f64], out: &mut [f64]) {
        for &(row, variable, factor) in &self.linear {
            out[row] += factor * z[variable];
        }
    }
}

impl Part {
    fn arguments(&self, z: &[f64]) -> Vec<f64> {
        self.variables.iter().map(|&i| z[i]).collect()
    }

    fn add(&self, values: &[f64], out: &mut [f64]) {
        for (value, &row) in values.iter().zip(&self.rows) {
            out[row] += value;
        }
    }
}

impl Differentiable for Parts {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn values(&self, z: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.add_linear(z, out);
        for part in &self.parts {
            let mut values = vec![0.0; part.rows.len()];
            part.function.values(&part.arguments(z), &mut values);
            part.add(&values, out);
        }
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        out.fill(0.0);
        self.add_linear(z, out);
        let (linear, mut rest) = entries.split_at_mut(self.linear.len());
        for (entry, &(_, _, factor)) in linear.iter_mut().zip(&self.linear) {
            *entry = factor;
        }
        for part in &self.parts {
            let (own, after) = rest.split_at_mut(part.function.structure().jacobian.len());
            let mut values = vec![0.0; part.rows.len()];
            part.function.jacobian(&part.arguments(z), &mut values, own);
            part.add(&values, out);
            rest = after;
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let mut rest = entries;
        for part in &self.parts {
            let (own, after) = rest.split_at_mut(part.function.structure().hessian.len());
            let weights: Vec<f64> = part.rows.iter().map(|&row| weights[row]).collect();
            part.function.hessian(&part.arguments(z), &weights, own);
            rest = after;
        }
    }
}
