//! What a group of drives knows about each of them and about its buses, for people.

use core::fmt;

use super::nmt::NmtState;
use super::sdo::Object;
use super::state::DriveState;
use super::trouble::Trouble;

/// How far a drive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// It is set up; if it has not answered yet, so since the board started.
    Setup {
        /// The step it is at.
        step: u8,
    },
    /// It was started and has to show feedback in the right mode.
    Starting,
    /// It exchanges process data.
    Operational,
}

/// One axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisReport {
    /// How far it is.
    pub stage: Stage,
    /// Its state by the newest statusword.
    pub state: Option<DriveState>,
    /// What its last heartbeat told.
    pub nmt: Option<NmtState>,
    /// What keeps it from being used.
    pub trouble: Option<Trouble>,
    /// Error code of its last emergency message, or of 603Fh; 0 for none.
    pub error_code: u16,
    /// The object it did not answer when it was last asked for one.
    pub silent_at: Option<Object>,
    /// Set-points whose torque was cut to the configured part of the rated torque.
    pub torque_saturated: u32,
    /// Set-points whose position was no number of increments that fits.
    pub position_saturated: u32,
}

/// One bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Traffic {
    /// Frames given to the controller.
    pub sent: u32,
    /// Frames of drives received.
    pub received: u32,
    /// Frames from nodes that are not configured, or that are none of drives.
    pub foreign: u32,
    /// Times the controller reported frames lost.
    pub overruns: u32,
    /// Times it reported another error.
    pub errors: u32,
    /// Ticks in a row in which it took none of the frames offered.
    pub blocked_ticks: u16,
}

impl fmt::Display for AxisReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.stage, self.silent_at) {
            (Stage::Setup { .. }, Some(object)) => write!(
                f,
                "no answer to {object}: check the node id, the cabling and the drive's supply"
            )?,
            (Stage::Setup { step }, None) => write!(f, "being set up, step {step}")?,
            (Stage::Starting, _) => write!(f, "starting")?,
            (Stage::Operational, _) => match self.state {
                Some(state) => write!(f, "{state}")?,
                None => write!(f, "in no known state")?,
            },
        }
        if let Some(trouble) = self.trouble {
            write!(f, "; {trouble}")?;
        }
        if self.error_code != 0 {
            let words = stillpoint_shared::drive_error::words(self.error_code);
            write!(f, "; error {:#06x}, {words}", self.error_code)?;
        }
        Ok(())
    }
}

impl fmt::Display for DriveState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
        })
    }
}
