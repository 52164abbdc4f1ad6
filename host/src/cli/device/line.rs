//! The way to the board that all device commands share, and what they say when it fails.

use super::entry;
use crate::cli::{Failure, terminal};
use crate::device::{DeviceError, Faults, Faulty, Port, Session, Settings, Simulated};
use crate::device::{Transport, TransportError};
use clap::Args;
use std::fmt;
use std::io;
use stillpoint_shared::{MAX_AXES, Player, Trajectory};

/// Which board, and over which line.
#[derive(Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The board's port: /dev/ttyUSB0, /dev/ttyUSB0@115200 (bit/s), COM3, tcp:host:port, qemu: (an emulated board), sim:
    /// (a simulated one); the last two last as long as the command
    #[arg(long, global = true, value_name = "PORT")]
    port: Option<Port>,
    /// Disturb the line on purpose: a probability for all kinds of faults, such as 5%, or some of drop=, duplicate=,
    /// reorder=, corrupt=, delay=, cut=, seed=
    #[arg(long, global = true, value_name = "FAULTS")]
    faults: Option<Faults>,
    /// Print the result as one JSON object on stdout (`monitor`: one per sample)
    #[arg(long, global = true)]
    pub(super) json: bool,
}

/// A session over any line.
pub(super) type Board = Session<Faulty<Box<dyn Transport>>>;

/// What a board refused, why it cannot be reached, or how a move failed, and where that is explained.
#[derive(Debug)]
pub(super) struct Explained {
    pub(super) message: String,
    /// A place in the docs, if there is one.
    pub(super) see: Option<String>,
}

impl Explained {
    pub(super) fn new(message: impl Into<String>, see: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            see: Some(see.into()),
        }
    }

    /// The same, and what that means for the machine.
    pub(super) fn and(mut self, consequence: &str) -> Self {
        self.message += "; ";
        self.message += consequence;
        self
    }
}

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Explained {}

impl From<DeviceError> for Explained {
    fn from(error: DeviceError) -> Self {
        Self {
            message: error.to_string(),
            see: entry::of(&error),
        }
    }
}

impl Arguments {
    /// The board's port, if one is named.
    pub(super) fn port(&self) -> Option<&Port> {
        self.port.as_ref()
    }

    /// Opens a session. The axes of an emulated or simulated board stand where the trajectory begins.
    pub(super) fn open(&self, trajectory: Option<&Trajectory>) -> Result<Board, Failure> {
        let Some(port) = &self.port else {
            return Err(
                "no board is named: give --port; `stillpoint device ports` lists what there is, sim: is always there"
                    .into(),
            );
        };
        let first_rad = trajectory.map_or(&[][..], |t| {
            t.coefficients().get(..t.axes()).unwrap_or_default()
        });
        let line = port.open(first_rad, || simulated(trajectory));
        let line = line.map_err(|error| Explained::from(DeviceError::from(error)))?;
        let line = Faulty::new(line, self.faults.unwrap_or(Faults::NONE));
        let mut settings = Settings::default();
        if self.faults.is_some() {
            // Somebody wants to see how it gets through.
            settings.attempts = 20;
        }
        Ok(Session::open(line, settings).map_err(Explained::from)?)
    }

    /// Says on stderr what the injector has done, if there is one.
    pub(super) fn say_faults(&self, board: &Board) {
        if self.faults.is_some() {
            terminal::step(&format!(
                "faults on the line: {}",
                board.transport().injected()
            ));
        }
    }
}

fn simulated(trajectory: Option<&Trajectory>) -> Result<Box<dyn Transport>, TransportError> {
    match trajectory.map_or(3, Trajectory::axes) {
        1 => of_axes::<1>(trajectory),
        2 => of_axes::<2>(trajectory),
        3 => of_axes::<3>(trajectory),
        4 => of_axes::<4>(trajectory),
        5 => of_axes::<5>(trajectory),
        _ => of_axes::<MAX_AXES>(trajectory),
    }
}

fn of_axes<const AXES: usize>(
    trajectory: Option<&Trajectory>,
) -> Result<Box<dyn Transport>, TransportError> {
    let failed = |error: String| TransportError::Failed {
        port: "sim:".to_owned(),
        error: io::Error::other(error),
    };
    let mut first_rad = [0.0; AXES];
    if let Some(trajectory) = trajectory {
        let player = Player::<AXES>::new(trajectory).map_err(|error| failed(error.to_string()))?;
        first_rad = player.first().map_or(first_rad, |first| first.position_rad);
    }
    let board =
        Simulated::<AXES>::new(None, first_rad).map_err(|error| failed(error.to_string()))?;
    Ok(Box::new(board))
}
