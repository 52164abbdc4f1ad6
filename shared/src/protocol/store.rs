//! Why the store refuses.

use core::fmt;

use serde::{Deserialize, Serialize};

/// Why the store refuses. What was stored before is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoreError {
    /// Nothing stored has this content hash.
    NotStored {
        /// The content hash asked for.
        content_hash: u64,
    },
    /// There are too many trajectories in the store.
    TooMany {
        /// Most trajectories.
        most: u8,
    },
    /// The trajectory does not fit beside the others.
    NoRoom {
        /// Bytes it needs.
        needed: u32,
        /// Bytes left beside the others.
        available: u32,
    },
    /// The flash does not keep what is written to it.
    Flash {
        /// Sector of the flash.
        sector: u8,
        /// Offset in the sector, in bytes.
        offset: u32,
    },
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotStored { content_hash } => write!(
                f,
                "trajectory {content_hash:016x} is not stored: list what is"
            ),
            Self::TooMany { most } => write!(
                f,
                "{most} trajectories are stored, more do not fit: erase one"
            ),
            Self::NoRoom { needed, available } => write!(
                f,
                "the trajectory needs {needed} bytes of the store, {available} are left: erase another"
            ),
            Self::Flash { sector, offset } => write!(
                f,
                "flash sector {sector} does not keep what is written at byte {offset}: replace the board"
            ),
        }
    }
}

impl core::error::Error for StoreError {}
