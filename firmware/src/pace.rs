//! How fast the path speed of a move may change, from the move's own numbers.
//!
//! Let s be path time and σ = ds/dt. Along the planned path q(s) the equations of motion are
//!
//! ```text
//! τ = A(s) σ² + B(s) σ̇ + G(s),    A + G = the planned torque,    B = M(q) q′
//! ```
//!
//! (no viscous friction; an elastic member follows the same law as far as it follows at all). So a
//! move that is inside its torque limits stays inside them when it is played evenly slower. While σ
//! changes, B is needed, and the trajectory does not carry it. What it does carry:
//!
//! - G, the static load, is the torque at both ends, where the axis is still; between them the
//!   straight line over path time is taken. Without a load (`torque_free_ends`) it is zero.
//! - B ≈ J v, with v the planned velocity and J the inertia that explains the planned torque best:
//!   the J that minimises Σ (A − J v′)² over the LGR points, and not below 0. On the paper's move
//!   it explains 97 to 98 % of the torque's square; the rest is coupling and elasticity, which the
//!   drives' own loops supply while σ changes, as they supply all of B where J is 0 (a trajectory
//!   without torques).
//!
//! # Bounds
//! With u the torque-rate limit, a = σ̇ and |A′| ≤ u,
//! dτ/dt = A′σ³ + (2A + B′) σ a + B ȧ. Towards a speed σ* ≤ 1 the ramp goes with a = (σ* − σ)/T,
//! and all of dτ/dt fits into u whatever the signs are if, with ε = 1 − σ,
//! 3 A σ ε/T + B ε/T² ≤ u (1 − σ³), where B′ ≈ A; so T = 1.1 · max(√(B/u), 3A/2u, B/τ_max) is
//! enough, and a jerk of ¾ (1 − σ) u/B on the way there. Slowing down starts at full speed, where
//! 1 − σ³ leaves nothing for the worst case: there, as everywhere, [`ramp`](crate::ramp) keeps
//! each axis inside its limits tick by tick, with a and ȧ bounded by τ_max/B and u/B.

use stillpoint_shared::config::QUICK_STOP_RAMP_S;
use stillpoint_shared::status::Quantity;
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;
use stillpoint_shared::trajectory::QUANTITIES;
use stillpoint_shared::{AxisLimits, Limits, Trajectory};

use crate::channels::{BasisAtHand, channel};
use crate::root::square_root;

/// Bounds on the change of path speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampLimits {
    /// Largest |σ̇| in 1/s.
    pub acceleration_per_s: f32,
    /// Largest |σ̈| in 1/s².
    pub jerk_per_s2: f32,
    /// 1/T: σ̇ towards a greater speed, per distance from it, in 1/s.
    pub approach_per_s: f32,
}

impl RampLimits {
    /// No move.
    const NONE: Self = Self {
        acceleration_per_s: 0.0,
        jerk_per_s2: 0.0,
        approach_per_s: 0.0,
    };
}

/// What one axis' torque is made of, beside the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPace {
    /// J in kg·m².
    pub inertia_kg_m2: f32,
    /// Static torque at the start, in N·m.
    pub static_nm: f32,
    /// Change of the static torque per time tick, in N·m.
    pub static_nm_per_tick: f32,
}

/// The numbers of a move with AXES axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace<const AXES: usize> {
    /// Bounds on the path speed's change.
    pub limits: RampLimits,
    /// The same for a quick stop, which no setting makes slower than
    /// [`QUICK_STOP_RAMP_S`].
    pub stop: RampLimits,
    /// Torques, axis by axis.
    pub axes: [AxisPace; AXES],
}

impl<const AXES: usize> Pace<AXES> {
    /// No move.
    pub(crate) const NONE: Self = Self {
        limits: RampLimits::NONE,
        stop: RampLimits::NONE,
        axes: [AxisPace {
            inertia_kg_m2: 0.0,
            static_nm: 0.0,
            static_nm_per_tick: 0.0,
        }; AXES],
    };

    /// The numbers of an accepted trajectory; `ramp_s` is the shortest time between standstill and
    /// full path speed.
    ///
    /// Once per move: much less work than the acceptance check.
    #[inline(never)] // Gives its stack back before the buffers change places.
    pub fn of(trajectory: &Trajectory, limits: &Limits, ramp_s: f32) -> Self {
        let mut pace = Self::NONE;
        let mut acceleration = f32::INFINITY;
        let mut jerk = f32::INFINITY;
        let mut approach_s = 0.0;
        let all = Torques::of::<AXES>(trajectory);
        let axes = pace.axes.iter_mut().zip(&all).zip(limits.axes());
        for ((pace, torques), limits) in axes {
            *pace = torques.pace();
            let momentum = pace.inertia_kg_m2 * torques.speed_rad_per_s;
            if momentum > 0.0 {
                acceleration = smaller(acceleration, limits.torque_nm / momentum);
                jerk = smaller(jerk, limits.torque_rate_nm_per_s / momentum);
            }
            approach_s = larger(approach_s, approach(limits, momentum, torques.largest_nm));
        }
        // From rest to rest in ramp_s with the least peak of the acceleration: a triangle.
        let within = |ramp_s: f32| RampLimits {
            acceleration_per_s: smaller(2.0 / ramp_s, acceleration),
            jerk_per_s2: smaller(4.0 / (ramp_s * ramp_s), jerk),
            approach_per_s: 1.0 / larger(ramp_s / 5.0, approach_s),
        };
        pace.limits = within(ramp_s);
        pace.stop = within(smaller(ramp_s, QUICK_STOP_RAMP_S));
        pace
    }
}

