//! The last second before a fault, in memory that may outlive a reset.
//!
//! The board places a [`FaultRecord`] where start-up code leaves it alone and gives it to the
//! executor; after a reset [`FaultRecord::recover`] tells what is in it. After power-up it is
//! garbage: the head carries a magic number, a version and a check sum, every sample one of its
//! own, so that one that was half written is left out. All fields are plain integers without
//! forbidden values.
//!
//! Two rings: [`RECENT`] samples a millisecond apart, which show the fault itself, and [`PAST`]
//! samples 10 ms apart, which make up the second. What a sample keeps of each axis is rounded to
//! the upper 16 bits of an f32 (3 digits). The commanded position is not kept: it follows from path
//! time and trajectory.

mod ring;
mod sample;
#[cfg(test)]
mod tests;

use stillpoint_shared::status::{Fault, FaultCause};
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

use ring::Ring;

pub use sample::RecordSample;
pub(crate) use sample::{Moment, RawSample};

/// Samples at 1 kHz.
pub const RECENT: usize = 64;

/// Samples at 100 Hz.
pub const PAST: usize = 100;

/// Recent samples per past one.
const PAST_EVERY: u16 = 10;

/// First bytes of a record that is one; change it with every change of its layout.
const MAGIC: u32 = u32::from_le_bytes(*b"SFR\x04");

/// Bytes of a [`RecordHead`]: its words, little-endian.
const HEAD_BYTES: usize = 4 * HEAD_WORDS;
const HEAD_WORDS: usize = 11;

/// What a record is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordHead {
    /// Number of axes.
    pub axes: u8,
    /// Whether samples are being added.
    pub recording: bool,
    /// Build of the firmware that recorded.
    pub build_id: u64,
    /// Content hash of the trajectory that was loaded.
    pub trajectory_hash: u64,
    /// Period of the drive loop, in time ticks.
    pub period_ticks: u32,
    /// The fault that ended the recording.
    pub fault: Option<Fault>,
}

impl RecordHead {
    #[inline(never)]
    fn encode(&self, bytes: &mut [u8; HEAD_BYTES]) {
        let [build_low, build_high] = halves(self.build_id);
        let [hash_low, hash_high] = halves(self.trajectory_hash);
        let fault = self.fault.map(|fault| (fault.cause.to_words(), fault.tick));
        let ([cause, one, other], tick) = fault.unwrap_or_default();
        let [tick_low, tick_high] = halves(tick);
        let flags = [self.axes, self.recording.into(), fault.is_some().into(), 0];
        let words: [u32; HEAD_WORDS] = [
            u32::from_le_bytes(flags),
            build_low,
            build_high,
            hash_low,
            hash_high,
            self.period_ticks,
            cause,
            one,
            other,
            tick_low,
            tick_high,
        ];
        for (bytes, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *bytes = word.to_le_bytes();
        }
    }

    #[inline(never)]
    fn decode(bytes: &[u8; HEAD_BYTES]) -> Option<Self> {
        let mut words = [0; HEAD_WORDS];
        for (word, &bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(bytes);
        }
        let [
            flags,
            build_low,
            build_high,
            hash_low,
            hash_high,
            period_ticks,
            cause,
            one,
            other,
            tick_low,
            tick_high,
        ] = words;
        let [axes, recording, failed, _] = flags.to_le_bytes();
        let fault = if failed == 0 {
            None
        } else {
            Some(Fault {
                cause: FaultCause::from_words([cause, one, other])?,
                tick: whole([tick_low, tick_high]),
            })
        };
        Some(Self {
            axes,
            recording: recording != 0,
            build_id: whole([build_low, build_high]),
            trajectory_hash: whole([hash_low, hash_high]),
            period_ticks,
            fault,
        })
    }
}

/// The last second before a fault. 5.4 kB for three axes. All bytes of an empty one are zero.
#[derive(Debug)]
#[repr(C)]
pub struct FaultRecord<const AXES: usize> {
    magic: u32,
    check: u32,
    head: [u8; HEAD_BYTES],
    recent: Ring<RECENT, AXES>,
    past: Ring<PAST, AXES>,
    until_past: u16,
}

impl<const AXES: usize> FaultRecord<AXES> {
    /// Nothing is recorded.
    pub const fn empty() -> Self {
        Self {
            magic: 0,
            check: 0,
            head: [0; HEAD_BYTES],
            recent: Ring::EMPTY,
            past: Ring::EMPTY,
            until_past: 0,
        }
    }

