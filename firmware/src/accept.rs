//! Whether a trajectory may run on this machine, asked once, when it is loaded. Reject, never clip.
//!
//! At all nodes: finite, speed, torque, torque–speed curve; between the nodes the same and the slopes
//! of position and torque, with a gap that `between` states. Where intervals meet: no jump. At
//! both ends: still. At the start: where the machine stands.
//!
//! # Tolerances
//! Limits: [`LIMIT_TOLERANCE`] relative, on both coordinates of the torque–speed curve; slopes add
//! what rounding can do to them. Jumps: 4 ulp of the channel's largest magnitude. Stillness:
//! [`LIMIT_TOLERANCE`] of the axis' largest speed and torque.

use stillpoint_shared::status::{Place, Quantity, Rejection};
use stillpoint_shared::{AxisLimits, Basis, Interval, LIMIT_TOLERANCE, Limits, Trajectory};

use crate::between::{self, Excess};
use crate::channels::{BasisAtHand, channel};

pub use stillpoint_shared::config::AcceptConfig;

/// Relative size of a jump that rounding explains: 4 ulp.
const JUMP_TOLERANCE: f32 = 4.0 * f32::EPSILON;

/// Checks a trajectory against the machine's limits and where it stands; `measured_rad` has one
/// value per axis.
#[inline(never)] // Gives its stack back before the buffers change places.
pub fn check<const AXES: usize>(
    trajectory: &Trajectory,
    limits: &Limits,
    measured_rad: &[f32; AXES],
    config: &AcceptConfig,
) -> Result<(), Rejection> {
    let axes = limits.axes().len();
    if trajectory.axes() != axes || axes != AXES {
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
    for block in blocks(trajectory) {
        block.finite()?;
        for (axis, limits) in limits.axes().iter().enumerate() {
            block.within_limits(axis, limits)?;
        }
    }
    continuous(trajectory)?;
    ends(trajectory, limits, measured_rad, config)?;
    // Last what takes longest.
    let mut bases = BasisAtHand::NONE;
    for block in blocks(trajectory) {
        if let Some(basis) = bases.of(block.interval.points) {
            block.between::<AXES>(basis, limits.axes())?;
        }
    }
    Ok(())
}

fn blocks(trajectory: &Trajectory) -> impl Iterator<Item = Block<'_>> {
    let axes = trajectory.axes();
    let intervals = (0u8..).zip(trajectory.intervals());
    intervals.map(move |(index, interval)| Block {
        index,
        interval,
        axes,
    })
}

/// One interval under examination.
struct Block<'a> {
    index: u8,
    interval: Interval<'a>,
    axes: usize,
}

impl Block<'_> {
    fn channel(&self, quantity: Quantity, axis: usize) -> impl Iterator<Item = f32> {
        channel(self.interval.coefficients, self.axes, quantity, axis)
    }

    fn place(&self, axis: usize, x: f32) -> Place {
        let elapsed = (f64::from(x) + 1.0) / 2.0 * f64::from(self.interval.duration_ticks);
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

    /// The place of node j.
    #[cold]
    #[inline(never)]
    fn node(&self, axis: usize, j: usize) -> Place {
        let mut bases = BasisAtHand::NONE;
        let basis = bases.of(self.interval.points);
        let x = basis.and_then(|basis| basis.nodes().get(j).copied());
        self.place(axis, x.unwrap_or(-1.0))
    }

    fn finite(&self) -> Result<(), Rejection> {
        for axis in 0..self.axes {
            for quantity in Quantity::ALL {
                for (j, value) in self.channel(quantity, axis).enumerate() {
                    if !value.is_finite() {
                        return Err(Rejection::NotFinite {
                            at: self.node(axis, j),
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
        for (j, (speed, torque)) in speeds.zip(torques).enumerate() {
            if let Some((limit, value, allowed)) = between::exceeded(limits, speed, torque) {
                return Err(Rejection::Exceeds {
                    at: self.node(axis, j),
                    limit,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }

    fn between<const AXES: usize>(
        &self,
        basis: &Basis,
        limits: &[AxisLimits],
    ) -> Result<(), Rejection> {
        match between::check::<AXES>(&self.interval, basis, limits) {
            None => Ok(()),
            Some(Excess {
                axis,
                x,
                limit,
                value,
                allowed,
            }) => Err(Rejection::Exceeds {
                at: self.place(axis, x),
                limit,
                value,
                allowed,
            }),
        }
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
