//! Whether an interval keeps its axes' limits between the nodes, too, with a gap that is known.
//!
//! Every polynomial is looked at in 12 N + 1 places and at the N + 1 nodes. The places are
//! x = s (3 − s²)/2 for evenly spaced s: with x = cos θ, |dθ/ds| = 3/√(4 − s²) ≤ √3, so that
//! neighbours are Δθ ≤ √3/(6 N) apart, as close as those of cos θ but for a tenth, and no cosine is
//! needed. A polynomial of degree N whose magnitude is at most m in all these places is nowhere
//! larger than m / cos(N Δθ/2) = m / cos(√3/12) ≤ 1.0106 m (Ehlich and Zeller, "Schwankung von
//! Polynomen zwischen Gitterpunkten", Mathematische Zeitschrift 86 (1964); by M. Riesz' lemma).
//!
//! So a move that keeps its limits everywhere is never refused, and none is accepted that exceeds
//! one by more than 1.06 %, the tolerance of acceptance and, for slopes, twice the rounding below.
//!
//! # Rounding
//! Values: at most 3 N + 4 roundings of 2⁻²⁴, less than a fifth of [`LIMIT_TOLERANCE`]. Slopes:
//! Σ L_j′ (c_j − c_0), at most 4 N + 12 roundings of Σ |L_j′| |c_j − c_0| with every cancellation
//! inside L_j′ undone, and half an ulp of every c_j, which the planner rounded; and half a tick of
//! the duration. This is allowed on top of a slope's limit.

use stillpoint_shared::status::Limit;
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;
use stillpoint_shared::trajectory::QUANTITIES;
use stillpoint_shared::{AxisLimits, Basis, Interval, LIMIT_TOLERANCE};

use crate::limiter::available_torque_nm;

/// Places per point of an interval.
const PLACES_PER_POINT: usize = 12;

/// Relative error of one rounding: 2⁻²⁴.
const HALF_ULP: f32 = f32::EPSILON / 2.0;

/// A limit that is exceeded, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Excess {
    pub(crate) axis: usize,
    /// Local coordinate on [−1, 1].
    pub(crate) x: f32,
    pub(crate) limit: Limit,
    pub(crate) value: f32,
    pub(crate) allowed: f32,
}

/// The limit that speed and torque of a moment exceed, with value and what is allowed.
pub(crate) fn exceeded(
    limits: &AxisLimits,
    speed_rad_per_s: f32,
    torque_nm: f32,
) -> Option<(Limit, f32, f32)> {
    let within = |value: f32, limit: f32| value.abs() <= limit * (1.0 + LIMIT_TOLERANCE);
    if !within(speed_rad_per_s, limits.speed_rad_per_s) {
        Some((Limit::Speed, speed_rad_per_s, limits.speed_rad_per_s))
    } else if !within(torque_nm, limits.torque_nm) {
        Some((Limit::Torque, torque_nm, limits.torque_nm))
    } else if torque_nm.abs() <= available_torque_nm(limits, speed_rad_per_s) {
        None
    } else {
        let available_nm = limits.available_torque_nm(speed_rad_per_s);
        Some((Limit::TorqueSpeed, torque_nm, available_nm))
    }
}

/// The first limit found to be exceeded in an interval whose values at the nodes are finite.
pub(crate) fn check<const AXES: usize>(
    interval: &Interval<'_>,
    basis: &Basis,
    limits: &[AxisLimits],
) -> Option<Excess> {
    let half = (PLACES_PER_POINT / 2 * interval.points) as i16;
    let step = 1.0 / f32::from(half);
    let places = (-half..=half).map(|k| {
        let s = f32::from(k) * step;
        let x = s * (1.5 - 0.5 * s * s);
        // Rounding may lead out of the interval.
        if x.abs() <= 1.0 {
            x
        } else {
            1.0_f32.copysign(x)
        }
    });
    let block = Block::<AXES> {
        rows: interval.coefficients.as_chunks().0.as_chunks().0,
        basis,
        per_second: 2.0 * TIME_TICKS_PER_SECOND as f32 / interval.duration_ticks as f32,
        tick: 0.5 / interval.duration_ticks as f32,
    };
    let nodes = basis.nodes().iter().copied();
    nodes.chain(places).find_map(|x| block.excess(x, limits))
}

