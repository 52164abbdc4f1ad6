//! `stillpoint device start`

use super::line::{self, Board, Explained};
use super::{entry, orders, words};
use crate::cli::{Failure, read_trajectory, terminal};
use crate::device::DeviceError;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use stillpoint_shared::protocol::{Denial, Request, Status};
use stillpoint_shared::status::{CommsPolicy, StartRequest, State};
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

/// Start the move that is loaded.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Start only if this trajectory is the one that is loaded
    #[arg(value_name = "F.spt")]
    trajectory: Option<PathBuf>,
    /// Switch the drives on first, and wait until the axes stand at the start; off again if that fails, or by Ctrl-C
    #[arg(long, conflicts_with = "dry_run")]
    arm: bool,
    #[command(flatten)]
    how: How,
}

/// How a move is played.
#[derive(Debug, Args)]
pub(super) struct How {
    /// What the board does when it hears nothing from the host
    #[arg(long, value_enum, default_value_t = Comms::Hold)]
    comms: Comms,
    /// Longest silence of the host, ms
    #[arg(long, value_name = "MS", default_value_t = 1000)]
    timeout_ms: u32,
    /// Play with the drives off
    #[arg(long)]
    pub(super) dry_run: bool,
}

/// What the board does when it hears nothing from the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Comms {
    /// Play on
    Continue,
    /// Hold on the path; resume goes on
    Hold,
    /// Slow down along the path, then take the torque away
    QuickStop,
}

/// Time between two questions of a command that waits for the end of a move, where the board needs no other.
const BETWEEN: Duration = Duration::from_millis(100);
/// The shortest one.
const SHORTEST_BETWEEN: Duration = Duration::from_millis(10);
/// Questions within the longest silence that the board bears.
const QUESTIONS: u32 = 4;

impl How {
    /// Time between two questions that are the signs of life of a move.
    pub(super) fn between_questions(&self) -> Result<Duration, Explained> {
        if self.comms == Comms::Continue {
            return Ok(BETWEEN);
        }
        let between = Duration::from_millis(self.timeout_ms.into()) / QUESTIONS;
        if between < SHORTEST_BETWEEN {
            let least = SHORTEST_BETWEEN * QUESTIONS;
            return Err(Explained::new(
                format!(
                    "--timeout-ms {} is too short for this command, which asks every {} ms at most and would be taken for \
                     lost: give {} or more, or --comms continue",
                    self.timeout_ms,
                    SHORTEST_BETWEEN.as_millis(),
                    least.as_millis()
                ),
                entry::of_symptom("the-move-holds-and-nobody-asked"),
            ));
        }
        Ok(between.min(BETWEEN))
    }

    /// What a board does that hears no more of the host.
    pub(super) fn without_host(&self) -> String {
        let patience = format!("plays on for up to {} ms more, then", self.timeout_ms);
        let does = match self.comms {
            _ if self.dry_run => "plays on with the drives off".to_owned(),
            Comms::Continue => "plays the move to its end, with the drives on".to_owned(),
            Comms::Hold => format!(
                "{patience} holds the move if it has not ended; the drives stay on: `stillpoint device resume` goes on, \
                 `stop` ends it"
            ),
            Comms::QuickStop => format!(
                "{patience} slows down along the path and switches the drives off: `stillpoint device clear` goes on"
            ),
        };
        format!("the board, if it still runs, {does}")
    }

    /// What a board does after the end of the move, if nobody tells it anything more.
    pub(super) fn after_the_end(&self) -> Option<String> {
        match self.comms {
            _ if self.dry_run => None,
            Comms::Continue | Comms::Hold => Some(
                "the drives stay on and hold the end of the move: `stillpoint device disarm` switches them off"
                    .to_owned(),
            ),
            Comms::QuickStop => Some(format!(
                "the board hears no more of this command, and switches the drives off {} ms after it was last heard, which is a \
                 fault: `stillpoint device disarm` comes before, `clear` goes on",
                self.timeout_ms
            )),
        }
    }

