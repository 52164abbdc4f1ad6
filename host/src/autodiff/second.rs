//! Second-order forward mode: value, gradient and the lower triangle of the Hessian.
//!
//! Storing one triangle halves the work of the general hyper-dual types; the constant `H` has to be
//! given because stable Rust cannot yet compute array lengths from `N`.

use super::{Scalar, remaining_operators};
use std::ops::{Add, Mul, Sub};

/// Value, gradient and packed lower triangle of the Hessian with respect to `N` seeds;
/// `H` = N(N+1)/2, entry (i, j ≤ i) at i(i+1)/2 + j.
#[derive(Clone, Copy, Debug)]
pub struct SecondDual<const N: usize, const H: usize> {
    /// Value.
    pub value: f64,
    /// ∂value/∂seed.
    pub gradient: [f64; N],
    /// ∂²value/∂seed², lower triangle by rows.
    pub hessian: [f64; H],
}

impl<const N: usize, const H: usize> SecondDual<N, H> {
    const PACKED: () = assert!(H == N * (N + 1) / 2);

    /// Seed number `index`.
    ///
    /// # Panics
    /// If `index >= N`.
    #[must_use]
    pub fn seed(value: f64, index: usize) -> Self {
        let mut this = Self::constant(value);
        this.gradient[index] = 1.0;
        this
    }
}

impl<const N: usize, const H: usize> Scalar for SecondDual<N, H> {
    fn constant(value: f64) -> Self {
        let () = Self::PACKED;
        Self {
            value,
            gradient: [0.0; N],
            hessian: [0.0; H],
        }
    }
    fn value(&self) -> f64 {
        self.value
    }
    #[inline]
    fn chain(mut self, f: f64, df: f64, ddf: f64) -> Self {
        let mut k = 0;
        for i in 0..N {
            let scaled = ddf * self.gradient[i];
            for j in 0..=i {
                self.hessian[k] = df * self.hessian[k] + scaled * self.gradient[j];
                k += 1;
            }
        }
        for g in &mut self.gradient {
            *g *= df;
        }
        self.value = f;
        self
    }
}

impl<const N: usize, const H: usize> Add for SecondDual<N, H> {
    type Output = Self;
    #[inline]
    fn add(mut self, rhs: Self) -> Self {
        self.value += rhs.value;
        for (a, b) in self.gradient.iter_mut().zip(&rhs.gradient) {
            *a += b;
        }
        for (a, b) in self.hessian.iter_mut().zip(&rhs.hessian) {
            *a += b;
        }
        self
    }
}

impl<const N: usize, const H: usize> Sub for SecondDual<N, H> {
    type Output = Self;
    #[inline]
    fn sub(mut self, rhs: Self) -> Self {
        self.value -= rhs.value;
        for (a, b) in self.gradient.iter_mut().zip(&rhs.gradient) {
            *a -= b;
        }
        for (a, b) in self.hessian.iter_mut().zip(&rhs.hessian) {
            *a -= b;
        }
        self
    }
}

impl<const N: usize, const H: usize> Mul for SecondDual<N, H> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        let mut out = Self::constant(self.value * rhs.value);
        let mut k = 0;
        for i in 0..N {
            let (a, b) = (self.gradient[i], rhs.gradient[i]);
            for j in 0..=i {
                out.hessian[k] = self.value * rhs.hessian[k]
                    + self.hessian[k] * rhs.value
                    + a * rhs.gradient[j]
                    + self.gradient[j] * b;
                k += 1;
            }
            out.gradient[i] = self.value * b + a * rhs.value;
        }
        out
    }
}

impl<const N: usize, const H: usize> Add<f64> for SecondDual<N, H> {
    type Output = Self;
    #[inline]
    fn add(mut self, rhs: f64) -> Self {
        self.value += rhs;
        self
    }
}

impl<const N: usize, const H: usize> Mul<f64> for SecondDual<N, H> {
    type Output = Self;
    #[inline]
    fn mul(mut self, rhs: f64) -> Self {
        self.value *= rhs;
        for a in &mut self.gradient {
            *a *= rhs;
        }
        for a in &mut self.hessian {
            *a *= rhs;
        }
        self
    }
}

remaining_operators!([const N: usize, const H: usize] SecondDual<N, H>);
