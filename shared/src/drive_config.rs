//! How the drives hang on the board: bus cycle, node ids, increments per turn, rated torques.
//!
//! The configuration of CiA 402 servo drives on one or two CAN buses, stored on the board and set
//! over the protocol. It is checked when it is made or read: a value of this type can be used. What
//! depends on the tick of the executor too, the [`Cycle`], is checked when the drives are set up.

mod cycle;
mod error;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::{MAX_AXES, hash};

pub use cycle::{Cycle, MOST_BUS_LOAD_PERMILLE, bus_load_permille, frame_bits, interpolation_time};
pub use error::{DriveConfigError, Problem};

/// Most buses the drives can be spread over.
pub const MAX_BUSES: usize = 2;

/// Bit rates that CANopen drives have in common, in kbit/s, of those with room for three drives.
/// Their 800 is left out, since few boards can make it.
pub const BIT_RATES_KBIT_PER_S: [u16; 4] = [1_000, 500, 250, 125];

/// Most bytes a [`DriveConfig`] takes in postcard.
pub const MAX_ENCODED_BYTES: usize =
    3 + 3 + 3 + 3 + 1 + 1 + MAX_AXES * AxisDrive::MAX_ENCODED_BYTES;

/// What all drives have in common.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusConfig {
    /// Time between two SYNC messages in µs: a multiple of the executor's tick.
    pub period_us: u16,
    /// Bit rate of the buses in kbit/s, one of [`BIT_RATES_KBIT_PER_S`].
    pub bit_rate_kbit_per_s: u16,
    /// Time between two heartbeats in ms, of the drives and of the board.
    pub heartbeat_ms: u16,
    /// Time without a heartbeat in ms after which a node counts as lost, for both sides.
    pub heartbeat_timeout_ms: u16,
    /// Node id under which the board sends its own heartbeat, so that the drives notice when it
    /// dies; 0 for no heartbeat.
    pub controller_node: u8,
}

impl Default for BusConfig {
    /// 500 Hz at 1 Mbit/s, a heartbeat every 50 ms, lost after 150 ms, the board is node 127.
    fn default() -> Self {
        Self {
            period_us: 2_000,
            bit_rate_kbit_per_s: 1_000,
            heartbeat_ms: 50,
            heartbeat_timeout_ms: 150,
            controller_node: 127,
        }
    }
}

/// Who arranges the process data of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mapping {
    /// The board writes the mapping at every start.
    #[default]
    Write,
    /// The drive has the mapping already, and keeps it: for drives that refuse the writing.
    Preset,
}

/// One axis' drive.
///
/// counts = `home_counts` ± (angle − `home_rad`) · `counts_per_turn` / 2π, with − if `reversed`; a
/// torque at the joint is ± `gear_ratio` times the motor's. Losses of the gear are not modelled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisDrive {
    /// Bus the drive is on, from 0.
    pub bus: u8,
    /// CANopen node id, 1 to 127.
    pub node: u8,
    /// Increments of the drive's position per turn of the joint; gears may make it fractional.
    pub counts_per_turn: f64,
    /// Whether the drive counts against the joint's direction.
    pub reversed: bool,
    /// Increments the drive shows where the joint is at `home_rad`.
    pub home_counts: i32,
    /// Angle of the joint at `home_counts`, in rad.
    pub home_rad: f32,
    /// Turns of the motor per turn of the joint.
    pub gear_ratio: f32,
    /// Rated torque of the motor in N·m, as object 6076h has it: the unit of the torque offset.
    pub rated_torque_nm: f32,
    /// Largest |torque offset| sent, in thousandths of the rated torque; 32767 at most.
    pub torque_limit_permille: u16,
    /// Who arranges the process data.
    pub mapping: Mapping,
    /// Whether the drive says in bit 12 of the statusword that it follows its set-points. CiA 402
    /// asks for it in this mode; false is for drives that lack it.
    pub tells_following: bool,
}

impl AxisDrive {
    const MAX_ENCODED_BYTES: usize = 1 + 1 + 8 + 1 + 5 + 4 + 4 + 4 + 3 + 1 + 1;
}

/// Configuration of all drives of a machine: 1 to [`MAX_AXES`], node ids unique, buses not
/// overloaded, every number finite and in its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(try_from = "Unchecked")]
pub struct DriveConfig {
    bus: BusConfig,
    axes: Vec<AxisDrive, MAX_AXES>,
}

/// What was read and has to be checked.
#[derive(Deserialize)]
#[serde(rename = "DriveConfig")]
struct Unchecked {
    bus: BusConfig,
    axes: Vec<AxisDrive, MAX_AXES>,
}

