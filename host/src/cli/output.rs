//! Standard output: results only. A reader that has seen enough (`| head -1`) is no error; a full disk is.

use super::Failure;
use serde_json::Value;
use std::io::{ErrorKind, Write, stdout};

/// Writes text as it is.
pub(super) fn text(text: &str) -> Result<(), Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(format!("cannot write to standard output: {error}").into()),
        Ok(()) => Ok(()),
    }
}

/// Writes a line.
pub(super) fn line(line: &str) -> Result<(), Failure> {
    text(&format!("{line}\n"))
}

/// Writes one JSON object as a line.
pub(super) fn object(object: &Value) -> Result<(), Failure> {
    line(&object.to_string())
}
