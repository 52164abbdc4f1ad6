//! Orders without numbers, and `override`.

use super::line::{self, Board, Explained};
use super::words;
use crate::cli::{Failure, output};
use clap::Args;
use serde_json::json;
use stillpoint_shared::protocol::Request;

/// Play at a part of the planned speed.
#[derive(Debug, Args)]
pub(super) struct Override {
    /// 0 to 100 % of the planned speed; kept for the following moves, too
    percent: u8,
}

pub(super) fn arm(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "arm", &Request::Arm)
}

pub(super) fn disarm(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "disarm", &Request::Disarm)
}

pub(super) fn hold(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "hold", &Request::Hold)
}

pub(super) fn resume(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "resume", &Request::Resume)
}

pub(super) fn override_speed(line: &line::Arguments, arguments: &Override) -> Result<(), Failure> {
    let percent = arguments.percent;
    order(line, "override", &Request::Override { percent })
}

pub(super) fn stop(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "stop", &Request::QuickStop)
}

pub(super) fn clear(line: &line::Arguments) -> Result<(), Failure> {
    order(line, "clear", &Request::Clear)
}

/// Gives an order to a board of its own session.
fn order(line: &line::Arguments, name: &str, request: &Request<'_>) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    board.order(request).map_err(Explained::from)?;
    done(line, &mut board, name)
}

/// Says that an order was obeyed, and where the board is now.
pub(super) fn done(line: &line::Arguments, board: &mut Board, name: &str) -> Result<(), Failure> {
    // The order was obeyed, whether or not this question is answered.
    let state = board.status().ok();
    line.say_faults(board);
    let loaded = state.as_ref().and_then(|status| status.loaded);
    let state = state.map(|status| format!("{:?}", status.state));
    if line.json {
        let loaded = loaded.map(words::hash);
        return output::object(
            &json!({"status": "done", "order": name, "state": state, "loaded": loaded}),
        );
    }
    let state = state.map_or_else(String::new, |state| format!(", state {state}"));
    output::line(&format!("{name}: done{state}"))
}
