//! What a drive says about itself.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::drive_error;

/// State of one drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DriveStatus {
    /// No torque; set-points are not followed (yet).
    Disabled,
    /// Follows its set-points.
    Enabled,
    /// Has stopped by itself, until `clear`.
    Fault {
        /// The drive's own code; [`drive_error::words`] says what it means.
        code: u16,
    },
}

impl fmt::Display for DriveStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Disabled => f.write_str("off"),
            Self::Enabled => f.write_str("on"),
            Self::Fault { code } => write!(
                f,
                "in fault {code:#06x}, {}: remove the cause, then clear",
                drive_error::words(code)
            ),
        }
    }
}
