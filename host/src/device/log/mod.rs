//! What a board logs, in words: defmt frames, decoded with the image that wrote them.
//!
//! The frames carry numbers; the words stand in the image's debug information. So the image has to be the very one, which
//! its build id tells.

mod frames;
mod words;

use frames::Frames;
use object::{Object, read::File};
use std::fs;
use std::path::{Path, PathBuf};
use words::Words;

/// An image and what it can say.
pub struct LogImage {
    path: PathBuf,
    build_id: u64,
    words: Words,
}

/// Why a log cannot be decoded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The image cannot be read.
    #[error("{}: {error}: give the image that the board runs", path.display())]
    Unreadable {
        /// The image.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The file is no image with a log.
    #[error("{}: {problem}: give the image that the board runs, as Cargo built it", path.display())]
    NoImage {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// The board runs another image.
    #[error(
        "the board runs build {board:016x}, {} is build {image:016x}: give the image that the board runs, or flash this one",
        path.display()
    )]
    OtherImage {
        /// The image.
        path: PathBuf,
        /// Its build id.
        image: u64,
        /// The board's.
        board: u64,
    },
}

impl LogImage {
    /// Reads an image.
    ///
    /// # Errors
    /// [`LogError`] where it is none.
    pub fn read(path: &Path) -> Result<Self, LogError> {
        let path = path.to_owned();
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) => return Err(LogError::Unreadable { path, error }),
        };
        match understood(&bytes) {
            Ok((build_id, words)) => Ok(Self {
                path,
                build_id,
                words,
            }),
            Err(problem) => Err(LogError::NoImage { path, problem }),
        }
    }

    /// The first eight bytes of the build id, as `hello` reports it.
    pub fn build_id(&self) -> u64 {
        self.build_id
    }

    /// Whether this is the image of a board with this build id.
    ///
    /// # Errors
    /// [`LogError::OtherImage`] with both.
    pub fn expect(&self, board: u64) -> Result<(), LogError> {
        if board == self.build_id {
            return Ok(());
        }
        Err(LogError::OtherImage {
            path: self.path.clone(),
            image: self.build_id,
            board,
        })
    }

    /// Takes `bytes` in pieces as they come and hands on the lines they make: level and words.
    pub fn decode(&self, pieces: impl Iterator<Item = Vec<u8>>, mut line: impl FnMut(&str)) {
        let mut frames = Frames::default();
        for byte in pieces.flatten() {
            let Some(frame) = frames.feed(byte) else {
                continue;
            };
            match frame.ok().and_then(|frame| self.words.tell(&frame)) {
                Some((level, words)) => line(&format!("{level:<5} {words}")),
                None => line("(a damaged line)"),
            }
        }
    }
}

/// Build id and words of an image, or what is wrong with it.
fn understood(image: &[u8]) -> Result<(u64, Words), String> {
    let file = File::parse(image).map_err(|error| error.to_string())?;
    let build_id = file.build_id().map_err(|error| error.to_string())?;
    let build_id = build_id.and_then(|id| id.first_chunk());
    let build_id = build_id.ok_or("it has no build id")?;
    Ok((u64::from_be_bytes(*build_id), Words::of(&file)?))
}
