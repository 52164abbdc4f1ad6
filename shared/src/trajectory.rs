//! A planned move: per interval, the values of every axis' position, velocity and torque at the LGR
//! points and at the end.
//!
//! Rows are node-major. The row of a node holds the positions (rad) of all axes, then their
//! velocities (rad/s), then their torques (N·m): value q of axis a of node j is `coefficients[(j *
//! 3 + q) * axes + a]`, q = 0, 1, 2. An interval of N points has N + 1 rows. Consecutive intervals
//! repeat the shared node.
//!
//! A `Trajectory` is always consistent (counts, durations, hash); whether a machine may run it is
//! the board's question, asked when it is loaded. Its bytes are described in the `encode` method.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::assembly::Outline;
use crate::basis::MAX_POINTS;
use crate::{Limits, MAX_AXES, encode, hash, wire};

pub use crate::error::TrajectoryError;

/// First bytes of every trajectory.
pub const MAGIC: [u8; 4] = *b"SPT\x1a";

/// Version of the encoding; a reader refuses any other. Change it with every change of [`Header`]
/// or of the row layout.
pub const FORMAT_VERSION: u8 = 1;

/// Quantities per axis and node: position, velocity, torque.
pub const QUANTITIES: usize = 3;

/// Most intervals of a trajectory.
pub const MAX_INTERVALS: usize = 64;

/// Most coefficients of a trajectory, over all intervals: 12 KiB; for three axes 31 intervals of ten
/// points.
pub const MAX_COEFFICIENTS: usize = 3072;

/// Most different numbers of points among the intervals of one trajectory; each needs a prepared
/// basis on the board.
pub const MAX_BASES: usize = 8;

/// Enough bytes for any encoded trajectory.
pub const MAX_ENCODED_BYTES: usize = 4 * MAX_COEFFICIENTS + 8 * MAX_INTERVALS + 48;

// Two trajectories and the bases of one have to fit beside everything else into 48 kB of RAM.
const _: () = assert!(size_of::<Trajectory>() <= 13_000);

/// What a trajectory says about itself before its intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Header {
    /// [`MAGIC`].
    pub magic: [u8; 4],
    /// [`FORMAT_VERSION`].
    pub version: u8,
    /// The planner's name for the move.
    pub id: u32,
    /// Number of axes, 1 to [`MAX_AXES`].
    pub axes: u8,
    /// Duration of the whole move in ticks of 0.1 µs: the sum over the intervals.
    pub duration_ticks: u32,
    /// [`Limits::hash`](crate::Limits::hash) of the limits the move was planned for.
    pub limits_hash: u64,
    /// CRC-64/XZ over the postcard bytes of the whole trajectory with this field zero.
    pub content_hash: u64,
}

impl Header {
    const fn new(id: u32, axes: u8, limits_hash: u64) -> Self {
        Self {
            magic: MAGIC,
            version: FORMAT_VERSION,
            id,
            axes,
            duration_ticks: 0,
            limits_hash,
            content_hash: 0,
        }
    }
}

impl Header {
    /// The header at the beginning of an encoded trajectory, of which nothing else is read.
    pub fn of(bytes: &[u8]) -> Result<Self, TrajectoryError> {
        wire::header(bytes)
    }
}

/// Number of values in an interval of N `points`: (N + 1) × 3 × axes.
pub const fn coefficient_count(points: usize, axes: usize) -> usize {
    (points + 1) * QUANTITIES * axes
}

/// Size of one interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Span {
    /// Duration in ticks of 0.1 µs.
    pub duration_ticks: u32,
    /// Number N of LGR points.
    pub points: u8,
}

/// A planned move of fixed capacity. Made by [`TrajectoryBuilder`] or [`Trajectory::decode`].
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    header: Header,
    spans: Vec<Span, MAX_INTERVALS>,
    coefficients: Vec<f32, MAX_COEFFICIENTS>,
}

/// One interval of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Interval<'a> {
    /// Start in ticks after the start of the move.
    pub start_ticks: u32,
    /// Duration in ticks, at least 1.
    pub duration_ticks: u32,
    /// Number N of LGR points.
    pub points: usize,
    /// (N + 1) × 3 × axes values, node-major.
    pub coefficients: &'a [f32],
}

impl Trajectory {
    /// A trajectory without intervals, as a place to load one into. It cannot be encoded into
    /// anything `decode` accepts. All its bytes are zero, so that a static one takes no flash.
    pub const fn empty() -> Self {
        Self {
            header: Header {
                magic: [0; 4],
                version: 0,
                id: 0,
                axes: 0,
                duration_ticks: 0,
                limits_hash: 0,
                content_hash: 0,
            },
            spans: Vec::new(),
            coefficients: Vec::new(),
        }
    }

