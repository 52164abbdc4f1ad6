//! Configuration of the drives: where each axis is on the bus, and what its counts mean.

use core::fmt;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::MAX_AXES;

/// One axis' drive, a CiA 402 node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisDrive {
    /// CAN bus, from 0.
    pub bus: u8,
    /// Node id, 1 to 127.
    pub node: u8,
    /// Position counts per rad at the joint; negative if the drive turns the other way.
    pub counts_per_rad: f32,
    /// Position counts at 0 rad.
    pub zero_counts: i32,
    /// Torque at the joint, in N·m, that the drive calls its rated torque (object 6076h).
    pub rated_torque_nm: f32,
}

/// The drives of all axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveConfig {
    /// Axis by axis.
    pub axes: Vec<AxisDrive, MAX_AXES>,
}

impl DriveConfig {
    /// Whether it can be the configuration of `axes` drives.
    pub fn check(&self, axes: usize) -> Result<(), DriveConfigError> {
        if self.axes.len() != axes {
            return Err(DriveConfigError::Axes {
                given: self.axes.len() as u8,
                board: axes as u8,
            });
        }
        for (axis, drive) in (0u8..).zip(&self.axes) {
            let node = drive.node;
            if !(1..=127).contains(&node) {
                return Err(DriveConfigError::Node { axis, node });
            }
            let same = |other: &AxisDrive| (other.bus, other.node) == (drive.bus, node);
            if self.axes.iter().filter(|other| same(other)).count() > 1 {
                return Err(DriveConfigError::SameNode {
                    axis,
                    bus: drive.bus,
                    node,
                });
            }
            let counts = drive.counts_per_rad;
            if !counts.is_finite() || counts == 0.0 {
                return Err(DriveConfigError::CountsPerRad { axis, counts });
            }
            let torque_nm = drive.rated_torque_nm;
            if !(torque_nm.is_finite() && torque_nm > 0.0) {
                return Err(DriveConfigError::RatedTorque { axis, torque_nm });
            }
        }
        Ok(())
    }
}

/// Why a configuration of the drives is impossible.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DriveConfigError {
    /// It is of another number of axes.
    Axes {
        /// Axes given.
        given: u8,
        /// Axes of the board.
        board: u8,
    },
    /// No node can have this id.
    Node {
        /// Axis, from 0.
        axis: u8,
        /// The id.
        node: u8,
    },
    /// Two axes have the same bus and node id.
    SameNode {
        /// The first of them, from 0.
        axis: u8,
        /// The bus.
        bus: u8,
        /// The id.
        node: u8,
    },
    /// The counts per rad are zero or no finite number.
    CountsPerRad {
        /// Axis, from 0.
        axis: u8,
        /// The value.
        counts: f32,
    },
    /// The rated torque is not positive or no finite number.
    RatedTorque {
        /// Axis, from 0.
        axis: u8,
        /// The value in N·m.
        torque_nm: f32,
    },
}

impl fmt::Display for DriveConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Axes { given, board } => write!(
                f,
                "drives of {given} axes were given, the board has {board}: give one per axis"
            ),
            Self::Node { axis, node } => {
                write!(
                    f,
                    "node id {node} of axis {axis} is impossible: use 1 to 127"
                )
            }
            Self::SameNode { axis, bus, node } => write!(
                f,
                "axis {axis} shares node id {node} on bus {bus} with another axis: give each its own"
            ),
            Self::CountsPerRad { axis, counts } => write!(
                f,
                "{counts} counts per rad of axis {axis} are impossible: give a finite number other than zero"
            ),
            Self::RatedTorque { axis, torque_nm } => write!(
                f,
                "a rated torque of {torque_nm} N·m of axis {axis} is impossible: give a finite positive number"
            ),
        }
    }
}

impl core::error::Error for DriveConfigError {}
