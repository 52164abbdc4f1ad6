//! When what is on the bus: the length of frames, the load, and the order of a bus cycle in ticks.
//!
//! A bus cycle of D ticks begins with SYNC. The drives answer with where they were at SYNC; set-
//! points go out L ticks before the next SYNC, at which all drives take them at once:
//!
//! ```text
//! tick    0      1      2      3      4      5      6      7      0
//!        SYNC                               set-points            SYNC     D = 8, L = 3, R = 3
//!        <---- feedback, R --->  (SDO)      <--------- L -------->
//! ```
//!
//! # Length of a frame
//! A data frame with an 11-bit identifier, s bytes and the space to the next frame has 47 + 8 s bits,
//! of which 34 + 8 s can be stuffed, at worst after the first four with one bit for every four:
//! 47 + 8 s + ⌊(34 + 8 s − 1) / 4⌋. Source: Davis, Burns, Bril, Lukkien, "Controller Area Network
//! (CAN) schedulability analysis: refuted, revisited and revised", Real-Time Systems 35 (2007).
//!
//! # Load
//! Per cycle and bus: SYNC (0 bytes, 55 bits) and per axis a set-point (8 bytes, 135 bits) and an
//! answer (7 bytes, 125 bits).
//!
//! | | bits per cycle | period | load at 1 Mbit/s |
//! |---|---|---|---|
//! | 3 axes on one bus | 55 + 3 · 260 = 835 | 2 ms | 41.8 % |
//! | 2 axes on the first of two buses | 55 + 2 · 260 = 575 | 1 ms | 57.5 % |
//! | 1 axis on the second | 55 + 260 = 315 | 1 ms | 31.5 % |
//! | 3 axes on one bus | 835 | 1 ms | 83.5 %: refused |
//!
//! Heartbeats (65 bits each, four every 50 ms) add 0.5 %; while drives are set up, SDO adds one
//! request and one answer per bus and cycle, 270 bits.

use crate::config::MonitorConfig;
use crate::time::{self, TIME_TICKS_PER_SECOND};

use super::{BusConfig, DriveConfig, DriveConfigError};

/// Greatest load of a bus in thousandths of its bit rate, frames at their longest.
pub const MOST_BUS_LOAD_PERMILLE: u32 = 700;

const SYNC_BITS: u32 = frame_bits(0);
const SETPOINT_BITS: u32 = frame_bits(8);
const FEEDBACK_BITS: u32 = frame_bits(7);
/// A frame of less priority that has just begun has to be waited for.
const BLOCKING_BITS: u32 = frame_bits(8);

/// Bits of a data frame with `bytes` ≤ 8, the space to the next one included, stuffed at its worst.
pub const fn frame_bits(bytes: u32) -> u32 {
    let stuffed = 34 + 8 * bytes;
    13 + stuffed + (stuffed - 1) / 4
}

/// Load of a bus with some axes, in thousandths of its bit rate, rounded up.
pub fn bus_load_permille(bus: &BusConfig, axes: usize) -> u32 {
    let bits = SYNC_BITS + axes as u32 * (SETPOINT_BITS + FEEDBACK_BITS);
    let capacity = u32::from(bus.bit_rate_kbit_per_s) * u32::from(bus.period_us);
    (bits.saturating_mul(1_000_000)).div_ceil(capacity.max(1))
}

/// A period in µs as the drives want it (object 60C2h): a number up to 255 and a power of ten of
/// seconds. `None` if it has none.
pub fn interpolation_time(period_us: u16) -> Option<(u8, i8)> {
    [(1_000, -3), (100, -4), (10, -5), (1, -6)]
        .into_iter()
        .find(|(unit_us, _)| period_us.is_multiple_of(*unit_us))
        .and_then(|(unit_us, exponent)| {
            let units = period_us.checked_div(unit_us)?;
            Some((u8::try_from(units).ok()?, exponent))
        })
}