    /// The header.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        usize::from(self.header.axes)
    }

    /// Duration of the whole move in ticks of 0.1 µs.
    pub fn duration_ticks(&self) -> u32 {
        self.header.duration_ticks
    }

    /// The intervals in order of time.
    pub fn intervals(&self) -> impl ExactSizeIterator<Item = Interval<'_>> {
        let axes = self.axes();
        let mut start_ticks = 0u32;
        let mut rest = self.coefficients.as_slice();
        self.spans.iter().map(move |span| {
            let points = usize::from(span.points);
            let count = coefficient_count(points, axes).min(rest.len());
            let (coefficients, after) = rest.split_at_checked(count).unwrap_or_default();
            rest = after;
            let interval = Interval {
                start_ticks,
                duration_ticks: span.duration_ticks,
                points,
                coefficients,
            };
            start_ticks = start_ticks.saturating_add(span.duration_ticks);
            interval
        })
    }

    /// All coefficients, interval after interval.
    pub fn coefficients(&self) -> &[f32] {
        &self.coefficients
    }

    /// Writes the postcard bytes into `buffer` and returns the part used; [`MAX_ENCODED_BYTES`] are
    /// enough.
    ///
    /// The bytes are those of `{ header: Header, intervals: [{ duration_ticks: u32, points: u8,
    /// coefficients: [f32] }] }` with both lists length-prefixed, as any postcard reader sees them.
    pub fn encode<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b mut [u8], TrajectoryError> {
        let available = buffer.len();
        encode::to_slice(&wire::Whole(self), buffer)
            .ok_or(TrajectoryError::BufferTooSmall { available })
    }

    /// Hands the bytes of [`Trajectory::encode`] to `sink` piece by piece, for a board that has no
    /// buffer for all of them. Returns false when the sink has returned false.
    pub fn encode_into(&self, sink: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        wire::encode_into(self, sink)
    }

    /// Number of bytes of [`Trajectory::encode`].
    pub fn encoded_bytes(&self) -> usize {
        let mut bytes = 0;
        self.encode_into(&mut |piece| {
            bytes += piece.len();
            true
        });
        bytes
    }

    /// Reads a trajectory, strictly: every count and hash must agree and no byte may be left over.
    pub fn decode(bytes: &[u8]) -> Result<Self, TrajectoryError> {
        let mut trajectory = Self::empty();
        trajectory.decode_from(bytes)?;
        Ok(trajectory)
    }

    /// [`Trajectory::decode`] from the front of `bytes`, for files in which more follows; returns
    /// that, too.
    pub fn decode_front(bytes: &[u8]) -> Result<(Self, &[u8]), TrajectoryError> {
        let mut trajectory = Self::empty();
        let rest = wire::decode_front(bytes, &mut trajectory)?;
        Ok((trajectory, rest))
    }

    /// [`Trajectory::decode`] in place, for a board that cannot spare the stack. After an error
    /// `self` is empty.
    pub fn decode_from(&mut self, bytes: &[u8]) -> Result<(), TrajectoryError> {
        let result = wire::decode(bytes, self);
        if result.is_err() {
            self.clear();
        }
        result
    }

    /// Takes everything out: [`Trajectory::empty`] in place.
    pub fn clear(&mut self) {
        self.reset(0, 0, 0);
        self.header.magic = [0; 4];
        self.header.version = 0;
    }

    /// Makes `self` equal to `other` in place.
    pub fn copy_from(&mut self, other: &Self) {
        self.header = other.header;
        self.spans.clear();
        self.coefficients.clear();
        // Equal capacities: these cannot fail.
        let _ = self.spans.extend_from_slice(&other.spans);
        let _ = self.coefficients.extend_from_slice(&other.coefficients);
    }

    pub(crate) fn spans(&self) -> &[Span] {
        &self.spans
    }

    pub(crate) fn coefficients_mut(&mut self) -> &mut [f32] {
        &mut self.coefficients
    }

    /// Makes room for the trajectory that `outline` describes, with all values zero and no hash.
    pub(crate) fn lay_out(&mut self, outline: &Outline) -> Result<(), TrajectoryError> {
        let axes = usize::from(outline.axes);
        if !(1..=MAX_AXES).contains(&axes) {
            return Err(TrajectoryError::Axes { axes });
        }
        if outline.spans.is_empty() {
            return Err(TrajectoryError::NoIntervals);
        }
        self.reset(outline.id, outline.axes, outline.limits_hash);
        for span in &outline.spans {
            let points = usize::from(span.points);
            let count = coefficient_count(points, axes);
            self.push(span.duration_ticks, points, (0..count).map(|_| 0.0))?;
        }
        Ok(())
    }

    pub(crate) fn reset(&mut self, id: u32, axes: u8, limits_hash: u64) {
        self.header = Header::new(id, axes, limits_hash);
        self.spans.clear();
        self.coefficients.clear();
    }

    /// Whether an interval of `count` values fits as the next one, and the total duration in ticks
    /// then.
    pub(crate) fn expect_room(
        &self,
        duration_ticks: u32,
        points: usize,
        count: usize,
    ) -> Result<u32, TrajectoryError> {
        let interval = self.spans.len();
        if self.spans.is_full() {
            return Err(TrajectoryError::TooManyIntervals {
                intervals: interval + 1,
            });
        }
        if !(2..=MAX_POINTS).contains(&points) {
            return Err(TrajectoryError::Points { interval, points });
        }
        if self.distinct_points_with(points) > MAX_BASES {
            return Err(TrajectoryError::TooManyBases { interval });
        }
        let expected = coefficient_count(points, self.axes());
        if count != expected {
            return Err(TrajectoryError::Coefficients {
                interval,
                found: count,
                expected,
            });
        }
        let needed = self.coefficients.len() + count;
        if needed > MAX_COEFFICIENTS {
            return Err(TrajectoryError::TooManyCoefficients { interval, needed });
        }
        if duration_ticks == 0 {
            return Err(TrajectoryError::NoDuration { interval });
        }
        self.header
            .duration_ticks
            .checked_add(duration_ticks)
            .ok_or(TrajectoryError::TooLong { interval })
    }

    /// Appends an interval; nothing is changed if it does not fit.
    pub(crate) fn push(
        &mut self,
        duration_ticks: u32,
        points: usize,
        values: impl ExactSizeIterator<Item = f32>,
    ) -> Result<(), TrajectoryError> {
        self.header.duration_ticks = self.expect_room(duration_ticks, points, values.len())?;
        self.header.content_hash = 0;
        // There is room: these cannot fail.
        let _ = self.spans.push(Span {
            duration_ticks,
            points: points as u8,
        });
        for value in values {
            let _ = self.coefficients.push(value);
        }
        Ok(())
    }

    /// Computes the content hash, writes it into the header and returns it.
    pub(crate) fn write_hash(&mut self) -> u64 {
        self.header.content_hash = 0;
        self.header.content_hash = hash::of(&wire::Whole(self));
        self.header.content_hash
    }

    fn distinct_points_with(&self, points: usize) -> usize {
        let seen = self
            .spans
            .iter()
            .fold(1u64 << points, |seen, span| seen | 1 << span.points);
        seen.count_ones() as usize
    }
}

