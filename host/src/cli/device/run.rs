//! `stillpoint device run F.spt`: everything from the limits to the end of the move.

use super::line::{self, Board, Explained};
use super::record::{Recorded, Recording};
use super::samples::{self, Channel};
use super::{config, entry, start, upload, words};
use crate::cli::{Failure, output, read_trajectory, terminal};
use crate::device::{DeviceError, Uploaded};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use stillpoint_shared::Trajectory;
use stillpoint_shared::protocol::{Request, Response, Status};
use stillpoint_shared::status::{FaultCause, HoldReason, State};
use stillpoint_shared::time;

/// Run a move from beginning to end. While it runs the status is asked for ten times a second, or four times within a
/// shorter --timeout-ms, which the board takes as signs of life. Ctrl-C sends a quick stop; before the move has begun it
/// switches the drives off.
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
    /// Record the move in this file, as `monitor --csv` prints it, and up to 0.1 s after it; also a move that fails
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Samples per second in the record, 500 if none are named. A line of 921,600 bit/s carries about 1,000 of all channels
    /// of three axes, and 2,400 of one
    #[arg(long, value_name = "HZ", requires = "csv", value_parser = samples::rate_hz)]
    rate: Option<f64>,
    /// What the samples carry; all if none is named
    #[arg(
        long,
        value_name = "NAME,NAME",
        requires = "csv",
        value_enum,
        value_delimiter = ','
    )]
    channels: Vec<Channel>,
}

/// Time before a new connection, for whoever has taken the line to stop the move.
const BEFORE_ANEW: Duration = Duration::from_millis(100);
/// Samples per second in a record: 25 of the paper's move.
const RATE_HZ: f64 = 500.0;

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let trajectory = read_trajectory(&arguments.trajectory)?;
    let limits = (arguments.move_file.as_deref())
        .map(config::limits_of)
        .transpose()?;
    let between = arguments.how.between_questions()?;
    // A file that cannot be written is known before anything moves.
    let mut recording = match &arguments.csv {
        Some(path) => {
            let channels = samples::chosen(&arguments.channels);
            let rate_hz = arguments.rate.unwrap_or(RATE_HZ);
            Some(Recording::create(path, channels, rate_hz)?)
        }
        None => None,
    };
    let mut board = line.open(Some(&trajectory))?;
    board.interrupt_by(Some(Arc::clone(terminal::interrupted())));
    let result = (|| {
        if let Some(limits) = &limits
            && board.identity().limits_hash != limits.hash()
        {
            config::set_limits(&mut board, limits)?;
        }
        let uploaded = upload::upload(&mut board, &trajectory)?;
        let how = &arguments.how;
        let (header, status) = (
            trajectory.header(),
            board.status().map_err(Explained::from)?,
        );
        let request = how.request(&board, header.content_hash, header.limits_hash);
        if let Some(recording) = &recording {
            recording.begin(&mut board).map_err(Explained::from)?;
        }
        start::play(&mut board, &status, &request, !how.dry_run)?;
        terminal::step(&format!(
            "the move has begun; were this command to end before it, {}",
            how.without_host()
        ));
        let status = until_done(&mut board, how, between, status.tick, &mut recording);
        terminal::end_bar();
        let status = status?;
        if arguments.disarm && !how.dry_run {
            board.interrupt_by(None);
            board.order(&Request::Disarm).map_err(Explained::from)?;
        } else if let Some(does) = how.after_the_end() {
            terminal::step(&does);
        }
        Ok((uploaded, status))
    })();
    let recorded = recording.map(|recording| {
        board.interrupt_by(None);
        recording.end(&mut board)
    });
    line.say_faults(&board);
    let (uploaded, status) = match result {
        Ok(played) => played,
        Err(failure) => {
            let failure: Failure = failure;
            terminal::end_bar();
            if let Some(Ok(recorded)) = recorded {
                terminal::step(&recorded.text());
            }
            return Err(failure);
        }
    };
    report(line, &trajectory, &uploaded, &status, recorded.transpose()?)
}

