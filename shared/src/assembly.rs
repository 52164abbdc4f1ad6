//! A trajectory put together from an outline and blocks of values that arrive in any order, some of
//! them twice.
//!
//! The outline says how many values every interval has, so that each block has its place at once
//! and nothing has to be kept beside the trajectory itself. Blocks cut the values of *all* intervals
//! into pieces of [`BLOCK_VALUES`], wherever intervals begin: any legal interval fits, 512 bytes are
//! the most in one message, and the blocks that arrived are the bits of one word.

use core::fmt;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::trajectory::{MAX_COEFFICIENTS, MAX_INTERVALS, Span};
use crate::{Trajectory, TrajectoryError};

/// Values in a block; the last one of a trajectory may have fewer.
pub const BLOCK_VALUES: usize = 128;

/// Most blocks of a trajectory.
pub const MAX_BLOCKS: usize = MAX_COEFFICIENTS.div_ceil(BLOCK_VALUES);

// A set of blocks is a `u32`.
const _: () = assert!(MAX_BLOCKS <= 32);

/// A trajectory without its values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Outline {
    /// The planner's name for the move.
    pub id: u32,
    /// Number of axes.
    pub axes: u8,
    /// Hash of the limits that the move was planned for.
    pub limits_hash: u64,
    /// Hash that the whole trajectory must have in the end.
    pub content_hash: u64,
    /// Duration and number of points of every interval.
    pub spans: Vec<Span, MAX_INTERVALS>,
}

impl Outline {
    /// The outline of a trajectory.
    pub fn of(trajectory: &Trajectory) -> Self {
        let header = trajectory.header();
        Self {
            id: header.id,
            axes: header.axes,
            limits_hash: header.limits_hash,
            content_hash: header.content_hash,
            spans: trajectory.spans().iter().copied().collect(),
        }
    }

    /// Short name of the trajectory that its blocks carry: the low half of the content hash.
    pub const fn tag(&self) -> u32 {
        self.content_hash as u32
    }
}

/// Values of a trajectory's block, interval after interval; none beyond the last block.
pub fn block(trajectory: &Trajectory, block: u8) -> &[f32] {
    let mut blocks = trajectory.coefficients().chunks(BLOCK_VALUES);
    blocks.nth(usize::from(block)).unwrap_or_default()
}

/// Which blocks have arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Arrived {
    /// [`Outline::tag`] of the trajectory; 0 if none was begun.
    pub tag: u32,
    /// Number of blocks; 0 if none was begun.
    pub blocks: u8,
    /// Bit i is set when block i has arrived.
    pub bits: u32,
}

impl Arrived {
    /// Whether block i has arrived.
    pub const fn has(&self, block: u8) -> bool {
        block < 32 && self.bits >> block & 1 == 1
    }

    /// Number of blocks still missing.
    pub const fn missing(&self) -> u32 {
        (self.blocks as u32).saturating_sub(self.bits.count_ones())
    }
}

/// Puts a trajectory together in a place that is always the same one. All bytes of a new one are
/// zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Assembly {
    content_hash: u64,
    arrived: Arrived,
}

impl Default for Assembly {
    fn default() -> Self {
        Self::NONE
    }
}

impl Assembly {
    /// Nothing is begun.
    pub const NONE: Self = Self {
        content_hash: 0,
        arrived: Arrived {
            tag: 0,
            blocks: 0,
            bits: 0,
        },
    };

    /// Begins a trajectory in `place`; what was there is gone. Beginning the same one again goes on
    /// where it was, so that a lost answer or connection costs nothing.
    ///
    /// After an error nothing is begun, and `place` is empty.
    pub fn begin(
        &mut self,
        outline: &Outline,
        place: &mut Trajectory,
    ) -> Result<(), TrajectoryError> {
        if self.is_begun(outline, place) {
            return Ok(());
        }
        *self = Self::NONE;
        if let Err(error) = place.lay_out(outline) {
            place.clear();
            return Err(error);
        }
        self.content_hash = outline.content_hash;
        self.arrived = Arrived {
            tag: outline.tag(),
            blocks: place.coefficients().len().div_ceil(BLOCK_VALUES) as u8,
            bits: 0,
        };
        Ok(())
    }

