//! The clock of the path: time in the trajectory, advancing at a path speed σ between 0 and 1.
//!
//! Integers throughout, so that nothing drifts: σ is a multiple of 2⁻³⁰, path time one of 2⁻³¹ time
//! ticks. A tick of the drive loop advances it by the mean of σ at its two ends times the period
//! (the trapezoid: velocity set-points are the derivative of the position set-points to second
//! order in the period); at σ = 1 that is the period, exactly. The trajectory is evaluated at whole
//! time ticks, rounded down: 0.1 µs, or 3 µrad at 30 rad/s.

/// Path speed 1, the planned speed.
pub const FULL_SPEED: u32 = 1 << 30;

/// Path time per time tick: a period times the sum of two path speeds, halved.
const FINE_BITS: u32 = 31;

/// Path speed as a number in [0, 1]; exact at both ends.
#[inline]
pub fn speed_ratio(speed: u32) -> f32 {
    speed as f32 * (1.0 / FULL_SPEED as f32)
}

/// Path speed of an override in per cent; 100 is [`FULL_SPEED`] exactly.
#[inline]
pub fn speed_of_percent(percent: u8) -> u32 {
    match percent {
        0..=99 => FULL_SPEED / 100 * u32::from(percent),
        _ => FULL_SPEED,
    }
}

/// Time in the trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathTime {
    fine: u64,
}

impl PathTime {
    /// The start of the move.
    pub const START: Self = Self { fine: 0 };

    /// Whole time ticks since the start of the move.
    #[inline]
    pub fn ticks(self) -> u32 {
        (self.fine >> FINE_BITS) as u32
    }

    /// Advances by one period during which the path speed goes `from` one value `to` another, not
    /// beyond `end_ticks`.
    #[inline]
    pub fn advance(&mut self, from: u32, to: u32, period_ticks: u32, end_ticks: u32) {
        let step = u64::from(from.saturating_add(to)) * u64::from(period_ticks);
        let end = u64::from(end_ticks) << FINE_BITS;
        let next = self.fine.saturating_add(step);
        self.fine = if next < end { next } else { end };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_speed_is_the_period_and_no_speed_stands() {
        let mut time = PathTime::START;
        for tick in 1..=10_000 {
            time.advance(FULL_SPEED, FULL_SPEED, 2_500, u32::MAX);
            assert_eq!(time.ticks(), 2_500 * tick);
        }
        let before = time;
        time.advance(0, 0, 2_500, u32::MAX);
        assert_eq!(time, before);
        time.advance(FULL_SPEED, FULL_SPEED, u32::MAX, u32::MAX);
        assert_eq!(time.ticks(), u32::MAX);
    }

    #[test]
    fn no_speed_drifts() {
        // A third of full speed is no multiple of 2⁻³⁰, a hundred million ticks later it is off by
        // the rounding of the speed and by nothing else.
        let speed = FULL_SPEED / 3;
        let mut time = PathTime::START;
        for _ in 0..3_000_000 {
            time.advance(speed, speed, 250, u32::MAX);
        }
        let exact = u128::from(speed) * 3_000_000 * 250 / u128::from(FULL_SPEED);
        assert_eq!(u128::from(time.ticks()), exact);
    }

    #[test]
    fn the_end_is_exact_at_any_speed() {
        for speed in [1 << 20, FULL_SPEED / 7, FULL_SPEED] {
            let mut time = PathTime::START;
            let end_ticks = 1_234_567;
            for _ in 0..600_000 {
                time.advance(speed, speed, 2_500, end_ticks);
            }
            assert_eq!(time.ticks(), end_ticks, "{speed}");
        }
        assert_eq!(speed_ratio(speed_of_percent(100)), 1.0);
        assert_eq!(speed_of_percent(0), 0);
        assert!((speed_ratio(speed_of_percent(30)) - 0.3).abs() < 1e-6);
    }
}
