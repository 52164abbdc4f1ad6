//! What the executor makes of a polynomial in f32: how far its values, and their steps from tick to tick, can be from it.
//!
//! [`Basis::evaluate`](stillpoint_shared::Basis::evaluate) computes Σ c_j w_j Π (x − x_i) in a fixed order. With
//! u = 2⁻²⁴ every term of N + 1 has N differences, at most N + 1 products and a rounded weight, one product with c_j, and at
//! most N additions: at most k = 3N + 3 roundings, so |computed − exact| ≤ k u/(1 − k u) Σ |L_j| |c_j| (Higham, "Accuracy and
//! Stability of Numerical Algorithms", 2002, §3.1). Underflow adds less than the smallest normal number per term.
//!
//! Its coordinate x is at most 4 u from that of the time: a rounded scale, a rounded count, their product and one sum.

use stillpoint_shared::time::{self, DRIVE_PERIOD_TICKS};

/// Relative error of one rounding to f32: 2⁻²⁴.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// How far an evaluated value can be from the exact one, for N = `points` and a bound on Σ |L_j| |c_j|.
pub(super) fn rounding(points: usize, absolute: f64) -> f64 {
    let k = (3 * points + 3) as f64 * ROUNDING;
    k / (1.0 - k) * absolute + (points + 1) as f64 * f64::from(f32::MIN_POSITIVE)
}

/// Largest |step| per tick of the drive loop, over the tick.
///
/// From the largest `rate` (per s), the largest product of rate and duration of an interval, the largest rounding error of
/// a value and the sum of all jumps where intervals meet.
pub(super) fn step_rate(rate: f64, rate_by_duration: f64, rounding: f64, jumps: f64) -> f64 {
    let period_s = time::seconds(DRIVE_PERIOD_TICKS);
    let coordinate = 9.0 * ROUNDING * 0.5 * rate_by_duration;
    rate + (coordinate + 2.0 * rounding + jumps) / period_s
}
