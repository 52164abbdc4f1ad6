//! What keeps a drive from being used, seen from the board: latched until a fault reset.

use core::fmt;

use stillpoint_shared::drive_error::seen;

use super::abort::AbortCode;
use super::nmt::NmtState;
use super::sdo::Object;

/// What keeps a drive from being used. Its `Display` says what to do.
///
/// The drive's own faults are no trouble in this sense: the drive latches them itself.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Trouble {
    /// The node is no CiA 402 drive.
    NotADrive {
        /// Its device type (1000h); the lower 16 bits of a drive's are 402.
        device_type: u32,
    },
    /// The motor's rated torque is another than configured.
    RatedTorque {
        /// In the configuration, in N·m.
        configured_nm: f32,
        /// In the drive (6076h), in N·m.
        drive_nm: f32,
    },
    /// The drive refuses to be set up.
    Refused {
        /// The object it refuses.
        object: Object,
        /// Why.
        code: AbortCode,
    },
    /// The drive does not take up cyclic synchronous position mode.
    Mode {
        /// The mode it shows (6061h).
        shown: i8,
    },
    /// The drive was started but sends no feedback at SYNC.
    NoFeedback,
    /// The feedback is not what the mapping says.
    FeedbackLength {
        /// Bytes received instead of 7.
        bytes: u8,
    },
    /// No heartbeat came.
    HeartbeatLost {
        /// For so long, in ms.
        timeout_ms: u16,
    },
    /// The drive left the operational state.
    NotOperational {
        /// What its heartbeat told.
        state: NmtState,
    },
    /// The drive started anew, as after a loss of its supply.
    Restarted,
}

impl Trouble {
    /// Its code for [`DriveStatus::Fault`](crate::DriveStatus).
    pub const fn code(&self) -> u16 {
        match self {
            Self::NotADrive { .. } => seen::NOT_A_DRIVE,
            Self::RatedTorque { .. } => seen::RATED_TORQUE,
            Self::Refused { .. } => seen::REFUSED,
            Self::Mode { .. } => seen::MODE,
            Self::NoFeedback => seen::NO_FEEDBACK,
            Self::FeedbackLength { .. } => seen::FEEDBACK_LENGTH,
            Self::HeartbeatLost { .. } => seen::HEARTBEAT_LOST,
            Self::NotOperational { .. } => seen::NOT_OPERATIONAL,
            Self::Restarted => seen::RESTARTED,
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotADrive { device_type } => write!(
                f,
                "the node is no CiA 402 drive (device type {device_type:#010x}): check the node ids"
            ),
            Self::RatedTorque {
                configured_nm,
                drive_nm,
            } => write!(
                f,
                "the rated torque is {configured_nm} N·m in the configuration and {drive_nm} N·m in the drive (6076h): \
                 torques would be scaled wrongly, correct one of them"
            ),
            Self::Refused { object, code } => write!(
                f,
                "the drive refuses object {object}: {code}; see its manual, or map its process data in the drive and \
                 set the mapping to preset"
            ),
            Self::Mode { shown } => write!(
                f,
                "the drive does not take up cyclic synchronous position mode (8), it shows mode {shown}: \
                 use a drive that has it"
            ),
            Self::NoFeedback => write!(
                f,
                "the drive sends no feedback at SYNC: check its first transmit PDO (1800h, 1A00h)"
            ),
            Self::FeedbackLength { bytes } => write!(
                f,
                "the feedback has {bytes} bytes instead of 7: map 6041h, 6064h and 6061h to the first transmit PDO"
            ),
            Self::HeartbeatLost { timeout_ms } => write!(
                f,
                "no heartbeat for {timeout_ms} ms: check the cabling and the drive's supply, then reset"
            ),
            Self::NotOperational { state } => write!(
                f,
                "the drive left the operational state ({state}): see its error memory, then reset"
            ),
            Self::Restarted => {
                write!(f, "the drive started anew: check its supply, then reset")
            }
        }
    }
}

impl core::error::Error for Trouble {}
