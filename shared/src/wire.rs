//! The trajectory's postcard bytes, written piece by piece from flat storage and read back
//! strictly.

use serde::{Deserialize, Serialize, Serializer};

use crate::MAX_AXES;
use crate::decode;
use crate::encode::encode;
use crate::trajectory::{
    FORMAT_VERSION, Header, MAGIC, MAX_INTERVALS, Trajectory, TrajectoryError,
};

/// What postcard sees of a trajectory.
pub(crate) struct Whole<'a>(pub(crate) &'a Trajectory);

#[derive(Serialize)]
struct WireInterval<'a> {
    duration_ticks: u32,
    points: u8,
    coefficients: &'a [f32],
}

struct Intervals<'a>(&'a Trajectory);

impl Serialize for Whole<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(trajectory) = self;
        (trajectory.header(), Intervals(trajectory)).serialize(serializer)
    }
}

impl Serialize for Intervals<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.intervals().map(|interval| WireInterval {
            duration_ticks: interval.duration_ticks,
            points: interval.points as u8,
            coefficients: interval.coefficients,
        }))
    }
}

pub(crate) fn encode_into(trajectory: &Trajectory, sink: &mut dyn FnMut(&[u8]) -> bool) -> bool {
    encode(&Whole(trajectory), sink)
}

/// Bytes not read yet.
struct Reader<'a> {
    rest: &'a [u8],
    total: usize,
}

impl<'a> Reader<'a> {
    /// Reads from the beginning, where magic and version come first and are single bytes, so that
    /// a reader of any version finds them.
    fn new(bytes: &'a [u8]) -> Result<Self, TrajectoryError> {
        let truncated = TrajectoryError::Truncated { bytes: bytes.len() };
        let (&found, versioned) = bytes.split_first_chunk().ok_or(truncated)?;
        if found != MAGIC {
            return Err(TrajectoryError::Magic { found });
        }
        match versioned.first() {
            Some(&FORMAT_VERSION) => Ok(Self {
                rest: bytes,
                total: bytes.len(),
            }),
            Some(&found) => Err(TrajectoryError::Version { found }),
            None => Err(truncated),
        }
    }

    fn take<T: Deserialize<'a>>(&mut self) -> Result<T, TrajectoryError> {
        match decode::take(self.rest) {
            Ok((value, rest)) => {
                self.rest = rest;
                Ok(value)
            }
            Err(postcard::Error::DeserializeUnexpectedEnd) => {
                Err(TrajectoryError::Truncated { bytes: self.total })
            }
            Err(_) => Err(TrajectoryError::Malformed {
                offset: self.total - self.rest.len(),
            }),
        }
    }

    fn take_floats(
        &mut self,
        count: usize,
    ) -> Result<impl ExactSizeIterator<Item = f32> + use<'a>, TrajectoryError> {
        let truncated = TrajectoryError::Truncated { bytes: self.total };
        let bytes = count.checked_mul(4).ok_or(truncated)?;
        let (floats, rest) = self.rest.split_at_checked(bytes).ok_or(truncated)?;
        self.rest = rest;
        Ok(floats
            .as_chunks()
            .0
            .iter()
            .map(|&four| f32::from_le_bytes(four)))
    }
}

pub(crate) fn header(bytes: &[u8]) -> Result<Header, TrajectoryError> {
    Reader::new(bytes)?.take()
}

/// Reads `bytes` into `trajectory`, whose content is undefined but consistent after an error.
pub(crate) fn decode(bytes: &[u8], trajectory: &mut Trajectory) -> Result<(), TrajectoryError> {
    match decode_front(bytes, trajectory)?.len() {
        0 => Ok(()),
        bytes => Err(TrajectoryError::Trailing { bytes }),
    }
}

/// The same from the front of `bytes`; returns what is left over.
pub(crate) fn decode_front<'b>(
    bytes: &'b [u8],
    trajectory: &mut Trajectory,
) -> Result<&'b [u8], TrajectoryError> {
    let mut reader = Reader::new(bytes)?;
    let header: Header = reader.take()?;
    let axes = usize::from(header.axes);
    if !(1..=MAX_AXES).contains(&axes) {
        return Err(TrajectoryError::Axes { axes });
    }
    trajectory.reset(header.id, header.axes, header.limits_hash);

    let intervals = reader.take::<u32>()? as usize;
    if intervals == 0 {
        return Err(TrajectoryError::NoIntervals);
    }
    if intervals > MAX_INTERVALS {
        return Err(TrajectoryError::TooManyIntervals { intervals });
    }
    for _ in 0..intervals {
        let duration_ticks = reader.take()?;
        let points = usize::from(reader.take::<u8>()?);
        let count = reader.take::<u32>()? as usize;
        trajectory.expect_room(duration_ticks, points, count)?;
        let values = reader.take_floats(count)?;
        trajectory.push(duration_ticks, points, values)?;
    }
    let sum_ticks = trajectory.duration_ticks();
    if header.duration_ticks != sum_ticks {
        return Err(TrajectoryError::Duration {
            header_ticks: header.duration_ticks,
            sum_ticks,
        });
    }
    let computed = trajectory.write_hash();
    if header.content_hash != computed {
        return Err(TrajectoryError::ContentHash {
            stored: header.content_hash,
            computed,
        });
    }
    Ok(reader.rest)
}
