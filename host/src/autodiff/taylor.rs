//! Functions of time with every rounding error: enclosures of value, first derivative and half the second derivative.

use super::{Interval, Scalar, remaining_operators};
use std::ops::{Add, Mul, Sub};

/// What is known of a function f of one variable on a piece of it: f, f′ and f″/2 stay in these intervals there.
///
/// Functions that are not written out below are unknown: [`Interval::ENTIRE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taylor {
    /// f.
    pub value: Interval,
    /// f′.
    pub slope: Interval,
    /// f″/2.
    pub curve: Interval,
}

impl Taylor {
    /// φ(f) of a function φ with φ, φ′ and φ″/2 at the values of f.
    fn compose(self, value: Interval, slope: Interval, curve: Interval) -> Self {
        Self {
            value,
            slope: slope * self.slope,
            curve: slope * self.curve + curve * self.slope * self.slope,
        }
    }
}

impl Scalar for Taylor {
    fn constant(value: f64) -> Self {
        let zero = Interval::point(0.0);
        Self {
            value: Interval::point(value),
            slope: zero,
            curve: zero,
        }
    }
    fn value(&self) -> f64 {
        self.value.middle()
    }
    fn chain(self, _f: f64, _df: f64, _ddf: f64) -> Self {
        // A function of which only one value is given may be anything elsewhere.
        Self {
            value: Interval::ENTIRE,
            slope: Interval::ENTIRE,
            curve: Interval::ENTIRE,
        }
    }
    fn recip(self) -> Self {
        let r = self.value.recip();
        let r2 = r * r;
        self.compose(r, -r2, r2 * r)
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        let r = root.recip();
        let slope = r * 0.5;
        self.compose(root, slope, -(slope * r * r * 0.25))
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (
            self.compose(sin, cos, sin * -0.5),
            self.compose(cos, -sin, cos * -0.5),
        )
    }
}

impl Add for Taylor {
    type Output = Self;
    fn add(self, rhs: Self) -> Self {
        Self {
            value: self.value + rhs.value,
            slope: self.slope + rhs.slope,
            curve: self.curve + rhs.curve,
        }
    }
}

impl Sub for Taylor {
    type Output = Self;
    fn sub(self, rhs: Self) -> Self {
        Self {
            value: self.value - rhs.value,
            slope: self.slope - rhs.slope,
            curve: self.curve - rhs.curve,
        }
    }
}

impl Mul for Taylor {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        Self {
            value: self.value * rhs.value,
            slope: self.value * rhs.slope + self.slope * rhs.value,
            curve: self.value * rhs.curve + self.slope * rhs.slope + self.curve * rhs.value,
        }
    }
}

impl Add<f64> for Taylor {
    type Output = Self;
    fn add(self, rhs: f64) -> Self {
        Self {
            value: self.value + Interval::point(rhs),
            ..self
        }
    }
}

impl Mul<f64> for Taylor {
    type Output = Self;
    fn mul(self, rhs: f64) -> Self {
        Self {
            value: self.value * rhs,
            slope: self.slope * rhs,
            curve: self.curve * rhs,
        }
    }
}

remaining_operators!([] Taylor);

#[cfg(test)]
mod tests {
    use super::{Interval, Scalar, Taylor};
    use crate::autodiff::SecondDual;

    /// Something of everything that is known.
    fn function<S: Scalar>(x: S) -> S {
        let (sin, cos) = (x * 2.0 - 0.5).sin_cos();
        (sin * x + (cos * cos + x + 1.0).sqrt()) / (x * x + 0.7) - x * 3.0
    }

    #[test]
    fn derivatives_all_over_a_piece_are_held() {
        for piece in 0..20 {
            let (low, high) = (0.05 * f64::from(piece), 0.05 * f64::from(piece + 1));
            let x = Taylor {
                value: Interval::new(low, high),
                slope: Interval::point(1.0),
                curve: Interval::point(0.0),
            };
            let held = function(x);
            for k in 0..=10 {
                let at = low + (high - low) * f64::from(k) / 10.0;
                let exact = function(SecondDual::<1, 1>::seed(at, 0));
                for (interval, value) in [
                    (held.value, exact.value),
                    (held.slope, exact.gradient[0]),
                    (held.curve, exact.hessian[0] / 2.0),
                ] {
                    assert!(
                        interval.low <= value && value <= interval.high,
                        "{value} outside {interval:?} at {at}"
                    );
                    // Of use, too: not much wider than what the function does there.
                    assert!(interval.high - interval.low < 15.0, "{interval:?} at {at}");
                }
            }
        }
    }

    #[test]
    fn at_a_point_only_rounding_is_left() {
        let x = Taylor {
            value: Interval::point(0.3),
            slope: Interval::point(1.0),
            curve: Interval::point(0.0),
        };
        let held = function(x);
        for interval in [held.value, held.slope, held.curve] {
            assert!(interval.high - interval.low < 1e-13, "{interval:?}");
        }
    }

    #[test]
    fn an_unknown_function_may_be_anything() {
        assert_eq!(Taylor::constant(0.5).acos().value, Interval::ENTIRE);
    }
}
