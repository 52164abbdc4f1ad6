//! `stillpoint device status`

use super::line::Explained;
use super::{entry, line, words};
use crate::cli::{Failure, output};
use stillpoint_shared::protocol::Status;
use stillpoint_shared::status::HoldReason;
use stillpoint_shared::time;

pub(super) fn run(line: &line::Arguments) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    let status = board.status().map_err(Explained::from)?;
    line.say_faults(&board);
    if line.json {
        return output::object(&words::status_object(&status));
    }
    output::text(&text(&status))
}

fn text(status: &Status) -> String {
    let mut text = format!("{:?}", status.state);
    match status.held_by {
        Some(HoldReason::CommsLost) => text += ", because nothing was heard from the host",
        Some(_) => text += ", as ordered",
        None => {}
    }
    if status.dry_run {
        text += ", dry run";
    }
    text += "\n";
    if let Some(fault) = &status.fault {
        text += &format!(
            "  fault: {fault}\n  see {}\n",
            entry::of_fault(&fault.cause)
        );
    }
    match status.loaded {
        Some(loaded) => {
            text += &format!(
                "  trajectory {} at {:.4} of {:.4} ms, override {} %\n",
                words::hash(loaded),
                time::seconds(status.path_ticks) * 1e3,
                time::seconds(status.duration_ticks) * 1e3,
                status.override_percent
            );
        }
        None => text += &format!("  nothing loaded, override {} %\n", status.override_percent),
    }
    text += &format!(
        "  limits {}, tick {}\n",
        words::limits_or_none(status.limits_hash),
        status.tick
    );
    text += &words::axes(status);
    if status.upload.blocks > 0 && status.upload.missing() > 0 {
        text += &format!(
            "  upload: {} of {} blocks are missing\n",
            status.upload.missing(),
            status.upload.blocks
        );
    }
    let link = &status.link;
    text += &format!(
        "  link: {} requests, {} damaged, {} overrun_bytes, {} repeated, {} dropped\n",
        link.requests, link.damaged, link.overrun_bytes, link.repeated, link.dropped
    );
    text
}