/// Waits for the end of the move.
fn until_done(
    board: &mut Board,
    how: &start::How,
    between: Duration,
    mut tick: u64,
    recording: &mut Option<Recording>,
) -> Result<Status, Explained> {
    // Where, and `tick` when, the board was last heard.
    let mut reached = "its start".to_owned();
    let mut wait = Duration::ZERO;
    loop {
        let heard = again(board, recording, |board, recording| {
            board.wait(wait)?;
            if let Some(recording) = recording {
                recording.keep(board)?;
            }
            board.status()
        });
        wait = between;
        let status = match heard {
            Ok(status) => status,
            Err(DeviceError::Interrupted) => {
                // This and what follows has to come through.
                board.interrupt_by(None);
                let stopped = again(board, recording, |board, _| {
                    board.order(&Request::QuickStop)
                });
                stopped.map_err(|error| out_of_reach(error, how, &reached))?;
                wait = Duration::ZERO;
                continue;
            }
            Err(error) => return Err(out_of_reach(error, how, &reached)),
        };
        let (now_ms, end_ms) = (
            time::seconds(status.path_ticks) * 1e3,
            time::seconds(status.duration_ticks) * 1e3,
        );
        let here = format!("{now_ms:.4} of {end_ms:.4} ms");
        match (status.state, &status.fault, status.held_by) {
            (State::Done, ..) => return Ok(status),
            (State::Fault, Some(fault), _) => {
                return Err(Explained::new(
                    format!(
                        "the move ended at {here}: {fault}; the drives are off; `stillpoint device fault` shows the last second"
                    ),
                    entry::of_fault(&fault.cause),
                ));
            }
            (State::Held, _, Some(HoldReason::CommsLost)) => {
                return Err(Explained::new(
                    format!(
                        "the move is held at {here}, because the board heard nothing for longer than --timeout-ms; {}: \
                         `stillpoint device resume` goes on",
                        words::drives(&status)
                    ),
                    entry::of_symptom("the-move-holds-and-nobody-asked"),
                ));
            }
            (state, ..) if state.is_under_way() => {}
            _ => return Err(ended_otherwise(board, &status, &reached, tick)),
        }
        terminal::bar(
            "move",
            status.path_ticks,
            status.duration_ticks,
            &format!("{:?}, {now_ms:.1} of {end_ms:.1} ms", status.state),
        );
        (reached, tick) = (here, status.tick);
    }
}

/// Asks, and where the board is out of reach asks once more on a new connection. A greeting is no sign of life, and a move
/// that the board holds meanwhile stays held.
fn again<T>(
    board: &mut Board,
    recording: &mut Option<Recording>,
    mut ask: impl FnMut(&mut Board, &mut Option<Recording>) -> Result<T, DeviceError>,
) -> Result<T, DeviceError> {
    let error = match ask(board, recording) {
        Err(error) if error.is_out_of_reach() => error,
        answered => return answered,
    };
    terminal::step(&format!("{error}; connecting anew"));
    thread::sleep(BEFORE_ANEW);
    match board.reconnect() {
        Ok(_) => {}
        Err(DeviceError::Interrupted) => return Err(DeviceError::Interrupted),
        // The first error is the nearest to the cause.
        Err(_) => return Err(error),
    }
    if let Some(recording) = recording {
        recording.begin(board)?;
    }
    ask(board, recording)
}

/// A board that no longer answers, and what it does now.
fn out_of_reach(error: DeviceError, how: &start::How, reached: &str) -> Explained {
    let lost = error.is_out_of_reach();
    let explained = Explained::from(error);
    if !lost {
        return explained;
    }
    let does = how.without_host();
    explained.and(&format!("the move was last seen at {reached}; {does}"))
}

/// A move that is neither under way nor at its end nor in a fault: why, as far as the board knows.
fn ended_otherwise(board: &mut Board, status: &Status, reached: &str, tick: u64) -> Explained {
    let drives = words::drives(status);
    // The record began with this move.
    if let Ok(Response::Fault(Some(head))) = board.ask(&Request::GetFault) {
        let fault = head.fault;
        return Explained::new(
            format!(
                "the move ended, last seen at {reached}: {fault}; {drives}; `stillpoint device fault` shows the last second"
            ),
            entry::of_fault(&fault.cause),
        );
    }
    if status.tick < tick {
        return Explained::new(
            format!(
                "the move ended, last seen at {reached}: the board started anew and has no record of it, as after a loss of \
                 power: check its supply; {drives}"
            ),
            entry::of_fault(&FaultCause::Restart),
        );
    }
    Explained {
        message: format!("the move was ended by somebody else, last seen at {reached}; {drives}"),
        see: None,
    }
}

fn report(
    line: &line::Arguments,
    trajectory: &Trajectory,
    uploaded: &Uploaded,
    status: &Status,
    recorded: Option<Recorded>,
) -> Result<(), Failure> {
    let loaded = words::hash(trajectory.header().content_hash);
    if line.json {
        let mut object = words::status_object(status);
        object["upload"] = upload::object(uploaded);
        object["samples"] = json!(recorded.as_ref().map(Recorded::object));
        return output::object(&object);
    }
    let recorded = recorded.map_or(String::new(), |recorded| format!("  {}\n", recorded.text()));
    output::text(&format!(
        "{:?}: {loaded} played in {:.4} ms{}\n  upload: {}\n{recorded}{}",
        status.state,
        time::seconds(status.duration_ticks) * 1e3,
        if status.dry_run { ", dry run" } else { "" },
        upload::text(uploaded),
        words::axes(status)
    ))
}