/// A bus cycle in ticks of the executor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cycle {
    /// D: ticks from SYNC to SYNC.
    pub ticks: u16,
    /// L: ticks from the set-points to the SYNC at which they are taken.
    pub lead_ticks: u16,
    /// R: ticks after SYNC within which the feedback has come, 2 at least.
    pub reply_ticks: u16,
}

impl Cycle {
    /// The cycle for a tick of `tick_ticks` time ticks of 0.1 µs. The fullest bus decides for all,
    /// so that all axes get set-points of the same tick.
    pub fn new(config: &DriveConfig, tick_ticks: u32) -> Result<Self, DriveConfigError> {
        let BusConfig {
            period_us,
            bit_rate_kbit_per_s,
            ..
        } = *config.bus();
        let period_ticks = u32::from(period_us) * (TIME_TICKS_PER_SECOND / 1_000_000);
        let ticks = period_ticks.checked_div(tick_ticks).unwrap_or_default();
        let whole = period_ticks.is_multiple_of(tick_ticks);
        if !(whole && (1..=u32::from(u16::MAX)).contains(&ticks)) {
            return Err(DriveConfigError::NotTicks {
                period_us,
                tick_ticks,
            });
        }
        let on_fullest = (0..config.buses()).map(|bus| config.axes_on(bus)).max();
        let axes = on_fullest.unwrap_or_default() as u32;
        // A bit at 1 kbit/s lasts 1 ms, 10 000 time ticks.
        let bits_to_ticks = |bits: u32| {
            let time_ticks = (bits * 10_000).div_ceil(u32::from(bit_rate_kbit_per_s).max(1));
            time_ticks.div_ceil(tick_ticks.max(1))
        };
        let lead_ticks = bits_to_ticks(axes * SETPOINT_BITS + BLOCKING_BITS);
        // The tick after SYNC is kept free of set-points, for heartbeats and SDO.
        let reply_ticks = bits_to_ticks(SYNC_BITS + axes * FEEDBACK_BITS + BLOCKING_BITS).max(2);
        if lead_ticks + reply_ticks > ticks {
            return Err(DriveConfigError::NoTime {
                ticks,
                lead_ticks,
                reply_ticks,
            });
        }
        Ok(Self {
            ticks: ticks as u16,
            lead_ticks: lead_ticks as u16,
            reply_ticks: reply_ticks as u16,
        })
    }

    /// Greatest age of feedback in ticks when as many as `lost` messages in a row are lost: what the
    /// executor's monitor has to allow at least.
    pub fn feedback_age_ticks(&self, lost: u16) -> u16 {
        (self.ticks.saturating_mul(lost.saturating_add(1)))
            .saturating_add(self.reply_ticks)
            .saturating_sub(1)
    }

    /// What the executor's monitor has to allow on these buses, when `drives` is what it would allow
    /// drives that answer in every tick: their lag comes on top of the bus's, and as many answers
    /// may be lost in a row, which is what an age means where an answer comes in every tick.
    pub fn monitor(&self, drives: &MonitorConfig, tick_ticks: u32) -> MonitorConfig {
        let lost = drives.feedback_age_ticks;
        let lost_ticks = self.ticks.saturating_mul(lost);
        let lag_ticks = self.following_lag_ticks().saturating_add(lost_ticks);
        let lag_s = time::seconds(tick_ticks) as f32 * f32::from(lag_ticks);
        MonitorConfig {
            following_lag_s: drives.following_lag_s + lag_s,
            feedback_age_ticks: self.feedback_age_ticks(lost),
            ..*drives
        }
    }

    /// Ticks by which a drive that follows exactly seems to lag when no message is lost: the
    /// set-point waits L for SYNC and is reached D later, and its feedback is D + R − 1 old at most.
    pub fn following_lag_ticks(&self) -> u16 {
        self.feedback_age_ticks(0)
            .saturating_add(self.lead_ticks)
            .saturating_add(self.ticks)
    }
}
