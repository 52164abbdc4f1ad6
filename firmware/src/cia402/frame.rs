//! CAN frames as CANopen uses them: 11-bit identifiers made of a service and a node id.

use embedded_can::{Frame, Id, StandardId};

/// A data frame with an 11-bit identifier, independent of the bus' own type.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CanFrame {
    id: u16,
    len: u8,
    bytes: [u8; 8],
}

impl CanFrame {
    /// A frame; only the lower 11 bits of `id` and the first 8 bytes of `data` count.
    pub fn new(id: u16, data: &[u8]) -> Self {
        let mut frame = Self {
            id: id & 0x7ff,
            len: 0,
            bytes: [0; 8],
        };
        for (byte, value) in frame.bytes.iter_mut().zip(data) {
            *byte = *value;
            frame.len += 1;
        }
        frame
    }

    /// Takes over a received frame; `None` for extended and remote ones, which CANopen drives do
    /// not send.
    pub fn received<F: Frame>(frame: &F) -> Option<Self> {
        match frame.id() {
            Id::Standard(id) if !frame.is_remote_frame() => {
                Some(Self::new(id.as_raw(), frame.data()))
            }
            _ => None,
        }
    }

    /// The frame in the bus' own type.
    pub fn to<F: Frame>(&self) -> Option<F> {
        F::new(StandardId::new(self.id)?, self.data())
    }

    /// Identifier; the lower, the more urgent.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// 0 to 8 bytes.
    pub fn data(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or_default()
    }

    /// Service and node id, if it is a service that drives send.
    pub(super) fn service(&self) -> Option<(Service, u8)> {
        let service = match self.id & 0x780 {
            EMERGENCY => Service::Emergency,
            TPDO1 => Service::Feedback,
            SDO_ANSWER => Service::SdoAnswer,
            HEARTBEAT => Service::Heartbeat,
            _ => return None,
        };
        Some((service, (self.id & 0x7f) as u8))
    }
}

/// What a drive sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Service {
    /// EMCY.
    Emergency,
    /// Its first transmit process data object.
    Feedback,
    /// The answer of its SDO server.
    SdoAnswer,
    /// Heartbeat or boot-up.
    Heartbeat,
}

/// Identifier of network management: commands to all nodes.
pub(super) const NMT: u16 = 0x000;
/// Identifier of SYNC.
pub(super) const SYNC: u16 = 0x080;
/// Identifier of emergencies, plus the node id.
pub(super) const EMERGENCY: u16 = 0x080;
/// Identifier of a drive's first transmit PDO, plus the node id.
pub(super) const TPDO1: u16 = 0x180;
/// Identifier of a drive's first receive PDO, plus the node id.
pub(super) const RPDO1: u16 = 0x200;
/// Identifier of SDO answers, plus the node id.
pub(super) const SDO_ANSWER: u16 = 0x580;
/// Identifier of SDO requests, plus the node id.
pub(super) const SDO_REQUEST: u16 = 0x600;
/// Identifier of heartbeats, plus the node id.
pub(super) const HEARTBEAT: u16 = 0x700;
