//! Whether a trajectory may run on this machine, asked once, when it is loaded. Reject, never clip.
//!
//! At all nodes: finite, speed, torque, torque–speed curve; at the LGR points the torque rate, from
//! the differentiation matrix (the control has no value of its own at an interval's end). Where
//! intervals meet: no jump. At both ends: still. At the start: where the machine stands. What
//! happens between the nodes is not judged here.
//!
//! # Tolerances
//! Limits: [`LIMIT_TOLERANCE`] relative, on both coordinates of the torque–speed curve. The torque
//! rate Σ D_ij τ_j · 2/T adds what rounding can do to it: half an ulp of every τ_j, Σ |D_ij| |τ_j|
//! 2⁻²⁴ · 2/T, and half a tick of T. Jumps: 4 ulp of the channel's largest magnitude. Stillness:
//! [`LIMIT_TOLERANCE`] of the axis' largest speed and torque.

use stillpoint_shared::basis::MAX_SUPPORT;
use stillpoint_shared::status::{Limit, Place, Quantity, Rejection};
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;
use stillpoint_shared::{AxisLimits, Interval, LIMIT_TOLERANCE, Limits, Trajectory, lgr};

use crate::limiter::available_torque_nm;
use crate::nodes::{Nodes, channel};

pub use stillpoint_shared::config::AcceptConfig;

/// Relative size of a jump that rounding explains: 4 ulp.
const JUMP_TOLERANCE: f32 = 4.0 * f32::EPSILON;

/// Relative error of rounding to f32: 2⁻²⁴.
const HALF_ULP: f64 = f32::EPSILON as f64 / 2.0;

/// Checks a trajectory against the machine's limits and where it stands; `measured_rad` has one
/// value per axis.
#[inline(never)] // Gives its stack back before the buffers change places.
pub fn check(
    trajectory: &Trajectory,
    limits: &Limits,
    measured_rad: &[f32],
    config: &AcceptConfig,
) -> Result<(), Rejection> {
    let axes = limits.axes().len();
    if trajectory.axes() != axes || measured_rad.len() != axes {
        return Err(Rejection::Axes {
            trajectory: trajectory.axes() as u8,
            machine: axes as u8,
        });
    }
    let (planned_for, machine) = (trajectory.header().limits_hash, limits.hash());
    if planned_for != machine {
        return Err(Rejection::LimitsHash {
            trajectory: planned_for,
            machine,
        });
    }
    let mut nodes = Nodes::empty();
    for (index, interval) in (0u8..).zip(trajectory.intervals()) {
        nodes.prepare(interval.points);
        let block = Block {
            index,
            interval,
            axes,
            nodes: &nodes,
        };
        block.finite()?;
        for (axis, limits) in limits.axes().iter().enumerate() {
            block.within_limits(axis, limits)?;
        }
        block.torque_rate(limits.axes())?;
    }
    continuous(trajectory)?;
    ends(trajectory, limits, measured_rad, config)
}

/// One interval under examination.
struct Block<'a> {
    index: u8,
    interval: Interval<'a>,
    axes: usize,
    nodes: &'a Nodes,
}

