//! The greeting: who is there, and whether both sides speak the same protocol.

use core::fmt;

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use super::{PROTOCOL, SCHEMA_HASH};
use crate::assembly::BLOCK_VALUES;
use crate::basis::MAX_POINTS;
use crate::status::State;
use crate::trajectory::{MAX_BASES, MAX_COEFFICIENTS, MAX_INTERVALS};

/// A range of protocol versions, and the message types of the newest of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Versions {
    /// Oldest version understood.
    pub oldest: u16,
    /// Newest version understood.
    pub newest: u16,
    /// [`SCHEMA_HASH`] of the newest version.
    pub schema_hash: u32,
}

impl Versions {
    /// What this side speaks.
    pub const OWN: Self = Self {
        oldest: *PROTOCOL.start(),
        newest: *PROTOCOL.end(),
        schema_hash: SCHEMA_HASH,
    };

    /// The newest version that both sides understand.
    ///
    /// There is none where the ranges do not meet, nor where both give different message types the
    /// same number, as two builds from between releases may.
    pub const fn common(self, other: Self) -> Option<u16> {
        let newest = if self.newest < other.newest {
            self.newest
        } else {
            other.newest
        };
        let oldest = if self.oldest > other.oldest {
            self.oldest
        } else {
            other.oldest
        };
        let same_number = self.newest == other.newest;
        if newest < oldest || same_number && self.schema_hash != other.schema_hash {
            None
        } else {
            Some(newest)
        }
    }
}

impl fmt::Display for Versions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            oldest,
            newest,
            schema_hash,
        } = *self;
        if oldest == newest {
            write!(f, "{newest} (messages {schema_hash:08x})")
        } else {
            write!(f, "{oldest} to {newest} (messages {schema_hash:08x})")
        }
    }
}

/// The host's greeting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// What the host speaks.
    pub versions: Versions,
    /// A number that the host has just drawn: the same in a greeting that is sent again, another
    /// one for a new session.
    pub nonce: u32,
}

/// The beginning of the board's answer, the same in every version of the protocol: what a host
/// reads that speaks another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Greeting {
    /// What the board speaks.
    pub versions: Versions,
    /// Number of the session that is open now; 0 if there is no common version.
    pub session: u16,
    /// Kind of the board.
    pub board: String<16>,
    /// Version of the firmware.
    pub firmware: String<16>,
    /// First eight bytes of the image's build id; 0 if it has none.
    pub build_id: u64,
}

/// The board's answer to the greeting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// The beginning that never changes.
    pub greeting: Greeting,
    /// Number of axes.
    pub axes: u8,
    /// Period of the drive loop in ticks of 0.1 µs.
    pub period_ticks: u32,
    /// What fits.
    pub capacities: Capacities,
    /// State of the executor.
    pub state: State,
    /// [`Limits::hash`](crate::Limits::hash) of the machine's limits.
    pub limits_hash: u64,
    /// Content hash of the trajectory that is loaded.
    pub loaded: Option<u64>,
    /// Content hashes of the stored trajectories.
    pub stored: Vec<u64, MAX_STORED>,
}

/// Most trajectories in the store.
pub const MAX_STORED: usize = 12;

/// What fits into the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capacities {
    /// Intervals of a trajectory.
    pub intervals: u8,
    /// LGR points of an interval.
    pub points: u8,
    /// Different numbers of points in a trajectory.
    pub bases: u8,
    /// Values of a trajectory.
    pub coefficients: u16,
    /// Values of a block of an upload.
    pub block_values: u16,
    /// Requests that may be unanswered at a time.
    pub window: u8,
    /// Trajectories in the store.
    pub stored: u8,
    /// Bytes in the store, for trajectories of all moves together.
    pub store_bytes: u32,
}

impl Capacities {
    /// Those of this version of the code, with a window and a store of the given sizes.
    pub const fn new(window: u8, store_bytes: u32) -> Self {
        Self {
            intervals: MAX_INTERVALS as u8,
            points: MAX_POINTS as u8,
            bases: MAX_BASES as u8,
            coefficients: MAX_COEFFICIENTS as u16,
            block_values: BLOCK_VALUES as u16,
            window,
            stored: MAX_STORED as u8,
            store_bytes,
        }
    }
}
