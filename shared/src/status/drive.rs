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
    /// Has stopped by itself, or cannot be used; until `clear`, or until it answers.
    Fault {
        /// The drive's own code, or one of [`drive_error::seen`]; [`drive_error::words`] says what it means.
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
                "in fault {code:04X}h, {}; {}",
                drive_error::words(code),
                drive_error::cure(code)
            ),
        }
    }
}
