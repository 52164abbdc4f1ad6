//! First-order forward mode: a value and its gradient with respect to `N` seeds.

use super::{Scalar, remaining_operators};
use std::ops::{Add, Mul, Sub};

/// Value and gradient with respect to `N` seeded variables.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// Value.
    pub value: f64,
    /// ∂value/∂seed.
    pub gradient: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Seed number `index`.
    ///
    /// # Panics
    /// If `index >= N`.
    #[must_use]
    pub fn seed(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; N];
        gradient[index] = 1.0;
        Self { value, gradient }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: [0.0; N],
        }
    }
    fn value(&self) -> f64 {
        self.value
    }
    fn chain(self, f: f64, df: f64, _ddf: f64) -> Self {
        Self {
            value: f,
            gradient: self.gradient.map(|g| df * g),
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(mut self, rhs: Self) -> Self {
        self.value += rhs.value;
        for (a, b) in self.gradient.iter_mut().zip(&rhs.gradient) {
            *a += b;
        }
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(mut self, rhs: Self) -> Self {
        self.value -= rhs.value;
        for (a, b) in self.gradient.iter_mut().zip(&rhs.gradient) {
            *a -= b;
        }
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(mut self, rhs: Self) -> Self {
        for (a, b) in self.gradient.iter_mut().zip(&rhs.gradient) {
            *a = *a * rhs.value + self.value * b;
        }
        self.value *= rhs.value;
        self
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    fn add(mut self, rhs: f64) -> Self {
        self.value += rhs;
        self
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(mut self, rhs: f64) -> Self {
        self.value *= rhs;
        for a in &mut self.gradient {
            *a *= rhs;
        }
        self
    }
}

remaining_operators!([const N: usize] Dual<N>);
