//! The path speed σ on its way to a wanted one, one tick at a time.
//!
//! [`pace`](crate::pace) says what torque a change of σ takes. In every tick
//!
//! 1. the wish: a bounded, jerk-limited σ̇ that reaches the wanted speed with σ̇ = 0. Downwards as
//!    fast as that allows, σ̇² ≤ 2 j |e| in its discrete form; upwards with σ̇ = e/T in the end, for
//!    at full speed the plan leaves no torque rate to land with;
//! 2. the windows: per axis, the σ̇ with which the torque A σ² + B σ̇ + G stays within the torque
//!    limit and within one step of the torque-rate limit of the torque sent before. The wish is
//!    moved into all of them. With B = 0, σ̇ = 0 is in every window of a plan that keeps its limits,
//!    for A σ² never changes faster than A. With B ≠ 0 the axes' windows may have nothing in
//!    common; then the middle is taken, the limiter keeps the set-points inside and raises a flag.
//!
//! The windows come before the wish: torque and torque rate are hard limits, the jerk of σ is not.

use crate::pace::RampLimits;
use crate::path_time::{FULL_SPEED, speed_ratio};
use crate::root::square_root;

/// Share of u/B that a jerk may take; the rest is the plan's.
const JERK_SHARE: f32 = 0.6;

/// Least share of the jerk where the plan's own torque rate leaves nothing by the worst case.
const LEAST_SHARE: f32 = 0.02;

/// Distance from the wanted speed that counts as there.
const THERE: f32 = 3e-6;

/// What an axis' torque depends on in this tick, and where it has to stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLoad {
    /// A: planned torque without its static part, in N·m.
    pub planned_nm: f32,
    /// G: static torque in N·m.
    pub static_nm: f32,
    /// B: torque per σ̇, in N·m·s.
    pub momentum_nms: f32,
    /// Least torque that may be sent, in N·m.
    pub least_nm: f32,
    /// Greatest torque that may be sent, in N·m.
    pub most_nm: f32,
}

impl AxisLoad {
    /// No torque, none allowed.
    pub const NONE: Self = Self {
        planned_nm: 0.0,
        static_nm: 0.0,
        momentum_nms: 0.0,
        least_nm: 0.0,
        most_nm: 0.0,
    };
}

/// Path speed and its change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// σ, 1 = [`FULL_SPEED`].
    speed: u32,
    /// σ̇ in 1/s at the end of the last step.
    change_per_s: f32,
}

impl Ramp {
    /// An even speed.
    #[inline]
    pub const fn at(speed: u32) -> Self {
        Self {
            speed,
            change_per_s: 0.0,
        }
    }

    /// σ, 1 = [`FULL_SPEED`].
    #[inline]
    pub fn speed(&self) -> u32 {
        self.speed
    }

    /// Whether σ is the wanted speed and stays so.
    #[inline]
    pub fn is_at(&self, wanted: u32) -> bool {
        self.speed == wanted && self.change_per_s == 0.0
    }

    /// σ one period later if it goes on changing as it does.
    #[inline]
    pub fn next_speed(&self, period_s: f32) -> u32 {
        if self.change_per_s == 0.0 {
            self.speed
        } else {
            moved(self.speed, self.change_per_s * period_s)
        }
    }

    /// Moves σ by one period towards `wanted`; returns the σ̇ in 1/s it moved with.
    pub fn step(
        &mut self,
        wanted: u32,
        limits: &RampLimits,
        period_s: f32,
        loads: &[AxisLoad],
    ) -> f32 {
        let before = speed_ratio(self.speed);
        let distance = speed_ratio(wanted) - before;
        let landing = JERK_SHARE * limits.jerk_per_s2 * share_left(wanted) * period_s;
        if distance == 0.0 && self.change_per_s.abs() <= landing {
            // The tick after it got there: now it stays.
            *self = Self::at(wanted);
            return 0.0;
        }
        let wish = self.wish(wanted, distance, before, limits, period_s);
        let change = within_windows(wish, limits.acceleration_per_s, before, period_s, loads);

        let reach = change * period_s;
        let crosses = reach * distance >= 0.0 && reach.abs() >= distance.abs();
        if (crosses || distance.abs() < THERE) && change.abs() <= landing {
            self.speed = wanted;
            self.change_per_s = distance / period_s;
        } else {
            self.speed = moved(self.speed, reach);
            self.change_per_s = change;
        }
        self.change_per_s
    }

