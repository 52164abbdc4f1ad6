//! Network management: commands to nodes, and what their heartbeats tell.

use core::fmt;

/// A command to one node: byte 0 of the message; byte 1 is the node id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum NmtCommand {
    /// Go to operational: process data flows.
    Start,
    /// Go to pre-operational: only SDO, no process data.
    EnterPreOperational,
}

impl NmtCommand {
    /// The message for a node.
    pub(super) const fn bytes(self, node: u8) -> [u8; 2] {
        match self {
            Self::Start => [0x01, node],
            Self::EnterPreOperational => [0x80, node],
        }
    }
}

/// State of a node as its heartbeat tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NmtState {
    /// It has just started.
    BootUp,
    /// No SDO, no process data.
    Stopped,
    /// All services.
    Operational,
    /// SDO, but no process data.
    PreOperational,
    /// None that CANopen knows.
    Unknown(u8),
}

impl NmtState {
    /// State in a heartbeat's only byte.
    pub(super) const fn from_heartbeat(byte: u8) -> Self {
        match byte {
            0x00 => Self::BootUp,
            0x04 => Self::Stopped,
            0x05 => Self::Operational,
            0x7f => Self::PreOperational,
            other => Self::Unknown(other),
        }
    }
}

impl fmt::Display for NmtState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BootUp => write!(f, "boot-up"),
            Self::Stopped => write!(f, "stopped"),
            Self::Operational => write!(f, "operational"),
            Self::PreOperational => write!(f, "pre-operational"),
            Self::Unknown(state) => write!(f, "unknown ({state:#04x})"),
        }
    }
}

/// Heartbeat of the board itself: always operational.
pub(super) const OPERATIONAL_HEARTBEAT: [u8; 1] = [0x05];

/// Consumer of one node's heartbeat.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heartbeat {
    waited_ticks: u32,
    /// What the last one told since [`Heartbeat::restart`].
    pub(super) told: Option<NmtState>,
}

impl Heartbeat {
    pub(super) const fn new() -> Self {
        Self {
            waited_ticks: 0,
            told: None,
        }
    }

    /// Waits from now on, with nothing told.
    pub(super) fn restart(&mut self) {
        *self = Self::new();
    }

    pub(super) fn receive(&mut self, state: NmtState) {
        self.waited_ticks = 0;
        self.told = Some(state);
    }

    /// One tick of waiting; true when it is too long.
    pub(super) fn tick(&mut self, timeout_ticks: u32) -> bool {
        self.waited_ticks = self.waited_ticks.saturating_add(1);
        self.waited_ticks > timeout_ticks
    }
}
