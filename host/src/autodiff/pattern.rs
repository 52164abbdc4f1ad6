//! Structure instead of numbers: which variables a result depends on, and which pairs of them
//! it depends on nonlinearly. Sizes sparse Jacobians and Hessians without trusting sample values.

use super::{Scalar, remaining_operators};
use std::ops::{Add, Mul, Sub};

/// At most this many variables can be traced.
const MAX_VARIABLES: usize = 64;

/// Dependence on up to 64 variables: `first` has bit i when the result may depend on variable i,
/// `second[i]` has bit j when ∂²/∂i∂j may differ from zero.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// Variables that the value depends on.
    pub first: u64,
    /// Symmetric pattern of the Hessian.
    pub second: [u64; MAX_VARIABLES],
    value: f64,
}

impl Pattern {
    /// Variable number `index`, at a value that decides which branch the model takes.
    ///
    /// # Panics
    /// If `index >= 64`.
    #[must_use]
    pub fn seed(value: f64, index: usize) -> Self {
        assert!(
            index < MAX_VARIABLES,
            "a pattern traces at most 64 variables"
        );
        Self {
            first: 1 << index,
            ..Self::constant(value)
        }
    }

    fn merge(mut self, rhs: Self, value: f64) -> Self {
        self.first |= rhs.first;
        for (a, b) in self.second.iter_mut().zip(&rhs.second) {
            *a |= b;
        }
        self.value = value;
        self
    }

    fn couple(&mut self, a: u64, b: u64) {
        for i in 0..MAX_VARIABLES {
            if a >> i & 1 == 1 {
                self.second[i] |= b;
            }
            if b >> i & 1 == 1 {
                self.second[i] |= a;
            }
        }
    }
}

impl Scalar for Pattern {
    fn constant(value: f64) -> Self {
        Self {
            first: 0,
            second: [0; MAX_VARIABLES],
            value,
        }
    }
    fn value(&self) -> f64 {
        self.value
    }
    fn chain(mut self, f: f64, _df: f64, _ddf: f64) -> Self {
        self.couple(self.first, self.first);
        self.value = f;
        self
    }
}

impl Add for Pattern {
    type Output = Self;
    fn add(self, rhs: Self) -> Self {
        self.merge(rhs, self.value + rhs.value)
    }
}

impl Sub for Pattern {
    type Output = Self;
    fn sub(self, rhs: Self) -> Self {
        self.merge(rhs, self.value - rhs.value)
    }
}

impl Mul for Pattern {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        let mut out = self.merge(rhs, self.value * rhs.value);
        out.couple(self.first, rhs.first);
        out
    }
}

impl Add<f64> for Pattern {
    type Output = Self;
    fn add(mut self, rhs: f64) -> Self {
        self.value += rhs;
        self
    }
}

impl Mul<f64> for Pattern {
    type Output = Self;
    fn mul(mut self, rhs: f64) -> Self {
        self.value *= rhs;
        self
    }
}

remaining_operators!([] Pattern);
