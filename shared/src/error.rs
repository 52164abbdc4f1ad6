//! Why bytes are no trajectory, or numbers cannot become one.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::basis::MAX_POINTS;
use crate::trajectory::{FORMAT_VERSION, MAX_BASES, MAX_COEFFICIENTS, MAX_INTERVALS};
use crate::{MAX_AXES, ordinal};

/// Why bytes are no trajectory, or numbers cannot become one. Its `Display` says what to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TrajectoryError {
    /// The bytes do not begin with [`MAGIC`](crate::trajectory::MAGIC).
    Magic {
        /// The first four bytes.
        found: [u8; 4],
    },
    /// The encoding is of another version than [`FORMAT_VERSION`].
    Version {
        /// The version found.
        found: u8,
    },
    /// The bytes end too early.
    Truncated {
        /// Number of bytes given.
        bytes: usize,
    },
    /// A number is longer than its type.
    Malformed {
        /// Offset of the value in the bytes.
        offset: usize,
    },
    /// Bytes are left over after the last interval.
    Trailing {
        /// Number of bytes left over.
        bytes: usize,
    },
    /// The content differs from what was sealed.
    ContentHash {
        /// Hash in the header.
        stored: u64,
        /// Hash of the content.
        computed: u64,
    },
    /// No axes, or more than [`MAX_AXES`].
    Axes {
        /// Number of axes.
        axes: usize,
    },
    /// The trajectory has another number of axes than its player.
    OtherAxes {
        /// Axes of the trajectory.
        found: usize,
        /// Axes of the player.
        expected: usize,
    },
    /// There are no intervals.
    NoIntervals,
    /// More than [`MAX_INTERVALS`].
    TooManyIntervals {
        /// Number of intervals.
        intervals: usize,
    },
    /// An interval has fewer than 2 or more than [`MAX_POINTS`] points.
    Points {
        /// Interval, from 0.
        interval: usize,
        /// Its number of points.
        points: usize,
    },
    /// More than [`MAX_BASES`] different numbers of points.
    TooManyBases {
        /// First interval that is one too many, from 0.
        interval: usize,
    },
    /// An interval lasts no time.
    NoDuration {
        /// Interval, from 0.
        interval: usize,
    },
    /// The move lasts longer than 429 s.
    TooLong {
        /// First interval that ends too late, from 0.
        interval: usize,
    },
    /// The intervals' durations do not add up to the header's.
    Duration {
        /// Ticks in the header.
        header_ticks: u32,
        /// Sum over the intervals.
        sum_ticks: u32,
    },
    /// An interval has not as many coefficients as its points and axes ask for.
    Coefficients {
        /// Interval, from 0.
        interval: usize,
        /// Number of coefficients found.
        found: usize,
        /// (points + 1) × 3 × axes.
        expected: usize,
    },
    /// More than [`MAX_COEFFICIENTS`].
    TooManyCoefficients {
        /// First interval that does not fit, from 0.
        interval: usize,
        /// Coefficients up to and with this interval.
        needed: usize,
    },
    /// A value is no finite f32.
    NotFinite {
        /// Interval, from 0.
        interval: usize,
        /// Index among the interval's values.
        index: usize,
        /// The value.
        value: f64,
    },
    /// The buffer to encode into is too small.
    BufferTooSmall {
        /// Its size in bytes.
        available: usize,
    },
}

impl fmt::Display for TrajectoryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Magic { found } => {
                write!(
                    f,
                    "these bytes are no trajectory (they begin with {found:02x?}): give a file written by `stillpoint plan`"
                )
            }
            Self::Version { found } => write!(
                f,
                "the trajectory has format version {found}, this side reads version {FORMAT_VERSION}: \
                 plan the move again or update the older side"
            ),
            Self::Truncated { bytes } => write!(
                f,
                "the trajectory ends too early, after {bytes} bytes: copy or send it again"
            ),
            Self::Malformed { offset } => write!(
                f,
                "the number at byte {offset} is malformed: copy or send the trajectory again"
            ),
            Self::Trailing { bytes } => write!(
                f,
                "{bytes} bytes are left over after the trajectory: copy or send it again"
            ),
            Self::ContentHash { stored, computed } => write!(
                f,
                "the content hashes to {computed:016x}, its header says {stored:016x}: the trajectory is damaged, copy or send it again"
            ),
            Self::Axes { axes } => write!(
                f,
                "the trajectory has {axes} axes: 1 to {MAX_AXES} are possible"
            ),
            Self::OtherAxes { found, expected } => {
                write!(
                    f,
                    "the trajectory has {found} axes, this player {expected}: plan the move for this machine"
                )
            }
            Self::NoIntervals => write!(f, "the trajectory has no intervals: add one at least"),
            Self::TooManyIntervals { intervals } => {
                write!(
                    f,
                    "the trajectory has {intervals} intervals, {MAX_INTERVALS} fit: plan on a coarser mesh"
                )
            }
            Self::Points { interval, points } => {
                write!(
                    f,
                    "interval {interval} has {points} points: use 2 to {MAX_POINTS}",
                    interval = ordinal(interval)
                )
            }
            Self::TooManyBases { interval } => write!(
                f,
                "interval {interval} brings in one more number of points than the {MAX_BASES} different ones that fit: \
                 use fewer different ones",
                interval = ordinal(interval)
            ),
            Self::NoDuration { interval } => write!(
                f,
                "interval {interval} lasts no time: give it 0.1 µs at least",
                interval = ordinal(interval)
            ),
            Self::TooLong { interval } => {
                write!(
                    f,
                    "the move passes 429 s in interval {interval}: split it",
                    interval = ordinal(interval)
                )
            }
            Self::Duration {
                header_ticks,
                sum_ticks,
            } => write!(
                f,
                "the header says {header_ticks} ticks, the intervals add up to {sum_ticks}: the trajectory is damaged, copy or send it again"
            ),
            Self::Coefficients {
                interval,
                found,
                expected,
            } => {
                write!(
                    f,
                    "interval {interval} has {found} coefficients, its points and axes ask for {expected}",
                    interval = ordinal(interval)
                )
            }
            Self::TooManyCoefficients { interval, needed } => write!(
                f,
                "{needed} coefficients are reached in interval {interval}, {MAX_COEFFICIENTS} fit: plan on a coarser mesh",
                interval = ordinal(interval)
            ),
            Self::NotFinite {
                interval,
                index,
                value,
            } => {
                write!(
                    f,
                    "value {index} of interval {interval} is {value}, which is no finite 32-bit number",
                    interval = ordinal(interval)
                )
            }
            Self::BufferTooSmall { available } => {
                write!(
                    f,
                    "the trajectory does not fit into {available} bytes: give MAX_ENCODED_BYTES"
                )
            }
        }
    }
}

impl core::error::Error for TrajectoryError {}
