//! A fault's cause as three words of plain numbers, for memory that may hold anything.

use super::FaultCause;

impl FaultCause {
    /// The cause as words: kind, axis and a number of 16 bits in the first, two more numbers.
    pub const fn to_words(self) -> [u32; 3] {
        let (kind, axis, half, one, other) = match self {
            Self::EmergencyStop => (0, 0, 0, 0, 0),
            Self::ExchangeFailed => (1, 0, 0, 0, 0),
            Self::DriveFault { axis, code } => (2, axis, code, 0, 0),
            Self::DriveDisabled { axis } => (3, axis, 0, 0, 0),
            Self::FeedbackNotFinite { axis } => (4, axis, 0, 0, 0),
            Self::FeedbackStale {
                axis,
                age_ticks,
                limit_ticks,
            } => (5, axis, age_ticks, limit_ticks as u32, 0),
            Self::FollowingError {
                axis,
                error_rad,
                limit_rad,
            } => (6, axis, 0, error_rad.to_bits(), limit_rad.to_bits()),
            Self::NothingLoaded => (7, 0, 0, 0, 0),
            Self::QuickStop => (8, 0, 0, 0, 0),
            Self::CommsLost {
                silent_ticks,
                limit_ticks,
            } => (9, 0, 0, silent_ticks, limit_ticks),
            Self::LoopOverrun {
                duration_ticks,
                limit_ticks,
            } => (10, 0, 0, duration_ticks, limit_ticks),
            Self::TicksMissed { missed } => (11, 0, missed, 0, 0),
            Self::Restart => (12, 0, 0, 0, 0),
            Self::LeftStart {
                axis,
                distance_rad,
                tolerance_rad,
            } => (13, axis, 0, distance_rad.to_bits(), tolerance_rad.to_bits()),
            Self::NotEnabled {
                axis,
                waited_ticks,
                limit_ticks,
            } => (14, axis, 0, waited_ticks, limit_ticks),
        };
        let first = kind | (axis as u32) << 8 | (half as u32) << 16;
        [first, one, other]
    }

    /// The cause that [`FaultCause::to_words`] made these words of; none if there is no such kind.
    pub const fn from_words([first, one, other]: [u32; 3]) -> Option<Self> {
        let (axis, half) = ((first >> 8) as u8, (first >> 16) as u16);
        Some(match first as u8 {
            0 => Self::EmergencyStop,
            1 => Self::ExchangeFailed,
            2 => Self::DriveFault { axis, code: half },
            3 => Self::DriveDisabled { axis },
            4 => Self::FeedbackNotFinite { axis },
            5 => Self::FeedbackStale {
                axis,
                age_ticks: half,
                limit_ticks: one as u16,
            },
            6 => Self::FollowingError {
                axis,
                error_rad: f32::from_bits(one),
                limit_rad: f32::from_bits(other),
            },
            7 => Self::NothingLoaded,
            8 => Self::QuickStop,
            9 => Self::CommsLost {
                silent_ticks: one,
                limit_ticks: other,
            },
            10 => Self::LoopOverrun {
                duration_ticks: one,
                limit_ticks: other,
            },
            11 => Self::TicksMissed { missed: half },
            12 => Self::Restart,
            13 => Self::LeftStart {
                axis,
                distance_rad: f32::from_bits(one),
                tolerance_rad: f32::from_bits(other),
            },
            14 => Self::NotEnabled {
                axis,
                waited_ticks: one,
                limit_ticks: other,
            },
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_comes_back_with_its_numbers() {
        let (axis, limit_ticks) = (3, 70_000);
        let causes = [
            FaultCause::EmergencyStop,
            FaultCause::ExchangeFailed,
            FaultCause::DriveFault { axis, code: 0xfe12 },
            FaultCause::DriveDisabled { axis },
            FaultCause::FeedbackNotFinite { axis },
            FaultCause::FeedbackStale {
                axis,
                age_ticks: 40_000,
                limit_ticks: 50_000,
            },
            FaultCause::FollowingError {
                axis,
                error_rad: -0.25,
                limit_rad: 1e-3,
            },
            FaultCause::NothingLoaded,
            FaultCause::QuickStop,
            FaultCause::CommsLost {
                silent_ticks: u32::MAX,
                limit_ticks,
            },
            FaultCause::LoopOverrun {
                duration_ticks: 90_000,
                limit_ticks,
            },
            FaultCause::TicksMissed { missed: 65_535 },
            FaultCause::Restart,
            FaultCause::LeftStart {
                axis,
                distance_rad: -0.5,
                tolerance_rad: 1e-3,
            },
            FaultCause::NotEnabled {
                axis,
                waited_ticks: 70_001,
                limit_ticks,
            },
        ];
        for cause in causes {
            assert_eq!(FaultCause::from_words(cause.to_words()), Some(cause));
        }
        assert_eq!(FaultCause::from_words([causes.len() as u32, 0, 0]), None);
    }
}
