//! The fault reset: one rising edge of bit 7 of the controlword per request, and never another.

use super::state::{Command, DriveState};

/// Bus cycles for which the bit stays high at most: enough for a few lost messages and a slow
/// drive.
const HIGH_CYCLES: u8 = 50;

/// Fault reset of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FaultReset {
    /// Cycles left; the first one has the bit low.
    cycles: u8,
}

impl FaultReset {
    /// Begins.
    pub(super) fn request(&mut self) {
        self.cycles = HIGH_CYCLES + 1;
    }

    /// Ends, done or not.
    pub(super) fn cancel(&mut self) {
        self.cycles = 0;
    }

    /// What an axis that is off is told in this cycle.
    pub(super) fn next(&mut self, state: Option<DriveState>) -> Command {
        if state != Some(DriveState::Fault) {
            self.cancel();
            return Command::DisableVoltage;
        }
        let low = self.cycles == HIGH_CYCLES + 1 || self.cycles == 0;
        self.cycles = self.cycles.saturating_sub(1);
        if low {
            Command::DisableVoltage
        } else {
            Command::FaultReset
        }
    }
}
