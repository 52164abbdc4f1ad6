//! Exact derivatives by overloading: one model, written once over [`Scalar`], is evaluated with
//! `f64` for values, [`Dual`] for first and [`SecondDual`] for second derivatives, [`Pattern`] for
//! the structure of both, and [`Taylor`] for proofs: all of it over a stretch of time, rounding included.

mod dual;
mod interval;
mod pattern;
mod second;
mod taylor;

pub use dual::Dual;
pub use interval::Interval;
pub use pattern::Pattern;
pub use second::SecondDual;
pub use taylor::Taylor;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// The arithmetic that models are written in.
///
/// Implemented by `f64` and by the derivative types; every function here has its exact first and
/// second derivative in each of them. Outside a function's domain the result is NaN, never a panic.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// A constant: all derivatives are zero.
    fn constant(value: f64) -> Self;
    /// The plain value.
    fn value(&self) -> f64;
    /// Applies a function given its value and first two derivatives at [`Scalar::value`].
    fn chain(self, f: f64, df: f64, ddf: f64) -> Self;

    /// 1/x.
    fn recip(self) -> Self {
        let r = 1.0 / self.value();
        self.chain(r, -r * r, 2.0 * r * r * r)
    }
    /// Square root.
    fn sqrt(self) -> Self {
        let r = self.value().sqrt();
        self.chain(r, 0.5 / r, -0.25 / (r * r * r))
    }
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value().sin_cos();
        (self.chain(s, c, -s), self.chain(c, -s, -c))
    }
    /// Natural exponential.
    fn exp(self) -> Self {
        let e = self.value().exp();
        self.chain(e, e, e)
    }
    /// Inverse tangent, in radians.
    fn atan(self) -> Self {
        let x = self.value();
        let d = 1.0 / (1.0 + x * x);
        self.chain(x.atan(), d, -2.0 * x * d * d)
    }
    /// Inverse cosine, in radians.
    fn acos(self) -> Self {
        let x = self.value();
        let d = 1.0 / (1.0 - x * x).sqrt();
        self.chain(x.acos(), -d, -x * d * d * d)
    }
    /// Angle of the vector (`x`, `self`) in (−π, π].
    fn atan2(self, x: Self) -> Self {
        let angle = self.value().atan2(x.value());
        // The derivative is that of atan(y/x) or, near the y axis, of −atan(x/y); only the value differs.
        let local = if x.value().abs() >= self.value().abs() {
            (self / x).atan()
        } else {
            -(x / self).atan()
        };
        local + (angle - local.value())
    }
    /// x².
    fn square(self) -> Self {
        self * self
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(&self) -> f64 {
        *self
    }
    fn chain(self, f: f64, _df: f64, _ddf: f64) -> Self {
        f
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
}

/// The operators that follow from `+ - *` with `Self`, [`Scalar::chain`] and scaling.
macro_rules! remaining_operators {
    ([$($generics:tt)*] $type:ty) => {
        impl<$($generics)*> std::ops::Div for $type {
            type Output = Self;
            #[expect(clippy::suspicious_arithmetic_impl, reason = "a quotient is a product with the reciprocal")]
            fn div(self, rhs: Self) -> Self {
                self * $crate::autodiff::Scalar::recip(rhs)
            }
        }
        impl<$($generics)*> std::ops::Neg for $type {
            type Output = Self;
            fn neg(self) -> Self {
                self * -1.0
            }
        }
        impl<$($generics)*> std::ops::Sub<f64> for $type {
            type Output = Self;
            fn sub(self, rhs: f64) -> Self {
                self + -rhs
            }
        }
        impl<$($generics)*> std::ops::AddAssign for $type {
            fn add_assign(&mut self, rhs: Self) {
                *self = *self + rhs;
            }
        }
        impl<$($generics)*> std::ops::SubAssign for $type {
            fn sub_assign(&mut self, rhs: Self) {
                *self = *self - rhs;
            }
        }
    };
}
use remaining_operators;

#[cfg(test)]
mod tests;
