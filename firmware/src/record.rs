//! The last second before a fault, in memory that may outlive a reset.
//!
//! The board places a [`FaultRecord`] where start-up code leaves it alone and gives it to the
//! executor; after a reset [`FaultRecord::recover`] tells what is in it. After power-up it is
//! garbage: the head carries a magic number, a version and a CRC-64, every sample a check of its
//! own, so that one that was half written is left out. All fields are plain integers without
//! forbidden values.
//!
//! Two rings: [`RECENT`] samples a millisecond apart, which show the fault itself, and [`PAST`]
//! samples 10 ms apart, which make up the second. What a sample keeps of each axis is rounded to
//! the upper 16 bits of an f32 (3 digits). The commanded position is not kept: it follows from path
//! time and trajectory.

use serde::{Deserialize, Serialize};
use stillpoint_shared::hash;
use stillpoint_shared::status::{Fault, FaultCause, LimitFlags, State};
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

/// Samples at 1 kHz.
pub const RECENT: usize = 64;

/// Samples at 100 Hz.
pub const PAST: usize = 100;

/// Recent samples per past one.
const PAST_EVERY: u16 = 10;

/// First bytes of a record that is one; change it with every change of its layout.
const MAGIC: u32 = u32::from_le_bytes(*b"SFR\x02");

/// Enough for the postcard bytes of a [`RecordHead`] (at most 62).
const HEAD_BYTES: usize = 64;

/// One moment of the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordSample<const AXES: usize> {
    /// Tick of the drive loop, its lower 32 bits.
    pub tick: u32,
    /// Time in the trajectory, in time ticks.
    pub path_ticks: u32,
    /// State after the tick; `None` if it is none of this version's.
    pub state: Option<State>,
    /// Limits in force on any axis.
    pub limited: LimitFlags,
    /// Path speed in 256ths of the planned one; 255, too, for the planned one.
    pub path_speed: u8,
    /// Age of the oldest feedback in drive ticks, 255 or more; 255, too, if none came.
    pub age_ticks: u8,
    /// Set-point minus measured position, in rad.
    pub following_error_rad: [f32; AXES],
    /// Measured velocity in rad/s.
    pub velocity_rad_per_s: [f32; AXES],
    /// Torque set-point in N·m.
    pub torque_nm: [f32; AXES],
}

/// What a record is about.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
        // It fits: this cannot fail.
        let _ = postcard::to_slice(self, bytes);
    }

    #[inline(never)]
    fn decode(bytes: &[u8; HEAD_BYTES]) -> Option<Self> {
        Some(postcard::take_from_bytes(bytes).ok()?.0)
    }
}

/// The last second before a fault. 5.4 kB for three axes. All bytes of an empty one are zero.
#[derive(Debug)]
#[repr(C)]
pub struct FaultRecord<const AXES: usize> {
    magic: u32,
    check: [u32; 2],
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
            check: [0; 2],
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
        let intact = self.magic == MAGIC && hash::of_bytes(&self.head) == whole_check(self.check);
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
        let check = hash::of_bytes(&self.head);
        self.check = [check as u32, (check >> 32) as u32];
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

fn whole_check([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

/// The newest N samples.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Ring<const N: usize, const AXES: usize> {
    samples: [RawSample<AXES>; N],
    /// Where the next one goes: the oldest.
    next: u16,
}

impl<const N: usize, const AXES: usize> Ring<N, AXES> {
    const EMPTY: Self = Self {
        samples: [RawSample::EMPTY; N],
        next: 0,
    };

    #[inline]
    fn push(&mut self, sample: &RawSample<AXES>) {
        let place = usize::from(self.next);
        // After a reset `next` may be anything.
        let place = if place < N { place } else { 0 };
        if let Some(oldest) = self.samples.get_mut(place) {
            *oldest = *sample;
        }
        self.next = (if place + 1 < N { place + 1 } else { 0 }) as u16;
    }

    /// Whole samples, oldest first.
    fn iter(&self) -> impl Iterator<Item = &RawSample<AXES>> {
        let (newer, older) = self
            .samples
            .split_at_checked(usize::from(self.next))
            .unwrap_or((&[], &self.samples));
        older.iter().chain(newer).filter(|sample| sample.is_whole())
    }
}

/// A sample as it is kept.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct RawSample<const AXES: usize> {
    tick: [u16; 2],
    path_ticks: [u16; 2],
    state_and_limits: u16,
    speed_and_age: u16,
    check: u16,
    axes: [[u16; 3]; AXES],
}

/// What goes into a sample beside the axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) tick: u32,
    pub(crate) path_ticks: u32,
    pub(crate) state: State,
    pub(crate) limited: LimitFlags,
    pub(crate) path_speed: u8,
    pub(crate) age_ticks: u8,
}

impl<const AXES: usize> RawSample<AXES> {
    const EMPTY: Self = Self {
        tick: [0; 2],
        path_ticks: [0; 2],
        state_and_limits: 0,
        speed_and_age: 0,
        check: 0,
        axes: [[0; 3]; AXES],
    };

