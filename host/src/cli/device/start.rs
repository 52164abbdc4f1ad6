//! `stillpoint device start`

use super::line::{self, Board, Explained};
use super::orders;
use crate::cli::{Failure, read_trajectory};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use stillpoint_shared::protocol::Request;
use stillpoint_shared::status::{CommsPolicy, StartRequest};
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

/// Start the move that is loaded.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Start only if this trajectory is the one that is loaded
    #[arg(value_name = "F.spt")]
    trajectory: Option<PathBuf>,
    /// Switch the drives on first, and wait until the axes stand at the start
    #[arg(long)]
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

impl How {
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
    let status = board.status().map_err(Explained)?;
    let (trajectory_hash, limits_hash) = match &meant {
        Some(meant) => (meant.header().content_hash, meant.header().limits_hash),
        None => (status.loaded.unwrap_or_default(), status.limits_hash),
    };
    let request = arguments.how.request(&board, trajectory_hash, limits_hash);
    if arguments.arm {
        board.order(&Request::Arm).map_err(Explained)?;
        board.start(&request).map_err(Explained)?;
    } else {
        board.order(&Request::Start(request)).map_err(Explained)?;
    }
    orders::done(line, &mut board, "start")
}
