//! Time as integer ticks of 0.1 µs: exact on host and board, 429 s in a `u32`.
//!
//! Seconds in f32 would lose microseconds after a minute. A tick of 0.1 µs rounds an interval of 1
//! ms by 5e-5 at most.

/// Time ticks per second: 10 MHz.
pub const TIME_TICKS_PER_SECOND: u32 = 10_000_000;

/// Time ticks per tick of the drive loop at its usual 4 kHz.
pub const DRIVE_PERIOD_TICKS: u32 = TIME_TICKS_PER_SECOND / 4_000;

/// Seconds of a number of ticks.
pub fn seconds(ticks: u32) -> f64 {
    f64::from(ticks) / f64::from(TIME_TICKS_PER_SECOND)
}

/// Nearest number of ticks of a time in seconds; `None` if it is negative, not a number or longer
/// than 429 s.
pub fn ticks(seconds: f64) -> Option<u32> {
    let ticks = libm::round(seconds * f64::from(TIME_TICKS_PER_SECOND));
    (0.0..=f64::from(u32::MAX))
        .contains(&ticks)
        .then_some(ticks as u32)
}

/// Local coordinate on [−1, 1] of a time inside an interval, by multiplication only.
///
/// It is measured from the nearer end, so that the start gives exactly −1 and the end exactly +1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalTime {
    duration_ticks: u32,
    per_tick: f32,
}

impl LocalTime {
    /// For an interval of `duration_ticks` ≥ 1.
    pub fn new(duration_ticks: u32) -> Self {
        Self {
            duration_ticks,
            per_tick: (2.0 / f64::from(duration_ticks)) as f32,
        }
    }

    /// Whether a time after the interval's start is before its end.
    #[inline]
    pub fn contains(self, elapsed_ticks: u32) -> bool {
        elapsed_ticks < self.duration_ticks
    }

    /// Coordinate of `elapsed_ticks` after the interval's start; times beyond the end count as the
    /// end.
    #[inline]
    pub fn coordinate(self, elapsed_ticks: u32) -> f32 {
        let remaining_ticks = self.duration_ticks.saturating_sub(elapsed_ticks);
        if elapsed_ticks < remaining_ticks {
            elapsed_ticks as f32 * self.per_tick - 1.0
        } else {
            1.0 - remaining_ticks as f32 * self.per_tick
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_exact() {
        for duration_ticks in [1, 2, 3, 2_500, 84_487, 16_777_217, u32::MAX] {
            let local = LocalTime::new(duration_ticks);
            assert_eq!(local.coordinate(0), -1.0, "start of {duration_ticks}");
            assert_eq!(
                local.coordinate(duration_ticks),
                1.0,
                "end of {duration_ticks}"
            );
            assert_eq!(
                local.coordinate(u32::MAX),
                1.0,
                "after the end of {duration_ticks}"
            );
        }
        assert_eq!(LocalTime::new(84_488).coordinate(42_244), 0.0);
    }

    #[test]
    fn ticks_round_to_nearest_and_refuse_what_does_not_fit() {
        assert_eq!(ticks(0.050_692), Some(506_920));
        assert_eq!(ticks(1.49e-7), Some(1));
        assert_eq!(ticks(429.496_729_5), Some(u32::MAX));
        for bad in [-1e-3, 429.5, f64::NAN, f64::INFINITY] {
            assert_eq!(ticks(bad), None, "{bad}");
        }
        assert_eq!(seconds(DRIVE_PERIOD_TICKS), 250e-6);
    }
}
