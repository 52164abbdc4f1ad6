//! One moment of the record: as it is kept, and as it is read.

use stillpoint_shared::status::{LimitFlags, State};

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

/// A sample as it is kept.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct RawSample<const AXES: usize> {
    tick: [u16; 2],
    path_ticks: [u16; 2],
    state_and_limits: u16,
    speed_and_age: u16,
    check: u16,
    pub(super) axes: [[u16; 3]; AXES],
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
    pub(super) const EMPTY: Self = Self {
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

    pub(super) fn is_whole(&self) -> bool {
        self.check == self.sum()
    }

    pub(super) fn tick(&self) -> u32 {
        whole(self.tick)
    }

    pub(super) fn decoded(&self) -> RecordSample<AXES> {
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
pub(super) fn upper_half(value: f32) -> u16 {
    (value.to_bits().saturating_add(0x8000) >> 16) as u16
}

pub(super) fn from_upper_half(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}
