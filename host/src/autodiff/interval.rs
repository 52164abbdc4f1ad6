//! Numbers with their rounding errors: intervals of f64, rounded outwards.
//!
//! Every operation returns an interval that holds all results of the exact operation on numbers of its operands: the
//! rounded ends are moved to the next f64. What is undefined anywhere on the operands is [`Interval::ENTIRE`].

use std::ops::{Add, Mul, Neg, Sub};

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Least.
    pub low: f64,
    /// Greatest.
    pub high: f64,
}

impl Interval {
    /// Every number: nothing is known.
    pub const ENTIRE: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// One number.
    #[must_use]
    pub fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// From one number to another.
    #[must_use]
    pub fn new(low: f64, high: f64) -> Self {
        if low <= high {
            Self { low, high }
        } else {
            Self::ENTIRE
        }
    }

    /// The computed ends moved outwards by what one operation rounds.
    fn outward(low: f64, high: f64) -> Self {
        Self::new(low.next_down(), high.next_up())
    }

    /// The numbers at most `radius` from these.
    #[must_use]
    pub fn widened(self, radius: f64) -> Self {
        Self::outward(self.low - radius, self.high + radius)
    }

    /// Largest magnitude.
    #[must_use]
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Smallest magnitude.
    #[must_use]
    pub fn mignitude(self) -> f64 {
        if self.low > 0.0 {
            self.low
        } else if self.high < 0.0 {
            -self.high
        } else {
            0.0
        }
    }

    /// A number near the middle.
    #[must_use]
    pub fn middle(self) -> f64 {
        0.5 * self.low + 0.5 * self.high
    }

    /// Half the width, rounded up: no number is further from [`Interval::middle`].
    #[must_use]
    pub fn radius(self) -> f64 {
        let middle = self.middle();
        (self.high - middle).max(middle - self.low).next_up()
    }

    /// 1/x; everything if 0 is among the numbers.
    #[must_use]
    pub fn recip(self) -> Self {
        if self.low > 0.0 || self.high < 0.0 {
            Self::outward(1.0 / self.high, 1.0 / self.low)
        } else {
            Self::ENTIRE
        }
    }

    /// √x; everything if a negative number is among them.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.low >= 0.0 {
            // No square root is negative.
            let Self { low, high } = Self::outward(self.low.sqrt(), self.high.sqrt());
            Self::new(low.max(0.0), high)
        } else {
            Self::ENTIRE
        }
    }

    /// Sine and cosine of angles in rad: by the mean value theorem from the middle, with four ulp of 1 for the library's.
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        const LIBRARY: f64 = 4.0 * f64::EPSILON;
        let (sin, cos) = self.middle().sin_cos();
        let radius = self.radius();
        let within = |value: f64, slope: f64| {
            let steepest = (slope.abs() + LIBRARY + radius).min(1.0);
            let reach = (radius * steepest).next_up() + LIBRARY;
            let wide = Self::point(value).widened(reach);
            Self::new(wide.low.max(-1.0), wide.high.min(1.0))
        };
        (within(sin, cos), within(cos, sin))
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, rhs: Self) -> Self {
        Self::outward(self.low + rhs.low, self.high + rhs.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, rhs: Self) -> Self {
        Self::outward(self.low - rhs.high, self.high - rhs.low)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        let products = [
            self.low * rhs.low,
            self.low * rhs.high,
            self.high * rhs.low,
            self.high * rhs.high,
        ];
        // Zero times everything is no number.
        if products.iter().any(|product| product.is_nan()) {
            return Self::ENTIRE;
        }
        let (mut low, mut high) = (products[0], products[0]);
        for product in &products[1..] {
            low = low.min(*product);
            high = high.max(*product);
        }
        Self::outward(low, high)
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    fn mul(self, rhs: f64) -> Self {
        let (a, b) = (self.low * rhs, self.high * rhs);
        if a.is_nan() || b.is_nan() {
            return Self::ENTIRE;
        }
        Self::outward(a.min(b), a.max(b))
    }
}

#[cfg(test)]
mod tests {
    use super::Interval;
    use proptest::prelude::*;

    fn holds(interval: Interval, value: f64) -> bool {
        interval.low <= value && value <= interval.high
    }

    /// An interval, and a number in it.
    fn inside() -> impl Strategy<Value = (Interval, f64)> {
        (-4.0..4.0_f64, 0.0..3.0_f64, 0.0..=1.0_f64).prop_map(|(low, width, share)| {
            let high = low + width;
            (Interval::new(low, high), (low + share * width).min(high))
        })
    }

    proptest! {
        #[test]
        fn every_result_is_held((a, x) in inside(), (b, y) in inside()) {
            prop_assert!(holds(a + b, x + y));
            prop_assert!(holds(a - b, x - y));
            prop_assert!(holds(a * b, x * y));
            prop_assert!(holds(a * -0.3, x * -0.3));
            prop_assert!(holds(a.recip(), 1.0 / x));
            prop_assert!(x < 0.0 || holds(a.sqrt(), x.sqrt()));
            let (sin, cos) = a.sin_cos();
            prop_assert!(holds(sin, x.sin()) && holds(cos, x.cos()));
            prop_assert!((x - a.middle()).abs() <= a.radius());
            prop_assert!(a.mignitude() <= x.abs() && x.abs() <= a.magnitude());
        }
    }

    #[test]
    fn ends_move_outwards() {
        // 0.1 + 0.2 is not 0.3 in f64, but the interval holds it.
        let sum = Interval::point(0.1) + Interval::point(0.2);
        assert!(holds(sum, 0.3) && sum.low < sum.high);
        let third = Interval::point(3.0).recip();
        assert!(third.low < third.high);
        let (sin, _) = Interval::new(0.0, 10.0).sin_cos();
        assert_eq!((sin.low, sin.high), (-1.0, 1.0));
    }

    #[test]
    fn what_is_undefined_is_everything() {
        assert_eq!(Interval::new(-1.0, 1.0).recip(), Interval::ENTIRE);
        assert_eq!(Interval::new(-1e-9, 1.0).sqrt(), Interval::ENTIRE);
        assert_eq!(Interval::point(f64::NAN), Interval::ENTIRE);
        assert_eq!(Interval::ENTIRE * Interval::point(0.0), Interval::ENTIRE);
        assert_eq!(Interval::ENTIRE * 0.0, Interval::ENTIRE);
    }
}
