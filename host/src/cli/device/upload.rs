//! `stillpoint device upload F.spt`

use super::line::{self, Board, Explained};
use super::words;
use crate::cli::{Failure, output, read_trajectory, terminal};
use crate::device::Uploaded;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use stillpoint_shared::Trajectory;

/// Upload a trajectory.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
}

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let trajectory = read_trajectory(&arguments.trajectory)?;
    let mut board = line.open(Some(&trajectory))?;
    let uploaded = upload(&mut board, &trajectory)?;
    line.say_faults(&board);
    let loaded = words::hash(trajectory.header().content_hash);
    if line.json {
        let mut result = object(&uploaded);
        result["status"] = json!("done");
        result["loaded"] = json!(loaded);
        return output::object(&result);
    }
    output::line(&format!("loaded {loaded}: {}", text(&uploaded)))
}

/// Uploads with progress on a terminal.
pub(super) fn upload(board: &mut Board, trajectory: &Trajectory) -> Result<Uploaded, Explained> {
    let result = board.upload(trajectory, |progress| {
        let (arrived, blocks) = (progress.arrived, progress.blocks);
        terminal::bar(
            "upload",
            arrived,
            blocks,
            &format!("{arrived} of {blocks} blocks"),
        );
    });
    terminal::end_bar();
    Ok(result?)
}

pub(super) fn object(uploaded: &Uploaded) -> Value {
    json!({
        "blocks": uploaded.blocks,
        "blocks_sent": uploaded.sent,
        "reconnects": uploaded.reconnects,
        "upload_s": uploaded.time.as_secs_f64(),
    })
}

pub(super) fn text(uploaded: &Uploaded) -> String {
    format!(
        "{} blocks, {} sent, in {:.3} s, {} reconnects",
        uploaded.blocks,
        uploaded.sent,
        uploaded.time.as_secs_f64(),
        uploaded.reconnects
    )
}
