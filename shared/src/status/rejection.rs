//! Why a trajectory may not run on this machine: always where, what and by how much.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::{ordinal, time};

/// A place in a trajectory. Its `Display` counts axes and intervals from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Place {
    /// Axis, from 0.
    pub axis: u8,
    /// Interval, from 0.
    pub interval: u8,
    /// Time after the start of the move, in ticks of 0.1 µs.
    pub ticks: u32,
}

/// A quantity the trajectory carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Quantity {
    /// Position in rad.
    Position,
    /// Velocity in rad/s.
    Velocity,
    /// Torque in N·m.
    Torque,
}

/// A limit of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Limit {
    /// Largest |torque| in N·m.
    Torque,
    /// Largest |torque rate| in N·m/s.
    TorqueRate,
    /// |Torque| in N·m available at the speed of that moment.
    TorqueSpeed,
    /// Largest |speed| in rad/s.
    Speed,
}

/// Why a trajectory may not run on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rejection {
    /// It has another number of axes than the machine.
    Axes {
        /// Axes of the trajectory.
        trajectory: u8,
        /// Axes of the machine.
        machine: u8,
    },
    /// It was planned for other limits than the machine's.
    LimitsHash {
        /// Hash the trajectory was planned for.
        trajectory: u64,
        /// Hash of the machine's limits.
        machine: u64,
    },
    /// A value is no finite number.
    NotFinite {
        /// Where.
        at: Place,
        /// Which quantity.
        quantity: Quantity,
    },
    /// A quantity jumps where two intervals meet.
    Jump {
        /// Where: the start of the later interval.
        at: Place,
        /// Which quantity.
        quantity: Quantity,
        /// Value at the end of the earlier interval.
        before: f32,
        /// Value at the start of the later one.
        after: f32,
        /// Largest difference allowed.
        tolerance: f32,
    },
    /// It starts elsewhere than the machine stands.
    StartsElsewhere {
        /// Where.
        at: Place,
        /// Position it starts at, in rad.
        planned_rad: f32,
        /// Measured position in rad.
        measured_rad: f32,
        /// Largest difference allowed, in rad.
        tolerance_rad: f32,
    },
    /// It does not start or end still.
    NotStill {
        /// Where: the first or the last node.
        at: Place,
        /// Velocity or torque.
        quantity: Quantity,
        /// Its value.
        value: f32,
        /// Largest magnitude allowed.
        tolerance: f32,
    },
    /// A limit is exceeded, at a node or between two of them.
    Exceeds {
        /// Where.
        at: Place,
        /// Which limit.
        limit: Limit,
        /// The value.
        value: f32,
        /// The largest magnitude allowed, without tolerance.
        allowed: f32,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            axis,
            interval,
            ticks,
        } = *self;
        write!(
            f,
            "axis {}, interval {}, t = {:.7} s (tick {ticks})",
            ordinal(axis),
            ordinal(interval),
            time::seconds(ticks)
        )
    }
}

impl Quantity {
    /// All quantities in the order of a trajectory's rows.
    pub const ALL: [Self; 3] = [Self::Position, Self::Velocity, Self::Torque];

    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Position => ("position", "rad"),
            Self::Velocity => ("velocity", "rad/s"),
            Self::Torque => ("torque", "N·m"),
        }
    }
}

impl Limit {
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Torque => ("torque", "N·m"),
            Self::TorqueRate => ("torque rate", "N·m/s"),
            Self::TorqueSpeed => ("torque at this speed", "N·m"),
            Self::Speed => ("speed", "rad/s"),
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes {
                trajectory,
                machine,
            } => {
                write!(
                    f,
                    "the trajectory has {trajectory} axes, the machine {machine}: plan the move for this machine"
                )
            }
            Self::LimitsHash {
                trajectory,
                machine,
            } => write!(
                f,
                "the trajectory was planned for limits {trajectory:016x}, the machine has {machine:016x}: \
                 plan the move again with the machine's limits"
            ),
            Self::NotFinite { at, quantity } => {
                write!(
                    f,
                    "{at}: the {} is no finite number: plan the move again",
                    quantity.words().0
                )
            }
            Self::Jump {
                at,
                quantity,
                before,
                after,
                tolerance,
            } => {
                let (name, unit) = quantity.words();
                write!(
                    f,
                    "{at}: the {name} jumps from {before} to {after} {unit}, {tolerance:e} {unit} are allowed"
                )
            }
            Self::StartsElsewhere {
                at,
                planned_rad,
                measured_rad,
                tolerance_rad,
            } => write!(
                f,
                "{at}: the move starts at {planned_rad} rad, the axis stands at {measured_rad} rad, \
                 {tolerance_rad} rad are allowed: bring it there first or plan from where it stands"
            ),
            Self::NotStill {
                at,
                quantity,
                value,
                tolerance,
            } => {
                let (name, unit) = quantity.words();
                write!(
                    f,
                    "{at}: the {name} is {value} {unit} where the move must be still, {tolerance} {unit} are allowed"
                )
            }
            Self::Exceeds {
                at,
                limit,
                value,
                allowed,
            } => {
                let (name, unit) = limit.words();
                write!(
                    f,
                    "{at}: the {name} is {value} {unit}, {allowed} {unit} are allowed: plan with the machine's limits"
                )
            }
        }
    }
}

impl core::error::Error for Rejection {}