    /// What a record is after a reset: a recording that was interrupted becomes the fault
    /// [`FaultCause::Restart`], garbage becomes empty. To be called once, before anything else.
    pub fn recover(&mut self) {
        let Some(head) = self.head() else {
            *self = Self::empty();
            return;
        };
        if head.recording {
            let last = self.recent.iter().last();
            let tick = last.map_or(0, |sample| u64::from(sample.tick()));
            self.close(Fault {
                cause: FaultCause::Restart,
                tick,
            });
        }
    }

    /// What the record is about, if it is one.
    pub fn head(&self) -> Option<RecordHead> {
        let intact = self.magic == MAGIC && sum(&self.head) == self.check;
        let head = RecordHead::decode(&self.head).filter(|_| intact)?;
        (usize::from(head.axes) == AXES).then_some(head)
    }

    /// Whether samples are being added.
    pub fn is_recording(&self) -> bool {
        self.head().is_some_and(|head| head.recording)
    }

    /// The fault, if there is one.
    pub fn fault(&self) -> Option<Fault> {
        self.head()?.fault
    }

    /// The samples before it, in order of time: the past ones as far back as they go, then the
    /// recent ones.
    pub fn samples(&self) -> impl Iterator<Item = RecordSample<AXES>> + '_ {
        let first_recent = self.recent.iter().next().map(RawSample::tick);
        let past = self.past.iter().filter(move |sample| {
            first_recent.is_none_or(|first| first.wrapping_sub(sample.tick()) as i32 > 0)
        });
        past.chain(self.recent.iter()).map(RawSample::decoded)
    }

    /// Begins anew.
    pub fn begin(&mut self, build_id: u64, trajectory_hash: u64, period_ticks: u32) {
        self.recent = Ring::EMPTY;
        self.past = Ring::EMPTY;
        self.until_past = 0;
        self.write_head(&RecordHead {
            axes: AXES as u8,
            recording: true,
            build_id,
            trajectory_hash,
            period_ticks,
            fault: None,
        });
    }

    /// Goes on with another trajectory.
    pub fn turn_to(&mut self, trajectory_hash: u64) {
        self.change_head(|head| head.trajectory_hash = trajectory_hash);
    }

    /// Ends without a fault.
    pub fn end(&mut self) {
        self.change_head(|head| head.recording = false);
    }

    /// Ends with a fault.
    pub fn close(&mut self, fault: Fault) {
        self.change_head(|head| {
            head.recording = false;
            head.fault = Some(fault);
        });
    }

    fn change_head(&mut self, change: impl FnOnce(&mut RecordHead)) {
        if let Some(mut head) = self.head().filter(|head| head.recording) {
            change(&mut head);
            self.write_head(&head);
        }
    }

    fn write_head(&mut self, head: &RecordHead) {
        self.magic = MAGIC;
        head.encode(&mut self.head);
        self.check = sum(&self.head);
    }

    /// Adds a sample; every [`PAST_EVERY`]th is kept for the whole second.
    #[inline]
    pub(crate) fn push(&mut self, sample: &RawSample<AXES>) {
        if self.until_past == 0 {
            self.past.push(sample);
            self.until_past = PAST_EVERY;
        }
        self.until_past = self.until_past.saturating_sub(1);
        self.recent.push(sample);
    }
}

impl<const AXES: usize> Default for FaultRecord<AXES> {
    fn default() -> Self {
        Self::empty()
    }
}

/// Ticks of the drive loop between two samples.
pub(crate) fn sample_every(period_ticks: u32) -> u16 {
    let ticks = TIME_TICKS_PER_SECOND / 1_000 / period_ticks.max(1);
    ticks.clamp(1, 1_000) as u16
}

/// Check sum of a head. Each step maps different sums to different ones, so that a change of a single
/// word always shows; garbage has the magic number against it as well. A CRC would take a tick that
/// ends in a fault some 1,800 instructions.
fn sum(head: &[u8; HEAD_BYTES]) -> u32 {
    let mut sum = MAGIC;
    for &word in head.as_chunks().0 {
        sum = (sum.rotate_left(5) ^ u32::from_le_bytes(word)).wrapping_mul(0x9e37_79b1);
    }
    sum
}

fn halves(number: u64) -> [u32; 2] {
    [number as u32, (number >> 32) as u32]
}

fn whole([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

const _: () = assert!(size_of::<FaultRecord<3>>() <= 5_400);