    /// A sample of following error, velocity and torque per axis.
    #[inline]
    pub(crate) fn new(moment: &Moment, axes: impl Iterator<Item = [f32; 3]>) -> Self {
        let mut sample = Self {
            tick: halves(moment.tick),
            path_ticks: halves(moment.path_ticks),
            state_and_limits: u16::from_be_bytes([moment.state as u8, moment.limited.bits()]),
            speed_and_age: u16::from_be_bytes([moment.path_speed, moment.age_ticks]),
            check: 0,
            axes: [[0; 3]; AXES],
        };
        for (kept, values) in sample.axes.iter_mut().zip(axes) {
            *kept = values.map(upper_half);
        }
        sample.check = sample.sum();
        sample
    }

    /// Over all words, not zero for zeros.
    #[inline]
    fn sum(&self) -> u16 {
        let words = [
            self.tick[0],
            self.tick[1],
            self.path_ticks[0],
            self.path_ticks[1],
            self.state_and_limits,
            self.speed_and_age,
        ];
        let words = words.iter().chain(self.axes.as_flattened());
        words.fold(0x5350, |sum: u16, word| sum.rotate_left(3) ^ word)
    }

    fn is_whole(&self) -> bool {
        self.check == self.sum()
    }

    fn tick(&self) -> u32 {
        whole(self.tick)
    }

    fn decoded(&self) -> RecordSample<AXES> {
        let [state, limited] = self.state_and_limits.to_be_bytes();
        let [path_speed, age_ticks] = self.speed_and_age.to_be_bytes();
        RecordSample {
            tick: self.tick(),
            path_ticks: whole(self.path_ticks),
            state: State::ALL.get(usize::from(state)).copied(),
            limited: LimitFlags::from_bits(limited),
            path_speed,
            age_ticks,
            following_error_rad: self.axes.map(|[error, _, _]| from_upper_half(error)),
            velocity_rad_per_s: self.axes.map(|[_, velocity, _]| from_upper_half(velocity)),
            torque_nm: self.axes.map(|[_, _, torque]| from_upper_half(torque)),
        }
    }
}

fn halves(word: u32) -> [u16; 2] {
    [word as u16, (word >> 16) as u16]
}

fn whole([low, high]: [u16; 2]) -> u32 {
    u32::from(high) << 16 | u32::from(low)
}

/// The nearest value whose f32 ends in 16 zero bits, as its upper half. Infinite and no number stay
/// what they are, and the very largest becomes infinite.
#[inline]
fn upper_half(value: f32) -> u16 {
    (value.to_bits().saturating_add(0x8000) >> 16) as u16
}

fn from_upper_half(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

const _: () = assert!(size_of::<FaultRecord<3>>() <= 5_400);

#[cfg(test)]
mod tests {
    use super::*;

    const MOMENT: Moment = Moment {
        tick: 0,
        path_ticks: 70_000,
        state: State::Running,
        limited: LimitFlags::SPEED,
        path_speed: 255,
        age_ticks: 1,
    };

    fn filled() -> FaultRecord<2> {
        let mut record = FaultRecord::empty();
        record.begin(1, 2, 2_500);
        for tick in 0..2_000 {
            let moment = Moment { tick, ..MOMENT };
            let axis = [0.001_234, -31.4, 139.9];
            record.push(&RawSample::new(&moment, [axis, axis].into_iter()));
        }
        record.close(Fault {
            cause: FaultCause::EmergencyStop,
            tick: 2_000,
        });
        record
    }

    #[test]
    fn values_keep_three_digits() {
        let record = filled();
        let last = record.samples().last().unwrap();
        assert_eq!((last.tick, last.path_ticks), (1_999, 70_000));
        assert_eq!(
            (last.state, last.limited),
            (Some(State::Running), LimitFlags::SPEED)
        );
        for (kept, value) in [
            (last.following_error_rad, 0.001_234),
            (last.velocity_rad_per_s, -31.4),
            (last.torque_nm, 139.9),
        ] {
            assert!((kept[0] / value - 1.0f32).abs() <= 1.0 / 256.0, "{kept:?}");
        }
        for value in [f32::INFINITY, f32::NEG_INFINITY, 0.0, -2.0] {
            assert_eq!(from_upper_half(upper_half(value)), value);
        }
        assert!(from_upper_half(upper_half(f32::NAN)).is_nan());
    }

    #[test]
    fn any_change_of_the_head_makes_the_record_empty() {
        for byte in 0..HEAD_BYTES {
            let mut record = filled();
            record.head[byte] ^= 0x41;
            assert_eq!(record.head(), None, "{byte}");
        }
        let spoils: [fn(&mut FaultRecord<2>); 3] = [
            |record| record.magic ^= 1,
            |record| record.check[0] ^= 1,
            |record| record.check[1] ^= 1 << 31,
        ];
        for spoil in spoils {
            let mut record = filled();
            spoil(&mut record);
            record.recover();
            assert_eq!((record.head(), record.samples().count()), (None, 0));
        }
    }

    #[test]
    fn samples_half_written_are_left_out_and_a_wrong_place_does_no_harm() {
        let mut record = filled();
        let whole = record.samples().count();
        record.recent.samples[3].axes[1][2] ^= 0x10;
        assert_eq!(record.samples().count(), whole - 1);
        record.recent.next = 60_000;
        record.past.next = u16::MAX;
        record.until_past = 0;
        record.recover();
        assert_eq!(record.recent.iter().count(), RECENT - 1);
        let sample = RawSample::new(&MOMENT, [[0.0; 3]; 2].into_iter());
        record.push(&sample);
        assert_eq!((record.recent.next, record.past.next), (1, 1));
    }
}
