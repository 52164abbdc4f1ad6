//! Whether an interval keeps its axes' limits between the nodes, too, with a gap that is known.
//!
//! Every polynomial is looked at in 16 N + 1 places and at the N + 1 nodes. The places are
//! x = s (3 − s²)/2 for evenly spaced s: with x = cos θ, |dθ/ds| = 3/√(4 − s²) ≤ √3, so that
//! neighbours are Δθ ≤ √3/(8 N) apart, as close as those of cos θ but for a tenth, and no cosine is
//! needed. A polynomial of degree N whose magnitude is at most m in all these places is nowhere
//! larger than m / cos(N Δθ/2) = m / cos(√3/16) ≤ 1.0059 m (Ehlich and Zeller, "Schwankung von
//! Polynomen zwischen Gitterpunkten", Mathematische Zeitschrift 86 (1964); by M. Riesz' lemma).
//!
//! So a move that keeps its limits everywhere is never refused, and none is accepted that exceeds
//! one by more than 0.6 %, the tolerance of acceptance and, for slopes, twice the rounding below.
//!
//! # Rounding
//! Values: at most 3 N + 4 roundings of 2⁻²⁴, less than a fifth of [`LIMIT_TOLERANCE`]. Slopes:
//! Σ L_j′ (c_j − c_0), at most 4 N + 12 roundings of Σ |L_j′| |c_j − c_0| with every cancellation
//! inside L_j′ undone, and half an ulp of every c_j, which the planner rounded; and half a tick of
//! the duration. This is allowed on top of a slope's limit.

use stillpoint_shared::status::Limit;
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;
use stillpoint_shared::trajectory::QUANTITIES;
use stillpoint_shared::{AxisLimits, Basis, Interval, LIMIT_TOLERANCE, MAX_AXES};

use crate::limiter::available_torque_nm;

/// Places per point of an interval.
const PLACES_PER_POINT: usize = 16;

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

/// What an axis does in one place: values, and slopes in the local coordinate.
#[derive(Debug, Clone, Copy, Default)]
struct AxisPlace {
    position_slope: f32,
    speed_rad_per_s: f32,
    torque_nm: f32,
    torque_slope: f32,
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
pub(crate) fn check(
    interval: &Interval<'_>,
    basis: &Basis,
    limits: &[AxisLimits],
) -> Option<Excess> {
    let half = PLACES_PER_POINT / 2 * interval.points;
    let step = 1.0 / half as f32;
    let places = (0..=2 * half).map(|k| {
        let s = (k as f32 - half as f32) * step;
        let x = s * (1.5 - 0.5 * s * s);
        if x.abs() <= 1.0 {
            x
        } else {
            1.0_f32.copysign(x)
        }
    });
    let mut nodes = basis.nodes().iter().copied();
    let block = Block {
        rows: interval.coefficients,
        basis,
        axes: limits.len(),
        per_second: 2.0 * TIME_TICKS_PER_SECOND as f32 / interval.duration_ticks as f32,
        tick: 0.5 / interval.duration_ticks as f32,
    };
    nodes
        .find_map(|x| block.excess(x, limits))
        .or_else(|| places.into_iter().find_map(|x| block.excess(x, limits)))
}

/// An interval under examination.
struct Block<'a> {
    rows: &'a [f32],
    basis: &'a Basis,
    axes: usize,
    /// Slope per second of a slope in the local coordinate.
    per_second: f32,
    /// Relative error of a duration rounded to ticks.
    tick: f32,
}

impl Block<'_> {
    fn excess(&self, x: f32, limits: &[AxisLimits]) -> Option<Excess> {
        let at = self.at(x);
        for ((axis, limits), place) in limits.iter().enumerate().zip(&at) {
            let slopes = [
                (
                    Limit::Speed,
                    0,
                    place.position_slope,
                    limits.speed_rad_per_s,
                ),
                (
                    Limit::TorqueRate,
                    2,
                    place.torque_slope,
                    limits.torque_rate_nm_per_s,
                ),
            ];
            let found = exceeded(limits, place.speed_rad_per_s, place.torque_nm).or_else(|| {
                slopes
                    .into_iter()
                    .find_map(|(limit, quantity, slope, allowed)| {
                        let value = slope * self.per_second;
                        let most = allowed * (1.0 + LIMIT_TOLERANCE);
                        let within = value.abs() <= most
                            || value.abs() * (1.0 - self.tick)
                                <= most + self.rounding(x, quantity * self.axes + axis);
                        (!within).then_some((limit, value, allowed))
                    })
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

    /// All axes at x.
    fn at(&self, x: f32) -> [AxisPlace; MAX_AXES] {
        let mut at = [AxisPlace::default(); MAX_AXES];
        let axes = self.axes;
        let cardinals = self.basis.cardinals(x, false);
        let rows = || self.rows.chunks_exact((QUANTITIES * axes).max(1));
        let Some(first) = rows().next() else {
            return at;
        };
        for ((row, value), slope) in rows().zip(&cardinals.values).zip(&cardinals.slopes) {
            let (positions, rest) = row.split_at_checked(axes).unwrap_or_default();
            let (speeds, torques) = rest.split_at_checked(axes).unwrap_or_default();
            let (first_positions, rest) = first.split_at_checked(axes).unwrap_or_default();
            let first_torques = rest.get(axes..).unwrap_or_default();
            let own = positions.iter().zip(speeds).zip(torques);
            let own = own.zip(first_positions.iter().zip(first_torques));
            for (place, (((position, speed), torque), (start, first_torque))) in
                at.iter_mut().zip(own)
            {
                place.position_slope += slope * (position - start);
                place.speed_rad_per_s += value * speed;
                place.torque_nm += value * torque;
                place.torque_slope += slope * (torque - first_torque);
            }
        }
        at
    }

    /// How far rounding can move the slope of a channel at x, per second.
    #[cold]
    #[inline(never)]
    fn rounding(&self, x: f32, channel: usize) -> f32 {
        let values = self.rows.iter().skip(channel);
        let mut values = values.step_by((QUANTITIES * self.axes).max(1));
        let first = values.clone().next().copied().unwrap_or_default();
        let cardinals = self.basis.cardinals(x, true);
        let roundings = (4 * self.basis.points() + 12) as f32;
        let sum: f32 = cardinals
            .slopes
            .iter()
            .map_while(|slope| {
                let value = values.next()?;
                Some(slope * (roundings * (value - first).abs() + value.abs()))
            })
            .sum();
        sum * HALF_ULP * self.per_second
    }
}
