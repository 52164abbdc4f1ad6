//! Why a drive configuration is refused.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{MAX_BUSES, MOST_BUS_LOAD_PERMILLE};
use crate::{MAX_AXES, ordinal};

/// Why a drive configuration is refused. Its `Display` says what to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DriveConfigError {
    /// No axes, or more than [`MAX_AXES`].
    Axes {
        /// Number of axes given.
        axes: usize,
    },
    /// The period cannot be told to the drives.
    Period {
        /// Time between two SYNC messages in µs.
        period_us: u16,
    },
    /// The bit rate is none of [`BIT_RATES_KBIT_PER_S`](super::BIT_RATES_KBIT_PER_S).
    BitRate {
        /// Bit rate in kbit/s.
        bit_rate_kbit_per_s: u16,
    },
    /// No heartbeat, or a timeout that a single lost one would trip.
    Heartbeat {
        /// Time between two heartbeats in ms.
        heartbeat_ms: u16,
        /// Time after which a node counts as lost, in ms.
        heartbeat_timeout_ms: u16,
    },
    /// The board's node id is none.
    ControllerNode {
        /// Node id.
        node: u8,
    },
    /// A drive has the board's node id.
    NodeIsBoards {
        /// Axis, from 0.
        axis: u8,
        /// Node id.
        node: u8,
    },
    /// Two drives on a bus have the same node id.
    NodeTwice {
        /// First axis with it, from 0.
        axis: u8,
        /// Bus, from 0.
        bus: u8,
        /// Node id.
        node: u8,
    },
    /// A number of an axis is out of its range.
    Axis {
        /// Axis, from 0.
        axis: u8,
        /// Which number.
        problem: Problem,
    },
    /// A bus would carry too much.
    Overloaded {
        /// Bus, from 0.
        bus: u8,
        /// Its load in thousandths.
        load_permille: u32,
        /// Axes on it.
        axes: usize,
        /// Time between two SYNC messages in µs.
        period_us: u16,
    },
    /// The period is no multiple of the executor's tick.
    NotTicks {
        /// Time between two SYNC messages in µs.
        period_us: u16,
        /// Tick in time ticks of 0.1 µs.
        tick_ticks: u32,
    },
    /// A cycle is too short for set-points and feedback.
    NoTime {
        /// Ticks of the cycle.
        ticks: u32,
        /// Ticks the set-points take.
        lead_ticks: u32,
        /// Ticks the feedback takes.
        reply_ticks: u32,
    },
}

/// A number of an axis that is out of its range, and its value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Problem {
    /// `bus`.
    Bus(u8),
    /// `node`.
    Node(u8),
    /// `counts_per_turn`.
    CountsPerTurn(f64),
    /// `home_rad`.
    HomeRad(f32),
    /// `gear_ratio`.
    GearRatio(f32),
    /// `rated_torque_nm`.
    RatedTorque(f32),
    /// `torque_limit_permille`.
    TorqueLimit(u16),
}

impl fmt::Display for DriveConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { axes } => write!(
                f,
                "drives for {axes} axes were given: give them for 1 to {MAX_AXES}"
            ),
            Self::Period { period_us } => write!(
                f,
                "period_us is {period_us}: give a number up to 255 times 1, 10, 100 or 1000 µs, such as 1000 or 2000"
            ),
            Self::BitRate {
                bit_rate_kbit_per_s,
            } => write!(
                f,
                "bit_rate_kbit_per_s is {bit_rate_kbit_per_s}: give 1000, 500, 250 or 125, as the drives are set"
            ),
            Self::Heartbeat {
                heartbeat_ms,
                heartbeat_timeout_ms,
            } => write!(
                f,
                "heartbeat_ms is {heartbeat_ms} and heartbeat_timeout_ms {heartbeat_timeout_ms}: \
                 give a heartbeat, and a timeout of at least two of them"
            ),
            Self::ControllerNode { node } => write!(
                f,
                "controller_node is {node}: give 1 to 127, or 0 for no heartbeat of the board"
            ),
            Self::NodeIsBoards { axis, node } => write!(
                f,
                "the drive of axis {axis} has node id {node}, which is the board's controller_node: change one of them",
                axis = ordinal(axis)
            ),
            Self::NodeTwice { axis, bus, node } => write!(
                f,
                "node id {node} is on bus {bus} more than once (first as axis {axis}): give every drive its own",
                axis = ordinal(axis)
            ),
            Self::Axis { axis, problem } => {
                write!(f, "axis {axis}: {problem}", axis = ordinal(axis))
            }
            Self::Overloaded {
                bus,
                load_permille,
                axes,
                period_us,
            } => write!(
                f,
                "{axes} axes every {period_us} µs would load bus {bus} to {}.{} %, {} % are allowed: \
                 use a longer period or a second bus",
                load_permille / 10,
                load_permille % 10,
                MOST_BUS_LOAD_PERMILLE / 10
            ),
            Self::NotTicks {
                period_us,
                tick_ticks,
            } => write!(
                f,
                "period_us is {period_us}: give a multiple of the tick, {}.{} µs",
                tick_ticks / 10,
                tick_ticks % 10
            ),
            Self::NoTime {
                ticks,
                lead_ticks,
                reply_ticks,
            } => write!(
                f,
                "set-points take {lead_ticks} ticks and feedback {reply_ticks}, a cycle has {ticks}: \
                 use a longer period or a second bus"
            ),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Bus(bus) => write!(f, "bus is {bus}: give 0 to {}", MAX_BUSES - 1),
            Self::Node(node) => write!(f, "node is {node}: give 1 to 127, as the drive is set"),
            Self::CountsPerTurn(value) => write!(
                f,
                "counts_per_turn is {value}: give the positive number of increments per turn of the joint, 4294967295 at most"
            ),
            Self::HomeRad(value) => write!(f, "home_rad is {value}: give a finite number"),
            Self::GearRatio(value) => write!(
                f,
                "gear_ratio is {value}: give the turns of the motor per turn of the joint, a positive number \
                 (the direction is `reversed`)"
            ),
            Self::RatedTorque(value) => write!(
                f,
                "rated_torque_nm is {value}: give the motor's rated torque, a positive number, as the drive has it in 6076h"
            ),
            Self::TorqueLimit(value) => {
                write!(f, "torque_limit_permille is {value}: give 1 to 32767")
            }
        }
    }
}

impl core::error::Error for DriveConfigError {}