    /// The request to start a move on a board.
    pub(super) fn request(
        &self,
        board: &Board,
        trajectory_hash: u64,
        limits_hash: u64,
    ) -> StartRequest {
        let ticks = u64::from(self.timeout_ms) * u64::from(TIME_TICKS_PER_SECOND / 1000)
            / u64::from(board.identity().period_ticks.max(1));
        StartRequest {
            trajectory_hash,
            limits_hash,
            comms: match self.comms {
                Comms::Continue => CommsPolicy::Continue,
                Comms::Hold => CommsPolicy::Hold,
                Comms::QuickStop => CommsPolicy::QuickStop,
            },
            comms_timeout_ticks: u32::try_from(ticks).unwrap_or(u32::MAX),
            dry_run: self.dry_run,
        }
    }
}

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let meant = match &arguments.trajectory {
        Some(path) => Some(read_trajectory(path)?),
        None => None,
    };
    let mut board = line.open(meant.as_ref())?;
    if arguments.arm {
        board.interrupt_by(Some(Arc::clone(terminal::interrupted())));
    }
    let status = board.status().map_err(Explained::from)?;
    let (trajectory_hash, limits_hash) = match &meant {
        Some(meant) => (meant.header().content_hash, meant.header().limits_hash),
        None => (status.loaded.unwrap_or_default(), status.limits_hash),
    };
    let request = arguments.how.request(&board, trajectory_hash, limits_hash);
    play(&mut board, &status, &request, arguments.arm)?;
    terminal::step(&format!(
        "this command sends no more signs of life: {}",
        arguments.how.without_host()
    ));
    orders::done(line, &mut board, "start")
}

/// Switches the drives on, if they are to be, and starts. What can be known to fail fails before; what fails afterwards
/// switches them off again.
pub(super) fn play(
    board: &mut Board,
    status: &Status,
    request: &StartRequest,
    arm: bool,
) -> Result<(), Explained> {
    check(status, request)?;
    if !arm {
        return Ok(board.order(&Request::Start(*request))?);
    }
    let were_on = status.state == State::Armed;
    let started = if were_on {
        board.start(request)
    } else {
        terminal::step("switching the drives on");
        (board.order(&Request::Arm)).and_then(|()| board.start(request))
    };
    started.map_err(|error| Explained::from(error).and(&give_up(board, were_on)))
}

/// What the board would refuse after the drives are on, and what it would wait for without end.
fn check(status: &Status, request: &StartRequest) -> Result<(), Explained> {
    if let Some(loaded) = status.loaded {
        let checked = request.check(loaded, status.limits_hash);
        checked.map_err(|refusal| DeviceError::Denied(Denial::Executor(refusal)))?;
    }
    if status.override_percent == 0 {
        return Err(Explained::new(
            "the override is 0 %, so the move would not begin: `stillpoint device override 100`, or another one from 1 on, \
             comes first",
            entry::of_symptom("the-move-is-slower-than-planned"),
        ));
    }
    Ok(())
}

/// Ends what was begun, and says in words how the drives are then.
fn give_up(board: &mut Board, were_on: bool) -> String {
    board.interrupt_by(None);
    let status = board.status();
    let left = status.and_then(|status| match status.state {
        State::Armed if were_on => Ok("the drives are on, as they were before".to_owned()),
        State::Armed => {
            board.order(&Request::Disarm)?;
            Ok("the drives are off again".to_owned())
        }
        state if state.is_under_way() => {
            board.order(&Request::QuickStop)?;
            Ok("the move has begun nevertheless and was told to stop, then the drives go off: `stillpoint device clear` goes on"
                .to_owned())
        }
        _ => Ok(words::drives(&status)),
    });
    left.unwrap_or_else(|error| {
        format!("whether the drives are on is not known: `stillpoint device status` says it, `stop` switches them off ({error})")
    })
}