impl Block<'_> {
    fn channel(&self, quantity: Quantity, axis: usize) -> impl Iterator<Item = f32> {
        channel(self.interval.coefficients, self.axes, quantity, axis)
    }

    fn place(&self, axis: usize, node: f64) -> Place {
        let elapsed = (node + 1.0) / 2.0 * f64::from(self.interval.duration_ticks);
        let ticks = self
            .interval
            .start_ticks
            .saturating_add((elapsed + 0.5) as u32);
        Place {
            axis: axis as u8,
            interval: self.index,
            ticks,
        }
    }

    fn finite(&self) -> Result<(), Rejection> {
        for axis in 0..self.axes {
            for quantity in Quantity::ALL {
                for (value, &node) in self.channel(quantity, axis).zip(self.nodes.nodes()) {
                    if !value.is_finite() {
                        return Err(Rejection::NotFinite {
                            at: self.place(axis, node),
                            quantity,
                        });
                    }
                }
            }
        }
        Ok(())
    }

    /// Speed, torque and torque–speed curve at all support points.
    fn within_limits(&self, axis: usize, limits: &AxisLimits) -> Result<(), Rejection> {
        let speeds = self.channel(Quantity::Velocity, axis);
        let torques = self.channel(Quantity::Torque, axis);
        for ((speed, torque), &node) in speeds.zip(torques).zip(self.nodes.nodes()) {
            let exceeded = if speed.abs() > limits.speed_rad_per_s * (1.0 + LIMIT_TOLERANCE) {
                (Limit::Speed, speed, limits.speed_rad_per_s)
            } else if torque.abs() > limits.torque_nm * (1.0 + LIMIT_TOLERANCE) {
                (Limit::Torque, torque, limits.torque_nm)
            } else if torque.abs() > available_torque_nm(limits, speed) {
                (
                    Limit::TorqueSpeed,
                    torque,
                    limits.available_torque_nm(speed),
                )
            } else {
                continue;
            };
            let (limit, value, allowed) = exceeded;
            return Err(Rejection::Exceeds {
                at: self.place(axis, node),
                limit,
                value,
                allowed,
            });
        }
        Ok(())
    }

    /// Torque rate at the LGR points: row i of D at a time, so that no matrix has to be kept.
    fn torque_rate(&self, limits: &[AxisLimits]) -> Result<(), Rejection> {
        let duration_ticks = f64::from(self.interval.duration_ticks);
        let per_second = 2.0 * f64::from(TIME_TICKS_PER_SECOND) / duration_ticks;
        let (nodes, weights) = (self.nodes.nodes(), self.nodes.weights());
        let mut row = [0.0; MAX_SUPPORT];
        let row = row.get_mut(..nodes.len()).unwrap_or_default();
        for (i, &node) in nodes.iter().take(self.interval.points).enumerate() {
            // Lengths agree and i is a row: this cannot fail.
            let _ = lgr::differentiation_row(nodes, weights, i, row);
            for (axis, limits) in limits.iter().enumerate() {
                let (mut rate, mut rounding) = (0.0, 0.0);
                for (entry, torque) in row.iter().zip(self.channel(Quantity::Torque, axis)) {
                    let term = entry * f64::from(torque) * per_second;
                    rate += term;
                    rounding += term.abs() * HALF_ULP;
                }
                let allowed = f64::from(limits.torque_rate_nm_per_s);
                let tolerance = f64::from(LIMIT_TOLERANCE) * allowed
                    + rounding
                    + rate.abs() * 0.5 / duration_ticks;
                if rate.abs() > allowed + tolerance {
                    let (value, allowed) = (rate as f32, limits.torque_rate_nm_per_s);
                    let at = self.place(axis, node);
                    return Err(Rejection::Exceeds {
                        at,
                        limit: Limit::TorqueRate,
                        value,
                        allowed,
                    });
                }
            }
        }
        Ok(())
    }
}

/// No quantity jumps where two intervals meet.
fn continuous(trajectory: &Trajectory) -> Result<(), Rejection> {
    let axes = trajectory.axes();
    for axis in 0..axes {
        for quantity in Quantity::ALL {
            let all = channel(trajectory.coefficients(), axes, quantity, axis);
            let largest = all.fold(0.0, |largest: f32, value| {
                if value.abs() > largest {
                    value.abs()
                } else {
                    largest
                }
            });
            let tolerance = JUMP_TOLERANCE * largest;
            let mut end: Option<f32> = None;
            for (index, interval) in (0u8..).zip(trajectory.intervals()) {
                let mut values = channel(interval.coefficients, axes, quantity, axis);
                if let (Some(before), Some(after)) = (end, values.next())
                    && (after - before).abs() > tolerance
                {
                    let at = Place {
                        axis: axis as u8,
                        interval: index,
                        ticks: interval.start_ticks,
                    };
                    return Err(Rejection::Jump {
                        at,
                        quantity,
                        before,
                        after,
                        tolerance,
                    });
                }
                end = values.next_back();
            }
        }
    }
    Ok(())
}

/// Starts where the machine stands, starts and ends still.
fn ends(
    trajectory: &Trajectory,
    limits: &Limits,
    measured_rad: &[f32],
    config: &AcceptConfig,
) -> Result<(), Rejection> {
    let axes = trajectory.axes();
    let last_interval = trajectory.intervals().len().saturating_sub(1) as u8;
    for ((axis, limits), &measured_rad) in (0u8..).zip(limits.axes()).zip(measured_rad) {
        let start = Place {
            axis,
            interval: 0,
            ticks: 0,
        };
        let end = Place {
            axis,
            interval: last_interval,
            ticks: trajectory.duration_ticks(),
        };
        let whole =
            |quantity| channel(trajectory.coefficients(), axes, quantity, usize::from(axis));

        // Every trajectory has a first node; without one it would start nowhere.
        let planned_rad = whole(Quantity::Position).next().unwrap_or(f32::NAN);
        let tolerance_rad = config.start_tolerance_rad;
        let near = (planned_rad - measured_rad).abs() <= tolerance_rad;
        if !near {
            return Err(Rejection::StartsElsewhere {
                at: start,
                planned_rad,
                measured_rad,
                tolerance_rad,
            });
        }
        let still = |quantity, tolerance: f32| {
            let mut values = whole(quantity);
            let ends = [(start, values.next()), (end, values.next_back())];
            let moving = ends
                .into_iter()
                .find_map(|(at, value)| Some((at, value.filter(|v| v.abs() > tolerance)?)));
            moving.map_or(Ok(()), |(at, value)| {
                Err(Rejection::NotStill {
                    at,
                    quantity,
                    value,
                    tolerance,
                })
            })
        };
        still(Quantity::Velocity, LIMIT_TOLERANCE * limits.speed_rad_per_s)?;
        if config.torque_free_ends {
            still(Quantity::Torque, LIMIT_TOLERANCE * limits.torque_nm)?;
        }
    }
    Ok(())
}