/// An interval under examination.
struct Block<'a, const AXES: usize> {
    rows: &'a [[[f32; AXES]; QUANTITIES]],
    basis: &'a Basis,
    /// Slope per second of a slope in the local coordinate.
    per_second: f32,
    /// Relative error of a duration rounded to ticks.
    tick: f32,
}

/// What the axes do in one place: values, and slopes in the local coordinate.
struct At<const AXES: usize> {
    position_slope: [f32; AXES],
    speed_rad_per_s: [f32; AXES],
    torque_nm: [f32; AXES],
    torque_slope: [f32; AXES],
}

impl<const AXES: usize> Block<'_, AXES> {
    // Once in the image.
    #[inline(never)]
    fn excess(&self, x: f32, limits: &[AxisLimits]) -> Option<Excess> {
        let at = self.at(x);
        let values = at.speed_rad_per_s.iter().zip(&at.torque_nm);
        let slopes = at.position_slope.iter().zip(&at.torque_slope);
        for ((axis, limits), ((speed, torque), (position_slope, torque_slope))) in
            limits.iter().enumerate().zip(values.zip(slopes))
        {
            let found = exceeded(limits, *speed, *torque)
                .or_else(|| {
                    let slope = *position_slope;
                    self.steeper(x, (axis, 0), Limit::Speed, slope, limits.speed_rad_per_s)
                })
                .or_else(|| {
                    let (slope, allowed) = (*torque_slope, limits.torque_rate_nm_per_s);
                    self.steeper(x, (axis, 2), Limit::TorqueRate, slope, allowed)
                });
            if let Some((limit, value, allowed)) = found {
                return Some(Excess {
                    axis,
                    x,
                    limit,
                    value,
                    allowed,
                });
            }
        }
        None
    }

    /// The limit, value and what is allowed, if the slope of a channel is too steep.
    #[inline]
    fn steeper(
        &self,
        x: f32,
        channel: (usize, usize),
        limit: Limit,
        slope: f32,
        allowed: f32,
    ) -> Option<(Limit, f32, f32)> {
        let value = slope * self.per_second;
        let most = allowed * (1.0 + LIMIT_TOLERANCE);
        let within = value.abs() <= most
            || value.abs() * (1.0 - self.tick) <= most + self.rounding(x, channel);
        (!within).then_some((limit, value, allowed))
    }

    /// All axes at x.
    fn at(&self, x: f32) -> At<AXES> {
        let mut at = At {
            position_slope: [0.0; AXES],
            speed_rad_per_s: [0.0; AXES],
            torque_nm: [0.0; AXES],
            torque_slope: [0.0; AXES],
        };
        let Some([first_positions, _, first_torques]) = self.rows.first() else {
            return at;
        };
        let add = |sums: &mut [f32; AXES], factor: f32, values: &[f32; AXES]| {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        };
        let add_differences =
            |sums: &mut [f32; AXES], factor: f32, values: &[f32; AXES], first: &[f32; AXES]| {
                for (sum, (value, first)) in sums.iter_mut().zip(values.iter().zip(first)) {
                    *sum += factor * (value - first);
                }
            };
        self.basis.cardinals(x, |j, value, slope| {
            if let Some([positions, speeds, torques]) = self.rows.get(j) {
                add_differences(&mut at.position_slope, slope, positions, first_positions);
                add(&mut at.speed_rad_per_s, value, speeds);
                add(&mut at.torque_nm, value, torques);
                add_differences(&mut at.torque_slope, slope, torques, first_torques);
            }
        });
        at
    }

    /// How far rounding can move the slope of a channel (axis, quantity) at x, per second.
    #[cold]
    #[inline(never)]
    fn rounding(&self, x: f32, (axis, quantity): (usize, usize)) -> f32 {
        let value = |row: &[[f32; AXES]; QUANTITIES]| {
            row.as_flattened().get(quantity * AXES + axis).copied()
        };
        let first = self.rows.first().and_then(value).unwrap_or_default();
        let roundings = (4 * self.basis.points() + 12) as f32;
        let sizes = self.basis.slope_sizes(x);
        let mut sum = 0.0;
        for (size, value) in sizes.iter().zip(self.rows.iter().filter_map(value)) {
            sum += size * (roundings * (value - first).abs() + value.abs());
        }
        sum * HALF_ULP * self.per_second
    }
}
