//! Why a request was refused.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::StoreError;
use crate::status::Refusal;
use crate::{DriveConfigError, LimitsError};

/// Why a request was refused; nothing has changed then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Denial {
    /// The request belongs to no open session.
    Session {
        /// The session it named.
        named: u16,
        /// The session that is open; 0 for none.
        open: u16,
    },
    /// A later order was obeyed before this one came: obeying it now would turn their order around.
    Overtaken {
        /// Sequence number of the order.
        sequence: u16,
        /// Sequence number of the latest order obeyed.
        latest: u16,
    },
    /// There is no such request.
    NotUnderstood {
        /// Bytes of the request.
        bytes: u16,
    },
    /// The executor refuses.
    Executor(Refusal),
    /// The limits are impossible.
    Limits(LimitsError),
    /// The configuration of the drives is impossible.
    Drives(DriveConfigError),
    /// The configuration of the drives is of another number of axes than the board has.
    DriveAxes {
        /// Axes given.
        given: u8,
        /// Axes of the board.
        board: u8,
    },
    /// The store refuses.
    Store(StoreError),
    /// There are fewer samples in the fault record.
    FaultSample {
        /// The first one asked for, from 0.
        first: u16,
        /// Number of samples in the record.
        samples: u16,
    },
    /// The board is about to start anew, with other drives.
    Starting,
}

impl From<Refusal> for Denial {
    fn from(refusal: Refusal) -> Self {
        Self::Executor(refusal)
    }
}

impl From<StoreError> for Denial {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl fmt::Display for Denial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Session { named, open: 0 } => write!(
                f,
                "the board has no open session (session {named} was named), it may have been restarted: connect again"
            ),
            Self::Session { named, open } => write!(
                f,
                "session {named} is over, session {open} is open: connect again, and check who else is connected"
            ),
            Self::Overtaken { sequence, latest } => write!(
                f,
                "request {sequence} came after request {latest} had been obeyed, and was not: send it anew if it is still meant"
            ),
            Self::NotUnderstood { bytes } => write!(
                f,
                "the board does not understand a request of {bytes} bytes: use the same version on both sides"
            ),
            Self::Executor(refusal) => refusal.fmt(f),
            Self::Limits(error) => error.fmt(f),
            Self::Drives(error) => error.fmt(f),
            Self::DriveAxes { given, board } => write!(
                f,
                "drives of {given} axes were given, the board has {board}: give one per axis"
            ),
            Self::Store(error) => error.fmt(f),
            Self::FaultSample { first, samples } => write!(
                f,
                "sample {first} of the fault record was asked for, it has {samples}: ask for its head first"
            ),
            Self::Starting => write!(
                f,
                "the board is about to start anew with other drives: connect again"
            ),
        }
    }
}

impl core::error::Error for Denial {}