    fn wish(
        &self,
        wanted: u32,
        distance: f32,
        speed: f32,
        limits: &RampLimits,
        period_s: f32,
    ) -> f32 {
        let jerk = JERK_SHARE * limits.jerk_per_s2;
        let step = jerk * period_s;
        let change = self.change_per_s;
        if distance > 0.0 {
            // Within j T² of it σ̇ = e/T, which takes the jerk j where it begins. Where the plan
            // leaves torque rate, a landing with the jerk that it leaves ends sooner.
            let near = jerk / (limits.approach_per_s * limits.approach_per_s);
            let goal = if distance > near {
                square_root(jerk * (2.0 * distance - near))
            } else if wanted == FULL_SPEED {
                distance * limits.approach_per_s
            } else {
                let landing = landing(distance, jerk * share_left(wanted), period_s);
                larger(distance * limits.approach_per_s, landing)
            };
            let goal = smaller(goal, limits.acceleration_per_s);
            let up = if change < 0.0 {
                step
            } else {
                let share = larger(0.75 * (1.0 - speed), 0.01);
                share * limits.jerk_per_s2 * period_s
            };
            between(change - step, goal, change + up)
        } else {
            let goal = landing(-distance, jerk * share_left(wanted), period_s);
            let goal = smaller(goal, limits.acceleration_per_s);
            between(change - step, -goal, change + step)
        }
    }
}

/// The greatest σ̇ in 1/s from which a constant jerk lands at a distance.
fn landing(distance: f32, jerk_per_s2: f32, period_s: f32) -> f32 {
    // Whole ticks of σ̇, σ̇ − jh, σ̇ − 2jh … add up to σ̇²/2j + σ̇h/2.
    let half = 0.5 * period_s;
    let root = square_root(half * half + 2.0 * distance / jerk_per_s2);
    jerk_per_s2 * (root - half)
}

/// Share of the torque rate that a plan leaves at a speed: 1 − σ³, a little at least.
fn share_left(speed: u32) -> f32 {
    let ratio = speed_ratio(speed);
    larger(1.0 - ratio * ratio * ratio, LEAST_SHARE)
}

/// The σ̇ nearest to `wish` with which every axis' torque stays where it has to, for σ = `speed`
/// before the step.
///
/// The torque after a step h is A (σ + h σ̇)² + B σ̇ + G. Its slope is taken as the secant's from 0
/// to the wish: exact at both. An axis that no σ̇ up to `largest` brings where it has to stay is
/// left to the limiter.
fn within_windows(wish: f32, largest: f32, speed: f32, period_s: f32, loads: &[AxisLoad]) -> f32 {
    let (mut least, mut most) = (-largest, largest);
    for load in loads {
        let even_nm = load.planned_nm * speed * speed + load.static_nm;
        let slope =
            load.momentum_nms + load.planned_nm * period_s * (2.0 * speed + wish * period_s);
        let inverse = 1.0 / slope;
        let one = (load.least_nm - even_nm) * inverse;
        let other = (load.most_nm - even_nm) * inverse;
        let (low, high) = if one < other {
            (one, other)
        } else {
            (other, one)
        };
        // With a slope of zero the ends are infinite or no numbers, and bound nothing either.
        if low <= largest && high >= -largest {
            least = larger(least, low);
            most = smaller(most, high);
        }
    }
    if least > most {
        0.5 * (least + most)
    } else {
        between(least, wish, most)
    }
}

/// σ after a change, within 0 and 1.
fn moved(speed: u32, change: f32) -> u32 {
    let units = (change * FULL_SPEED as f32) as i32;
    let next = speed.saturating_add_signed(units);
    if next < FULL_SPEED { next } else { FULL_SPEED }
}

fn between(least: f32, value: f32, most: f32) -> f32 {
    larger(least, smaller(value, most))
}

fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

fn smaller(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}
