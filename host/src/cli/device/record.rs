//! The samples of a move in a CSV file.
//!
//! The file is made before anything moves, under another name, and takes its own when it is whole: what stands under that
//! name is never half a record. A disk that fills up ends the record and not the move.

use super::line::Board;
use super::samples;
use crate::cli::{Failure, FileError};
use crate::device::DeviceError;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use stillpoint_shared::protocol::{Channels, Request, TelemetryConfig};
use stillpoint_shared::status::State;

/// A record that is being written.
pub(super) struct Recording {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    failed: Option<io::Error>,
    channels: Channels,
    rate_hz: f64,
    counts: Counts,
    /// The board's own count in the last sample.
    dropped_before: u32,
}

/// How many samples there are, and how many there are not.
#[derive(Clone, Copy, Default)]
struct Counts {
    rows: u64,
    dropped: u64,
    lost: u64,
}

/// A record that is whole.
pub(super) struct Recorded {
    path: PathBuf,
    counts: Counts,
}

impl Recording {
    /// Makes the file.
    pub(super) fn create(path: &Path, channels: Channels, rate_hz: f64) -> Result<Self, FileError> {
        let cannot = |source| FileError {
            verb: "write",
            path: path.to_owned(),
            source,
        };
        if path.is_dir() {
            return Err(cannot(io::ErrorKind::IsADirectory.into()));
        }
        let mut part = OsString::from(path);
        part.push(".part");
        let part = PathBuf::from(part);
        let file = File::create(&part).map_err(cannot)?;
        Ok(Self {
            path: path.to_owned(),
            part,
            file: BufWriter::new(file),
            failed: None,
            channels,
            rate_hz,
            counts: Counts::default(),
            dropped_before: 0,
        })
    }

    /// Has the board send samples, from now on or again.
    pub(super) fn begin(&self, board: &mut Board) -> Result<(), DeviceError> {
        let telemetry = samples::telemetry(board, self.rate_hz, self.channels);
        board.order(&Request::SetTelemetry(telemetry))
    }

    /// Writes what has come since, without waiting for more.
    pub(super) fn keep(&mut self, board: &mut Board) -> Result<(), DeviceError> {
        while let Some(received) = board.telemetry(Duration::ZERO)? {
            let sample = &received.telemetry;
            // The board counts anew after every start of telemetry.
            let dropped = sample.dropped.checked_sub(self.dropped_before);
            let dropped = dropped.unwrap_or(sample.dropped);
            self.dropped_before = sample.dropped;
            let begun = sample.state.is_under_way() || sample.state == State::Done;
            if self.counts.rows == 0 {
                if !begun {
                    continue;
                }
                let axes = board.identity().axes;
                self.write(&samples::heading(sample.channels, axes));
            }
            self.counts.rows += 1;
            self.counts.dropped += u64::from(dropped);
            self.counts.lost += u64::from(received.lost);
            self.write(&samples::row(&received));
        }
        Ok(())
    }

    fn write(&mut self, text: &str) {
        if self.failed.is_none() {
            self.failed = self.file.write_all(text.as_bytes()).err();
        }
    }

    /// Ends the record, however the move has ended; nothing is left of one in which nothing moved.
    pub(super) fn end(mut self, board: &mut Board) -> Result<Recorded, Failure> {
        // What comes out of this counts less than what came before.
        let _ = board.order(&Request::SetTelemetry(TelemetryConfig::OFF));
        let _ = self.keep(board);
        let name = self.path.display().to_string();
        if self.counts.rows == 0 {
            return Err(format!("no sample of the move came, so {name} is not written: with a move as short as this, give a higher --rate").into());
        }
        let flushed = match self.failed.take() {
            Some(error) => Err(error),
            None => self
                .file
                .flush()
                .and_then(|()| self.file.get_ref().sync_all()),
        };
        let whole = flushed.and_then(|()| std::fs::rename(&self.part, &self.path));
        whole.map_err(|source| FileError {
            verb: "write",
            path: self.path.clone(),
            source,
        })?;
        Ok(Recorded {
            path: self.path.clone(),
            counts: self.counts,
        })
    }
}

impl Drop for Recording {
    /// Of a record that is whole nothing is left under this name.
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.part);
    }
}

impl Recorded {
    /// For people.
    pub(super) fn text(&self) -> String {
        let Counts {
            rows,
            dropped,
            lost,
        } = self.counts;
        format!(
            "{rows} samples in {}; {dropped} more were dropped on the board, {lost} lost on the line",
            self.path.display()
        )
    }

    /// For programs.
    pub(super) fn object(&self) -> Value {
        let Counts {
            rows,
            dropped,
            lost,
        } = self.counts;
        json!({"file": self.path.display().to_string(), "rows": rows, "dropped": dropped, "lost": lost})
    }
}
