//! What a drive measured at a SYNC: statusword, position, mode; and the speed between two of them.

use super::CYCLIC_SYNCHRONOUS_POSITION;
use super::state::DriveState;
use super::units::Units;

/// Content of a feedback message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) statusword: u16,
    pub(super) counts: i32,
    pub(super) mode: i8,
}

impl Message {
    /// 6041h, 6064h and 6061h, little-endian; `None` for another length.
    pub(super) fn parse(data: &[u8]) -> Option<Self> {
        let &[s0, s1, p0, p1, p2, p3, mode] = data else {
            return None;
        };
        Some(Self {
            statusword: u16::from_le_bytes([s0, s1]),
            counts: i32::from_le_bytes([p0, p1, p2, p3]),
            mode: mode as i8,
        })
    }
}

/// The newest measurement of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Measured {
    pub(super) message: Message,
    /// `None` if the statusword is that of no state.
    pub(super) state: Option<DriveState>,
    pub(super) position_rad: f32,
    pub(super) velocity_rad_per_s: f32,
    /// Ticks since the SYNC at which it was measured.
    pub(super) age_ticks: u16,
    /// Tick of that SYNC.
    at_tick: u32,
    /// Increments at the SYNC before it that was answered, and its tick.
    before: Option<(i32, u32)>,
}

impl Measured {
    /// The measurement after `previous`, made at the SYNC of tick `at_tick`, `age_ticks` ago.
    ///
    /// The speed is the difference of the positions at the last two SYNCs that were answered,
    /// divided by the time between them: it is that of half a cycle before. A second message for
    /// the same SYNC counts as the better one.
    pub(super) fn next(
        previous: Option<&Self>,
        message: Message,
        at_tick: u32,
        age_ticks: u16,
        units: &Units,
        tick_s: f32,
    ) -> Self {
        let before = previous.and_then(|previous| {
            if previous.at_tick == at_tick {
                previous.before
            } else {
                Some((previous.message.counts, previous.at_tick))
            }
        });
        let velocity_rad_per_s = before.map_or(0.0, |(counts, tick)| {
            let moved = message.counts.wrapping_sub(counts);
            units.speed_rad_per_s(moved, at_tick.wrapping_sub(tick) as f32 * tick_s)
        });
        Self {
            message,
            state: DriveState::from_statusword(message.statusword),
            position_rad: units.angle_rad(message.counts),
            velocity_rad_per_s,
            age_ticks,
            at_tick,
            before,
        }
    }

    /// Whether the drive is in cyclic synchronous position mode.
    pub(super) fn in_mode(&self) -> bool {
        self.message.mode == CYCLIC_SYNCHRONOUS_POSITION
    }

    /// Whether a drive in the mode follows its set-points: it is enabled and, where it tells, says
    /// so (bit 12).
    pub(super) fn follows(&self, tells_following: bool) -> bool {
        let told = !tells_following || self.message.statusword & 1 << 12 != 0;
        self.state == Some(DriveState::OperationEnabled) && told
    }
}