/// Puts a trajectory together on the host, interval by interval, from f64.
#[derive(Debug, Clone)]
pub struct TrajectoryBuilder {
    trajectory: Trajectory,
}

impl TrajectoryBuilder {
    /// A move named `id` planned for `limits`, which also say how many axes it has.
    pub fn new(id: u32, limits: &Limits) -> Self {
        let mut trajectory = Trajectory::empty();
        trajectory.reset(id, limits.axes().len() as u8, limits.hash());
        Self { trajectory }
    }

    /// Appends an interval of N = `points` LGR points: (N + 1) × 3 × axes `values`, node-major,
    /// rounded to f32 here.
    ///
    /// After an error the builder is as it was.
    pub fn interval(
        &mut self,
        duration_ticks: u32,
        points: usize,
        values: &[f64],
    ) -> Result<&mut Self, TrajectoryError> {
        let interval = self.trajectory.spans.len();
        if let Some((index, &value)) = values
            .iter()
            .enumerate()
            .find(|(_, value)| !(**value as f32).is_finite())
        {
            return Err(TrajectoryError::NotFinite {
                interval,
                index,
                value,
            });
        }
        self.trajectory.push(
            duration_ticks,
            points,
            values.iter().map(|&value| value as f32),
        )?;
        Ok(self)
    }

    /// Seals the trajectory with its content hash. It has one interval at least.
    pub fn finish(mut self) -> Result<Trajectory, TrajectoryError> {
        if self.trajectory.spans.is_empty() {
            return Err(TrajectoryError::NoIntervals);
        }
        self.trajectory.write_hash();
        Ok(self.trajectory)
    }
}
