//! `stillpoint device run F.spt`: everything from the limits to the end of the move.

use super::line::{self, Board, Explained};
use super::{config, entry, start, upload, words};
use crate::cli::{Failure, output, read_trajectory, terminal};
use crate::device::Uploaded;
use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;
use stillpoint_shared::Trajectory;
use stillpoint_shared::protocol::{Request, Status};
use stillpoint_shared::status::{HoldReason, State};
use stillpoint_shared::time;

/// Run a move from beginning to end. While it runs the status is asked for ten times a second, which the board takes
/// as signs of life; Ctrl-C sends a quick stop.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// Send the limits of this move file first, if the board has others
    #[arg(long = "move", value_name = "MOVE.toml")]
    move_file: Option<PathBuf>,
    #[command(flatten)]
    how: start::How,
    /// Switch the drives off at the end
    #[arg(long)]
    disarm: bool,
}

/// Time between two questions.
const BETWEEN: Duration = Duration::from_millis(100);

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let trajectory = read_trajectory(&arguments.trajectory)?;
    let limits = (arguments.move_file.as_deref())
        .map(config::limits_of)
        .transpose()?;
    let mut board = line.open(Some(&trajectory))?;
    let result = (|| {
        if let Some(limits) = &limits
            && board.identity().limits_hash != limits.hash()
        {
            config::set_limits(&mut board, limits)?;
        }
        let uploaded = upload::upload(&mut board, &trajectory)?;
        play(&mut board, &trajectory, &arguments.how)?;
        let status = until_done(&mut board);
        terminal::end_bar();
        let status = status?;
        if arguments.disarm && !arguments.how.dry_run {
            board.order(&Request::Disarm).map_err(Explained)?;
        }
        Ok((uploaded, status))
    })();
    line.say_faults(&board);
    let (uploaded, status) = result.inspect_err(|_: &Failure| terminal::end_bar())?;
    report(line, &trajectory, &uploaded, &status)
}

/// Arms and starts.
fn play(board: &mut Board, trajectory: &Trajectory, how: &start::How) -> Result<(), Failure> {
    let header = trajectory.header();
    let state = board.status().map_err(Explained)?.state;
    if !how.dry_run && state == State::Ready {
        terminal::step("switching the drives on");
        board.order(&Request::Arm).map_err(Explained)?;
    }
    let request = how.request(board, header.content_hash, header.limits_hash);
    Ok(board.start(&request).map_err(Explained)?)
}

/// Waits for the end of the move.
fn until_done(board: &mut Board) -> Result<Status, Failure> {
    let interrupted = terminal::interrupted();
    let mut stopped = false;
    loop {
        if !stopped && interrupted.load(Ordering::Relaxed) {
            board.order(&Request::QuickStop).map_err(Explained)?;
            stopped = true;
        }
        let status = board.status().map_err(Explained)?;
        let (now_ms, end_ms) = (
            time::seconds(status.path_ticks) * 1e3,
            time::seconds(status.duration_ticks) * 1e3,
        );
        match (status.state, &status.fault, status.held_by) {
            (State::Done, ..) => return Ok(status),
            (State::Fault, Some(fault), _) => {
                return Err(format!(
                    "the move ended at {now_ms:.4} of {end_ms:.4} ms: {fault}\n  see {}; `stillpoint device fault` shows the last second",
                    entry::of_fault(&fault.cause)
                )
                .into());
            }
            (State::Held, _, Some(HoldReason::CommsLost)) => {
                return Err(format!(
                    "the move is held at {now_ms:.4} of {end_ms:.4} ms, because the board heard nothing for longer than \
                     --timeout-ms: `stillpoint device resume` goes on\n  see docs/troubleshooting.md#the-move-holds-and-nobody-asked"
                )
                .into());
            }
            (state, ..) if state.is_under_way() => {}
            (state, ..) => {
                return Err(format!(
                    "the move was ended by somebody else: the board is in state {state:?}, at {now_ms:.4} of {end_ms:.4} ms"
                )
                .into());
            }
        }
        terminal::bar(
            "move",
            status.path_ticks,
            status.duration_ticks,
            &format!("{:?}, {now_ms:.1} of {end_ms:.1} ms", status.state),
        );
        board.wait(BETWEEN).map_err(Explained)?;
    }
}

fn report(
    line: &line::Arguments,
    trajectory: &Trajectory,
    uploaded: &Uploaded,
    status: &Status,
) -> Result<(), Failure> {
    let loaded = words::hash(trajectory.header().content_hash);
    if line.json {
        let mut object = words::status_object(status);
        object["upload"] = upload::object(uploaded);
        return output::object(&object);
    }
    output::text(&format!(
        "{:?}: {loaded} played in {:.4} ms{}\n  upload: {}\n{}",
        status.state,
        time::seconds(status.duration_ticks) * 1e3,
        if status.dry_run { ", dry run" } else { "" },
        upload::text(uploaded),
        words::axes(status)
    ))
}
