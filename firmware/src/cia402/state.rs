//! The state machine of a CiA 402 drive, as its statusword (6041h) tells it and the controlword
//! (6040h) moves it.
//!
//! | | from | to | by |
//! |---|---|---|---|
//! | 0 | power on | Not ready to switch on | the drive |
//! | 1 | Not ready to switch on | Switch on disabled | the drive, after its self-test |
//! | 2 | Switch on disabled | Ready to switch on | Shutdown |
//! | 3 | Ready to switch on | Switched on | Switch on |
//! | 4 | Switched on | Operation enabled | Enable operation |
//! | 5 | Operation enabled | Switched on | Switch on (there called Disable operation) |
//! | 6 | Switched on | Ready to switch on | Shutdown |
//! | 7 | Ready to switch on | Switch on disabled | Disable voltage, Quick stop |
//! | 8 | Operation enabled | Ready to switch on | Shutdown |
//! | 9 | Operation enabled | Switch on disabled | Disable voltage |
//! | 10 | Switched on | Switch on disabled | Disable voltage, Quick stop |
//! | 11 | Operation enabled | Quick stop active | Quick stop |
//! | 12 | Quick stop active | Switch on disabled | Disable voltage, or the drive when it stands |
//! | 13 | any | Fault reaction active | the drive |
//! | 14 | Fault reaction active | Fault | the drive, when the reaction is over |
//! | 15 | Fault | Switch on disabled | Fault reset: a rising edge of bit 7 |
//! | 16 | Quick stop active | Operation enabled | Enable operation, if the drive can |
//!
//! Source: CiA 402-2 and IEC 61800-7-201, finite state automaton of the power drive system.

/// State of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DriveState {
    /// It tests itself.
    NotReadyToSwitchOn,
    /// No torque; parameters can be set.
    SwitchOnDisabled,
    /// No torque; the high voltage may be applied.
    ReadyToSwitchOn,
    /// No torque; the high voltage is there.
    SwitchedOn,
    /// It follows its set-points.
    OperationEnabled,
    /// It stops, or stands after having stopped.
    QuickStopActive,
    /// It has seen a fault and stops.
    FaultReactionActive,
    /// No torque, until the fault is reset.
    Fault,
}

impl DriveState {
    /// All states.
    pub const ALL: [Self; 8] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
    ];

    /// State that a statusword tells; `None` if its bits are those of no state.
    pub const fn from_statusword(statusword: u16) -> Option<Self> {
        // Bits 0 to 3 and 6; bit 5 (quick stop, low when active) counts where bit 0 is set.
        Some(match (statusword & 0x4f, statusword & 0x20 != 0) {
            (0x00, _) => Self::NotReadyToSwitchOn,
            (0x40, _) => Self::SwitchOnDisabled,
            (0x01, true) => Self::ReadyToSwitchOn,
            (0x03, true) => Self::SwitchedOn,
            (0x07, true) => Self::OperationEnabled,
            (0x07, false) => Self::QuickStopActive,
            (0x0f, _) => Self::FaultReactionActive,
            (0x08, _) => Self::Fault,
            _ => return None,
        })
    }

    /// Whether the drive has stopped, or is about to, because of a fault.
    pub const fn is_fault(self) -> bool {
        matches!(self, Self::FaultReactionActive | Self::Fault)
    }

    /// Where a command takes the drive: the number of the transition and the state after it, if
    /// there is one. Enable operation takes one step at a time here; drives may take 3 and 4 at
    /// once.
    pub const fn after(self, command: Command) -> Option<(u8, Self)> {
        use Command::{DisableVoltage, EnableOperation, FaultReset, QuickStop, Shutdown, SwitchOn};
        Some(match (self, command) {
            (Self::SwitchOnDisabled, Shutdown) => (2, Self::ReadyToSwitchOn),
            (Self::ReadyToSwitchOn, SwitchOn | EnableOperation) => (3, Self::SwitchedOn),
            (Self::SwitchedOn, EnableOperation) => (4, Self::OperationEnabled),
            (Self::OperationEnabled, SwitchOn) => (5, Self::SwitchedOn),
            (Self::SwitchedOn, Shutdown) => (6, Self::ReadyToSwitchOn),
            (Self::ReadyToSwitchOn, DisableVoltage | QuickStop) => (7, Self::SwitchOnDisabled),
            (Self::OperationEnabled, Shutdown) => (8, Self::ReadyToSwitchOn),
            (Self::OperationEnabled, DisableVoltage) => (9, Self::SwitchOnDisabled),
            (Self::SwitchedOn, DisableVoltage | QuickStop) => (10, Self::SwitchOnDisabled),
            (Self::OperationEnabled, QuickStop) => (11, Self::QuickStopActive),
            (Self::QuickStopActive, DisableVoltage) => (12, Self::SwitchOnDisabled),
            (Self::Fault, FaultReset) => (15, Self::SwitchOnDisabled),
            (Self::QuickStopActive, EnableOperation) => (16, Self::OperationEnabled),
            _ => return None,
        })
    }

    /// The command that brings a drive one step nearer to Operation enabled, and holds it there. A
    /// drive that quick-stopped by itself is switched off first; one in a fault is left alone.
    pub const fn towards_enabled(self) -> Command {
        match self {
            Self::SwitchOnDisabled => Command::Shutdown,
            Self::ReadyToSwitchOn => Command::SwitchOn,
            Self::SwitchedOn | Self::OperationEnabled => Command::EnableOperation,
            Self::NotReadyToSwitchOn
            | Self::QuickStopActive
            | Self::FaultReactionActive
            | Self::Fault => Command::DisableVoltage,
        }
    }
}

/// What a controlword asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Ready to switch on, from either side.
    Shutdown,
    /// Switched on, from either side.
    SwitchOn,
    /// Torque off at once.
    DisableVoltage,
    /// Stop as the drive is set to (605Ah).
    QuickStop,
    /// Follow the set-points.
    EnableOperation,
    /// Leave Fault; needs a controlword without it before.
    FaultReset,
}

impl Command {
    /// All commands.
    pub const ALL: [Self; 6] = [
        Self::Shutdown,
        Self::SwitchOn,
        Self::DisableVoltage,
        Self::QuickStop,
        Self::EnableOperation,
        Self::FaultReset,
    ];

    /// The controlword. Bits: 0 switch on, 1 enable voltage, 2 no quick stop, 3 enable operation, 7
    /// fault reset.
    pub const fn controlword(self) -> u16 {
        match self {
            Self::DisableVoltage => 0x00,
            Self::QuickStop => 0x02,
            Self::Shutdown => 0x06,
            Self::SwitchOn => 0x07,
            Self::EnableOperation => 0x0f,
            Self::FaultReset => 0x80,
        }
    }
}