/// T in s, for |B| up to `momentum` and |A| up to `largest_nm`.
fn approach(limits: &AxisLimits, momentum: f32, largest_nm: f32) -> f32 {
    let rate = limits.torque_rate_nm_per_s;
    let by_jerk = square_root(momentum / rate);
    let by_rate = 1.5 * largest_nm / rate;
    let by_torque = momentum / limits.torque_nm;
    1.1 * larger(by_jerk, larger(by_rate, by_torque))
}

/// One axis' torques without their static part, and its accelerations.
#[derive(Clone, Copy)]
struct Torques {
    static_nm: f32,
    static_nm_per_tick: f32,
    /// Σ A v′ and Σ v′², weighted by time.
    against_acceleration: f32,
    acceleration_square: f32,
    largest_nm: f32,
    speed_rad_per_s: f32,
}

impl Torques {
    /// Of every axis, at the LGR points: the end has the static torque and no speed.
    fn of<const AXES: usize>(trajectory: &Trajectory) -> [Self; AXES] {
        let mut torques = core::array::from_fn(|axis| Self::none(trajectory, axis));
        let mut bases = BasisAtHand::NONE;
        for interval in trajectory.intervals() {
            let Some(basis) = bases.of(interval.points) else {
                continue;
            };
            let rows: &[[[f32; AXES]; QUANTITIES]] =
                interval.coefficients.as_chunks().0.as_chunks().0;
            let Some([_, first, _]) = rows.first() else {
                continue;
            };
            let duration_s = interval.duration_ticks as f32 / TIME_TICKS_PER_SECOND as f32;
            let points = basis.nodes().iter().zip(rows).take(interval.points);
            for (&x, [_, speeds, planned]) in points {
                let mut slopes = [0.0; AXES];
                basis.cardinals(x, |j, _, slope| {
                    if let Some([_, speeds, _]) = rows.get(j) {
                        for (sum, (speed, first)) in slopes.iter_mut().zip(speeds.iter().zip(first))
                        {
                            *sum += slope * (speed - first);
                        }
                    }
                });
                let ticks =
                    interval.start_ticks as f32 + 0.5 * (x + 1.0) * interval.duration_ticks as f32;
                let values = planned.iter().zip(speeds).zip(slopes);
                for (torques, ((planned, speed), slope)) in torques.iter_mut().zip(values) {
                    torques.take(
                        ticks,
                        *planned,
                        *speed,
                        slope * 2.0 / duration_s,
                        duration_s,
                    );
                }
            }
        }
        torques
    }

    /// No node yet; the static torque is known by both ends.
    fn none(trajectory: &Trajectory, axis: usize) -> Self {
        let (axes, quantity) = (trajectory.axes(), Quantity::Torque);
        let mut whole = channel(trajectory.coefficients(), axes, quantity, axis);
        let first = whole.next().unwrap_or(0.0);
        let last = whole.next_back().unwrap_or(0.0);
        Self {
            static_nm: first,
            static_nm_per_tick: (last - first) / trajectory.duration_ticks() as f32,
            against_acceleration: 0.0,
            acceleration_square: 0.0,
            largest_nm: 0.0,
            speed_rad_per_s: 0.0,
        }
    }

    /// Takes a point, with the duration of its interval as its weight.
    fn take(
        &mut self,
        ticks: f32,
        planned_nm: f32,
        speed_rad_per_s: f32,
        acceleration_rad_per_s2: f32,
        duration_s: f32,
    ) {
        let torque_nm = planned_nm - self.static_nm - self.static_nm_per_tick * ticks;
        self.largest_nm = larger(self.largest_nm, torque_nm.abs());
        self.speed_rad_per_s = larger(self.speed_rad_per_s, speed_rad_per_s.abs());
        let weighted = duration_s * acceleration_rad_per_s2;
        self.against_acceleration += weighted * torque_nm;
        self.acceleration_square += weighted * acceleration_rad_per_s2;
    }

    fn pace(&self) -> AxisPace {
        let inertia_kg_m2 = self.against_acceleration / self.acceleration_square;
        let explains = inertia_kg_m2.is_finite() && inertia_kg_m2 > 0.0;
        AxisPace {
            inertia_kg_m2: if explains { inertia_kg_m2 } else { 0.0 },
            static_nm: self.static_nm,
            static_nm_per_tick: self.static_nm_per_tick,
        }
    }
}

fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

fn smaller(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}
