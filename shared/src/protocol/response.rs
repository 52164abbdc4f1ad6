//! What the board answers, and what it sends by itself.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::fault::MAX_FAULT_SAMPLES;
use super::frame::{self, Envelope, FrameError};
use super::hello::MAX_STORED;
use super::{Denial, FaultHead, FaultSample, Identity, Telemetry};
use crate::assembly::Arrived;
use crate::config::Config;
use crate::status::{DriveStatus, Fault, HoldReason, LimitFlags, State};
use crate::{DriveConfig, Limits, MAX_AXES};

/// Anything the board sends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
// Made on the stack, sent, and gone.
#[allow(clippy::large_enum_variant)]
pub enum Message {
    /// The answer to a request, whose sequence number it carries. The first variant in every
    /// version.
    Response(Response),
    /// A sample of the drive loop, unasked.
    Telemetry(Telemetry),
}

impl Message {
    /// Its frame, as of [`frame::encode`]; compiled here once, as this library is.
    pub fn encode<'b>(
        &self,
        envelope: Envelope,
        buffer: &'b mut [u8],
    ) -> Result<&'b mut [u8], FrameError> {
        frame::encode(envelope, self, buffer)
    }
}

/// The answer to a request; the table in the [module header](super) says which belongs to which.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(clippy::large_enum_variant)]
pub enum Response {
    /// Who is there. The first variant in every version.
    Hello(Identity),
    /// The request was refused, and nothing has changed.
    Denied(Denial),
    /// The request was obeyed.
    Done,
    /// How things are.
    Status(Status),
    /// Which blocks of the upload have arrived.
    Upload(Arrived),
    /// The stored trajectories.
    Stored(Vec<StoredMove, MAX_STORED>),
    /// The machine's limits.
    Limits(Limits),
    /// How the executor plays.
    Config(Config),
    /// The configuration of the drives, if there is one.
    Drives(Option<DriveConfig>),
    /// The head of the fault record, if there is a fault in it.
    Fault(Option<FaultHead>),
    /// Samples of the fault record, oldest first.
    FaultSamples(Vec<FaultSample, MAX_FAULT_SAMPLES>),
}

/// How things are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// State of the executor.
    pub state: State,
    /// Why a move is held, in `Holding` and `Held`.
    pub held_by: Option<HoldReason>,
    /// The first cause, in `Fault`.
    pub fault: Option<Fault>,
    /// Tick of the drive loop.
    pub tick: u64,
    /// Time in the trajectory, in ticks of 0.1 µs.
    pub path_ticks: u32,
    /// Duration of the loaded trajectory, in ticks of 0.1 µs.
    pub duration_ticks: u32,
    /// Content hash of the loaded trajectory.
    pub loaded: Option<u64>,
    /// Hash of the machine's limits.
    pub limits_hash: u64,
    /// Override in per cent.
    pub override_percent: u8,
    /// Whether the move under way is a dry run.
    pub dry_run: bool,
    /// The axes.
    pub axes: Vec<AxisStatus, MAX_AXES>,
    /// The upload under way.
    pub upload: Arrived,
    /// What the link has seen.
    pub link: LinkCounters,
}

/// How an axis is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisStatus {
    /// What its drive said last about itself, or the board about a drive it cannot use; none if the
    /// bus fails or there are no drives.
    pub drive: Option<DriveStatus>,
    /// Measured position in rad, if its drive is heard of lately.
    pub measured_rad: Option<f32>,
    /// Largest following error since the move was started, in rad.
    pub following_peak_rad: f32,
    /// Limits that were in force since the move was started.
    pub limited: LimitFlags,
}

/// Counters of the link since the board was switched on. They stop at their largest value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkCounters {
    /// Requests received whole.
    pub requests: u32,
    /// Frames that were damaged and have no answer.
    pub damaged: u32,
    /// Bytes that found the receive buffer full.
    pub overrun_bytes: u32,
    /// Requests that came again and were answered again without being obeyed again.
    pub repeated: u32,
    /// Samples of telemetry dropped.
    pub dropped: u32,
}

/// A stored trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StoredMove {
    /// The planner's name for the move.
    pub id: u32,
    /// Content hash.
    pub content_hash: u64,
    /// Hash of the limits it was planned for.
    pub limits_hash: u64,
    /// Duration in ticks of 0.1 µs.
    pub duration_ticks: u32,
    /// Size in bytes.
    pub bytes: u32,
}
