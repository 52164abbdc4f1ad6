//! Limits in force: no faults, the move goes on.

use core::fmt;
use core::ops::{BitOr, BitOrAssign};

use serde::{Deserialize, Serialize};

/// Limits in force on one axis. Momentary: in this tick; sticky: since the move was started.
#[derive(Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LimitFlags(u8);

impl LimitFlags {
    /// No limit is in force.
    pub const NONE: Self = Self(0);
    /// Torque beyond its largest value.
    pub const TORQUE: Self = Self(1);
    /// Torque changing too fast.
    pub const TORQUE_RATE: Self = Self(2);
    /// Torque beyond the torque–speed curve.
    pub const TORQUE_SPEED: Self = Self(4);
    /// Velocity or step of position too large.
    pub const SPEED: Self = Self(8);
    /// A value that is no finite number.
    pub const NOT_FINITE: Self = Self(16);

    const NAMES: [(Self, &'static str); 5] = [
        (Self::TORQUE, "torque"),
        (Self::TORQUE_RATE, "torque rate"),
        (Self::TORQUE_SPEED, "torque-speed curve"),
        (Self::SPEED, "speed"),
        (Self::NOT_FINITE, "not finite"),
    ];

    /// The flags as bits, as telemetry carries them.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The flags of these bits, as telemetry carries them.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Whether no limit is in force.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `other` are in force.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Raises `flag` if `condition` holds.
    pub fn raise_if(&mut self, condition: bool, flag: Self) {
        if condition {
            *self |= flag;
        }
    }
}

impl BitOr for LimitFlags {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for LimitFlags {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl fmt::Debug for LimitFlags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set()
            .entries(
                Self::NAMES
                    .iter()
                    .filter(|(flag, _)| self.contains(*flag))
                    .map(|(_, name)| name),
            )
            .finish()
    }
}
