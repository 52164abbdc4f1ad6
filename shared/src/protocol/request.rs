//! What the host asks.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::frame::{self, FrameError};
use super::{Hello, TelemetryConfig};
use crate::assembly::Outline;
use crate::config::Config;
use crate::status::StartRequest;
use crate::{AxisDrive, AxisLimits, BusConfig, MAX_AXES};

/// A request; the table in the [module header](super) says what each means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
// A request is made on the stack, sent or obeyed, and gone.
#[allow(clippy::large_enum_variant)]
pub enum Request<'a> {
    /// Opens a session. The first variant in every version.
    Hello(Hello),
    /// Asks for the [`Status`](super::Status).
    Status,
    /// Says that the host is there.
    KeepAlive,
    /// Begins an upload, or goes on with it.
    UploadBegin(Outline),
    /// A block of the upload.
    #[serde(borrow)]
    UploadBlock(Block<'a>),
    /// Asks which blocks have arrived.
    UploadProgress,
    /// Ends the upload: everything is checked, and the trajectory is loaded or refused.
    UploadCommit {
        /// Hash of the trajectory meant.
        content_hash: u64,
    },
    /// Throws the upload away.
    UploadAbort,
    /// Energises the drives.
    Arm,
    /// Switches the drives off at rest.
    Disarm,
    /// Plays the move.
    Start(StartRequest),
    /// Slows down along the path and stands still.
    Hold,
    /// Goes on after a hold.
    Resume,
    /// Plays at a part of the planned speed.
    Override {
        /// That part, 0 to 100 %.
        percent: u8,
    },
    /// Slows down along the path and takes the torque away.
    QuickStop,
    /// Leaves a fault.
    Clear,
    /// Keeps the loaded trajectory over a loss of power.
    Store,
    /// Asks for the stored trajectories.
    List,
    /// Loads a stored trajectory.
    Load {
        /// Its content hash.
        content_hash: u64,
    },
    /// Forgets a stored trajectory, or all.
    Erase {
        /// Its content hash; none for all.
        content_hash: Option<u64>,
    },
    /// Chooses the telemetry.
    SetTelemetry(TelemetryConfig),
    /// Asks for the machine's limits.
    GetLimits,
    /// Changes the machine's limits, and keeps them over a loss of power.
    SetLimits(Vec<AxisLimits, MAX_AXES>),
    /// Asks how the executor plays.
    GetConfig,
    /// Changes how the executor plays, and keeps it over a loss of power.
    SetConfig(Config),
    /// Asks for the configuration of the drives.
    GetDrives,
    /// Changes the configuration of the drives, kept over a loss of power and in force from the next
    /// start of the board on.
    SetDrives {
        /// What all drives have in common.
        bus: BusConfig,
        /// The drives, axis by axis.
        axes: Vec<AxisDrive, MAX_AXES>,
    },
    /// Asks for the head of the fault record.
    GetFault,
    /// Asks for samples of the fault record.
    GetFaultSamples {
        /// The first one wanted, from 0, the oldest.
        first: u16,
    },
}

impl<'a> Request<'a> {
    /// Reads a body, as of [`frame::read`]; compiled here once. What reading takes of the stack is
    /// given back before the request is looked at.
    #[inline(never)]
    pub fn decode(body: &'a [u8]) -> Result<Self, FrameError> {
        frame::read(body)
    }
}

impl Request<'_> {
    /// Whether the request changes the board so that doing it twice is not doing it once.
    ///
    /// These are obeyed at most once, in the order of their sequence numbers; the others whenever
    /// they come.
    pub const fn is_order(&self) -> bool {
        !matches!(
            self,
            Self::Hello(_)
                | Self::Status
                | Self::KeepAlive
                | Self::UploadBlock(_)
                | Self::UploadProgress
                | Self::List
                | Self::GetLimits
                | Self::GetConfig
                | Self::GetDrives
                | Self::GetFault
                | Self::GetFaultSamples { .. }
        )
    }
}

/// A block of an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Block<'a> {
    /// [`Outline::tag`] of the trajectory.
    pub tag: u32,
    /// Number of the block, from 0.
    pub block: u8,
    /// Its values: [`BLOCK_VALUES`](crate::assembly::BLOCK_VALUES) little-endian f32, fewer in the
    /// last block.
    pub values: &'a [u8],
}
