//! The .spt file: a trajectory as the board gets it, and behind it a section for people and checkers.
//!
//! | bytes | what |
//! |---|---|
//! | as many as it has | the trajectory, as [`Trajectory::encode`] writes it; the board is sent this alone |
//! | 4 | `SPC` 0x1a |
//! | 1 | version of the section, 3 |
//! | 4 | length of the body, little-endian |
//! | that many | the body in postcard: [`Coordinates`], [`Certificate`], then a list of [`Remark`] |
//! | 4 | CRC-32/ISO-HDLC of all bytes of the section before, little-endian |
//!
//! The section may be missing, as in files of earlier versions; a damaged one does not keep the trajectory from being used.

use crate::certify::{Certificate, Coordinates};
use serde::{Deserialize, Serialize};
use stillpoint_shared::crc::Crc32;
use stillpoint_shared::trajectory::MAX_ENCODED_BYTES;
use stillpoint_shared::{Trajectory, TrajectoryError};

/// First bytes of a section.
pub const SECTION_MAGIC: [u8; 4] = *b"SPC\x1a";

/// Version of the section's layout and of what is in it.
pub const SECTION_VERSION: u8 = 3;

/// Enough bytes for the body of any section.
const MAX_BODY_BYTES: usize = 1 << 17;

/// Bytes of a section before its body.
const HEAD_BYTES: usize = 9;

/// Enough bytes for any file.
pub const MAX_FILE_BYTES: usize = MAX_ENCODED_BYTES + HEAD_BYTES + MAX_BODY_BYTES + 4;

/// What follows a trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// The machine's coordinates.
    pub coordinates: Coordinates,
    /// What was proved when the file was written.
    pub certificate: Certificate,
    /// What the planner found out that cannot be told from the file any more: its figures for people, which nothing proves anew.
    pub remarks: Vec<Remark>,
}

/// A remark of the planner on its answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Remark {
    /// What it is about.
    pub topic: String,
    /// One or more sentences.
    pub text: String,
    /// Whether it gives cause for doubt.
    pub doubtful: bool,
}

/// A file that was read.
#[derive(Clone, Debug)]
pub struct SptFile {
    /// The trajectory, whole and checked.
    pub trajectory: Trajectory,
    /// What follows it.
    pub section: Result<Section, SectionError>,
    /// Number of bytes of it.
    pub section_bytes: usize,
}

/// Why there is no section to be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionError {
    /// The file ends with the trajectory.
    #[error("the file has no certificate: plan the move again with this version to get one")]
    Missing,
    /// What follows the trajectory is something else.
    #[error(
        "what follows the trajectory is no certificate (it begins with {found:02x?}): copy the file again, or plan the move again"
    )]
    Magic {
        /// The first four bytes; less are filled up with zeros.
        found: [u8; 4],
    },
    /// The section is of another version.
    #[error(
        "the certificate has version {found}, this program reads version {SECTION_VERSION}: plan the move again, or update the older side"
    )]
    Version {
        /// The version found.
        found: u8,
    },
    /// The section is longer or shorter than it says.
    #[error(
        "the certificate has {found} bytes, it should have {expected}: it is damaged, copy the file again"
    )]
    Length {
        /// Number of bytes there.
        found: usize,
        /// Number of bytes there should be.
        expected: usize,
    },
    /// The check sum is wrong.
    #[error(
        "the certificate's check sum is {computed:08x}, it should be {stored:08x}: it is damaged, copy the file again"
    )]
    CheckSum {
        /// Check sum in the file.
        stored: u32,
        /// Check sum of the bytes.
        computed: u32,
    },
    /// The bytes are as they were written, but mean nothing.
    #[error("the certificate cannot be read though its check sum is right: plan the move again")]
    Malformed,
}

impl SptFile {
    /// Reads a file's bytes.
    ///
    /// # Errors
    /// [`TrajectoryError`] when there is no trajectory; a bad section is no error here.
    pub fn decode(bytes: &[u8]) -> Result<Self, TrajectoryError> {
        let (trajectory, rest) = Trajectory::decode_front(bytes)?;
        Ok(Self {
            trajectory,
            section: Section::decode(rest),
            section_bytes: rest.len(),
        })
    }
}

impl Section {
    /// The bytes that follow a trajectory.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = [&SECTION_MAGIC[..], &[SECTION_VERSION], &[0; 4]].concat();
        // Nothing here has an unknown length, so that this cannot fail.
        bytes = postcard::to_extend(self, bytes).unwrap_or_default();
        let length = (bytes.len().saturating_sub(HEAD_BYTES)) as u32;
        if let Some(place) = bytes.get_mut(5..HEAD_BYTES) {
            place.copy_from_slice(&length.to_le_bytes());
        }
        let sum = Crc32::of(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes
    }

    fn decode(bytes: &[u8]) -> Result<Self, SectionError> {
        if bytes.is_empty() {
            return Err(SectionError::Missing);
        }
        let found: [u8; 4] = std::array::from_fn(|i| bytes.get(i).copied().unwrap_or(0));
        if found != SECTION_MAGIC {
            return Err(SectionError::Magic { found });
        }
        let found = bytes.len();
        let too_short = |expected| SectionError::Length { found, expected };
        let (&[.., version, a, b, c, d], rest) = bytes
            .split_first_chunk::<HEAD_BYTES>()
            .ok_or(too_short(HEAD_BYTES + 4))?;
        if version != SECTION_VERSION {
            return Err(SectionError::Version { found: version });
        }
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        let expected = HEAD_BYTES.saturating_add(length).saturating_add(4);
        if found != expected {
            return Err(too_short(expected));
        }
        let (body, sum) = rest.split_last_chunk::<4>().ok_or(too_short(expected))?;
        let stored = u32::from_le_bytes(*sum);
        let computed = Crc32::of(&bytes[..found - 4]);
        if stored != computed {
            return Err(SectionError::CheckSum { stored, computed });
        }
        match postcard::take_from_bytes(body) {
            Ok((section, [])) => Ok(section),
            _ => Err(SectionError::Malformed),
        }
    }
}
