//! What the board keeps over a loss of power: `store`, `list`, `load`, `erase`.

use super::line::{self, Board, Explained};
use super::{orders, words};
use crate::cli::{Failure, output};
use crate::device::DeviceError;
use clap::Args;
use serde_json::{Value, json};
use stillpoint_shared::protocol::{Request, Response};
use stillpoint_shared::time;

/// Load a stored trajectory.
#[derive(Debug, Args)]
pub(super) struct Load {
    /// Its content hash, as `list` shows it; the first digits are enough
    hash: String,
}

/// Forget a stored trajectory, or all.
#[derive(Debug, Args)]
pub(super) struct Erase {
    /// Its content hash, as `list` shows it; the first digits are enough
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    hash: Option<String>,
    /// Forget all
    #[arg(long)]
    all: bool,
}

pub(super) fn store(line: &line::Arguments) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    board.order(&Request::Store).map_err(Explained::from)?;
    orders::done(line, &mut board, "store")
}

pub(super) fn list(line: &line::Arguments) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    let stored = match board.ask(&Request::List).map_err(Explained::from)? {
        Response::Stored(stored) => stored,
        _ => return Err(Explained::from(DeviceError::Unexpected { request: "List" }).into()),
    };
    line.say_faults(&board);
    if line.json {
        let moves: Vec<Value> = (stored.iter())
            .map(|one| {
                json!({
                    "id": one.id,
                    "content_hash": words::hash(one.content_hash),
                    "limits_hash": words::hash(one.limits_hash),
                    "duration_s": time::seconds(one.duration_ticks),
                    "bytes": one.bytes,
                })
            })
            .collect();
        return output::object(&json!({"status": "done", "stored": moves}));
    }
    let mut text = String::new();
    for one in &stored {
        text += &format!(
            "{}  move {}, {:.4} ms, {} bytes, for limits {}\n",
            words::hash(one.content_hash),
            one.id,
            time::seconds(one.duration_ticks) * 1e3,
            one.bytes,
            words::hash(one.limits_hash)
        );
    }
    if stored.is_empty() {
        text += "nothing stored\n";
    }
    output::text(&text)
}

pub(super) fn load(line: &line::Arguments, arguments: &Load) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    let content_hash = find(&board, &arguments.hash)?;
    let request = Request::Load { content_hash };
    board.order(&request).map_err(Explained::from)?;
    orders::done(line, &mut board, "load")
}

pub(super) fn erase(line: &line::Arguments, arguments: &Erase) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    let content_hash = match &arguments.hash {
        Some(digits) => Some(find(&board, digits)?),
        None => None,
    };
    let request = Request::Erase { content_hash };
    board.order(&request).map_err(Explained::from)?;
    orders::done(line, &mut board, "erase")
}

/// The stored trajectory whose hash begins with these digits; a whole hash is left to the board.
fn find(board: &Board, digits: &str) -> Result<u64, Failure> {
    let Ok(number) = u64::from_str_radix(digits, 16) else {
        return Err(format!(
            "`{digits}` is no hash: give up to 16 hexadecimal digits, as `stillpoint device list` shows them"
        )
        .into());
    };
    if digits.len() == 16 {
        return Ok(number);
    }
    let digits = digits.to_lowercase();
    let stored = &board.identity().stored;
    let fits: Vec<u64> = (stored.iter().copied())
        .filter(|&hash| words::hash(hash).starts_with(&digits))
        .collect();
    match fits[..] {
        [hash] => Ok(hash),
        [] => Err(format!(
            "no stored trajectory begins with {digits}: `stillpoint device list` shows those there are"
        )
        .into()),
        _ => Err(format!(
            "{} of the {} stored trajectories begin with {digits}: `stillpoint device list` shows them",
            fits.len(),
            stored.len()
        )
        .into()),
    }
}