    fn is_begun(&self, outline: &Outline, place: &Trajectory) -> bool {
        let header = place.header();
        self.arrived.blocks != 0
            && self.content_hash == outline.content_hash
            && header.id == outline.id
            && header.axes == outline.axes
            && header.limits_hash == outline.limits_hash
            && place.spans() == outline.spans.as_slice()
    }

    /// Takes a block of little-endian f32 of the trajectory named `tag`. A block that has arrived
    /// before is not written again.
    pub fn take(
        &mut self,
        tag: u32,
        block: u8,
        bytes: &[u8],
        place: &mut Trajectory,
    ) -> Result<(), AssemblyError> {
        let Arrived {
            tag: expected,
            blocks,
            ..
        } = self.arrived;
        if blocks == 0 {
            return Err(AssemblyError::NothingBegun);
        }
        if tag != expected {
            return Err(AssemblyError::OtherTag { tag, expected });
        }
        let mut places = place.coefficients_mut().chunks_mut(BLOCK_VALUES);
        let Some(values) = places.nth(usize::from(block)) else {
            return Err(AssemblyError::NoSuchBlock { block, blocks });
        };
        if bytes.len() != 4 * values.len() {
            return Err(AssemblyError::BlockLength {
                block,
                found: bytes.len() as u16,
                expected: 4 * values.len() as u16,
            });
        }
        if !self.arrived.has(block) {
            for (value, &four) in values.iter_mut().zip(bytes.as_chunks().0) {
                *value = f32::from_le_bytes(four);
            }
            self.arrived.bits |= 1 << block;
        }
        Ok(())
    }

    /// Which blocks have arrived.
    pub const fn arrived(&self) -> Arrived {
        self.arrived
    }

    /// Seals the trajectory, if all of it has arrived and it has the hash that the outline
    /// promised. With another hash, all blocks have to come again.
    pub fn finish(&mut self, place: &mut Trajectory) -> Result<(), AssemblyError> {
        let arrived = self.arrived;
        if arrived.blocks == 0 {
            return Err(AssemblyError::NothingBegun);
        }
        if arrived.missing() != 0 {
            return Err(AssemblyError::Missing(arrived));
        }
        let (stored, computed) = (self.content_hash, place.write_hash());
        if stored != computed {
            self.arrived.bits = 0;
            return Err(TrajectoryError::ContentHash { stored, computed }.into());
        }
        Ok(())
    }
}

/// Why a trajectory cannot be put together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AssemblyError {
    /// The outline or the whole is no trajectory.
    Trajectory(TrajectoryError),
    /// No trajectory was begun.
    NothingBegun,
    /// The block belongs to another trajectory than the one begun.
    OtherTag {
        /// The trajectory that the block belongs to.
        tag: u32,
        /// The trajectory begun.
        expected: u32,
    },
    /// The trajectory has fewer blocks.
    NoSuchBlock {
        /// The block, from 0.
        block: u8,
        /// Number of blocks.
        blocks: u8,
    },
    /// The block has not as many bytes as its place.
    BlockLength {
        /// The block, from 0.
        block: u8,
        /// Its number of bytes.
        found: u16,
        /// Bytes of its place.
        expected: u16,
    },
    /// Blocks are missing.
    Missing(
        /// What has arrived.
        Arrived,
    ),
}

impl From<TrajectoryError> for AssemblyError {
    fn from(error: TrajectoryError) -> Self {
        Self::Trajectory(error)
    }
}

impl fmt::Display for AssemblyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Trajectory(error) => error.fmt(f),
            Self::NothingBegun => write!(f, "no upload is under way: begin one first"),
            Self::OtherTag { tag, expected } => write!(
                f,
                "the block is of trajectory {tag:08x}, the one being uploaded is {expected:08x}: begin the upload again"
            ),
            Self::NoSuchBlock { block, blocks } => write!(
                f,
                "block {block} was sent, the trajectory has blocks 0 to {}",
                blocks.saturating_sub(1)
            ),
            Self::BlockLength {
                block,
                found,
                expected,
            } => write!(
                f,
                "block {block} has {found} bytes, its place has {expected}: send whole blocks of {BLOCK_VALUES} values"
            ),
            Self::Missing(arrived) => write!(
                f,
                "{} of {} blocks are missing: send them, then commit again",
                arrived.missing(),
                arrived.blocks
            ),
        }
    }
}

impl core::error::Error for AssemblyError {}