impl DriveConfig {
    /// Configuration of a machine, axis by axis.
    pub fn new(bus: BusConfig, axes: &[AxisDrive]) -> Result<Self, DriveConfigError> {
        let axes =
            Vec::from_slice(axes).map_err(|_| DriveConfigError::Axes { axes: axes.len() })?;
        Self::try_from(Unchecked { bus, axes })
    }

    /// What all drives have in common.
    pub fn bus(&self) -> &BusConfig {
        &self.bus
    }

    /// The drives, in the order of the trajectory's axes.
    pub fn axes(&self) -> &[AxisDrive] {
        &self.axes
    }

    /// Number of buses needed: one more than the highest that is used.
    pub fn buses(&self) -> usize {
        let buses = self.axes.iter().map(|axis| usize::from(axis.bus) + 1);
        buses.max().unwrap_or_default()
    }

    /// Number of drives on a bus.
    pub fn axes_on(&self, bus: usize) -> usize {
        let on_bus = |axis: &&AxisDrive| usize::from(axis.bus) == bus;
        self.axes.iter().filter(on_bus).count()
    }

    /// CRC-64/XZ of the postcard bytes.
    pub fn hash(&self) -> u64 {
        hash::of(self)
    }

    fn check(&self) -> Result<(), DriveConfigError> {
        if self.axes.is_empty() {
            return Err(DriveConfigError::Axes { axes: 0 });
        }
        self.check_bus()?;
        for (axis, drive) in (0u8..).zip(&self.axes) {
            check_axis(axis, drive)?;
            if drive.node == self.bus.controller_node {
                return Err(DriveConfigError::NodeIsBoards {
                    axis,
                    node: drive.node,
                });
            }
            let twin = |other: &&AxisDrive| (other.bus, other.node) == (drive.bus, drive.node);
            if self.axes.iter().filter(twin).count() > 1 {
                return Err(DriveConfigError::NodeTwice {
                    axis,
                    bus: drive.bus,
                    node: drive.node,
                });
            }
        }
        for bus in 0..self.buses() {
            let load_permille = bus_load_permille(&self.bus, self.axes_on(bus));
            if load_permille > MOST_BUS_LOAD_PERMILLE {
                return Err(DriveConfigError::Overloaded {
                    bus: bus as u8,
                    load_permille,
                    axes: self.axes_on(bus),
                    period_us: self.bus.period_us,
                });
            }
        }
        Ok(())
    }

    fn check_bus(&self) -> Result<(), DriveConfigError> {
        let BusConfig {
            period_us,
            bit_rate_kbit_per_s,
            heartbeat_ms,
            heartbeat_timeout_ms,
            controller_node,
        } = self.bus;
        if period_us == 0 || interpolation_time(period_us).is_none() {
            return Err(DriveConfigError::Period { period_us });
        }
        if !BIT_RATES_KBIT_PER_S.contains(&bit_rate_kbit_per_s) {
            return Err(DriveConfigError::BitRate {
                bit_rate_kbit_per_s,
            });
        }
        if heartbeat_ms == 0 || heartbeat_timeout_ms / 2 < heartbeat_ms {
            return Err(DriveConfigError::Heartbeat {
                heartbeat_ms,
                heartbeat_timeout_ms,
            });
        }
        if controller_node > MOST_NODE {
            return Err(DriveConfigError::ControllerNode {
                node: controller_node,
            });
        }
        Ok(())
    }
}

impl TryFrom<Unchecked> for DriveConfig {
    type Error = DriveConfigError;

    fn try_from(Unchecked { bus, axes }: Unchecked) -> Result<Self, DriveConfigError> {
        let config = Self { bus, axes };
        config.check()?;
        Ok(config)
    }
}

/// Highest CANopen node id.
const MOST_NODE: u8 = 127;

fn check_axis(axis: u8, drive: &AxisDrive) -> Result<(), DriveConfigError> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    let (torque, gear) = (drive.rated_torque_nm, drive.gear_ratio);
    let problem = if usize::from(drive.bus) >= MAX_BUSES {
        Problem::Bus(drive.bus)
    } else if !(1..=MOST_NODE).contains(&drive.node) {
        Problem::Node(drive.node)
    } else if !(positive(drive.counts_per_turn) && drive.counts_per_turn <= f64::from(u32::MAX)) {
        Problem::CountsPerTurn(drive.counts_per_turn)
    } else if !drive.home_rad.is_finite() {
        Problem::HomeRad(drive.home_rad)
    } else if !positive(f64::from(gear)) {
        Problem::GearRatio(gear)
    } else if !positive(f64::from(torque)) {
        Problem::RatedTorque(torque)
    } else if !(1..=i16::MAX as u16).contains(&drive.torque_limit_permille) {
        Problem::TorqueLimit(drive.torque_limit_permille)
    } else {
        return Ok(());
    };
    Err(DriveConfigError::Axis { axis, problem })
}
