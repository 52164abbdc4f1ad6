//! The way to an emulated board that this process has started.

use super::qemu::{Options, Qemu, QemuError};
use super::transport::{Transport, TransportError};
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};
use stillpoint_firmware::bench::{Action, MAX_ACTION_BYTES};

/// Longest time to wait for bytes to be taken.
const PATIENCE: Duration = Duration::from_secs(5);

/// An emulated board; it ends when this is dropped.
#[derive(Debug)]
pub struct Emulated {
    board: Qemu,
    opened: Instant,
}

impl Emulated {
    /// Starts a board whose axes stand at these positions in rad.
    ///
    /// # Errors
    /// Says what to install or build if something is missing.
    pub fn start(position_rad: &[f32]) -> Result<Self, QemuError> {
        let bench = !position_rad.is_empty();
        let options = Options {
            bench,
            ..Options::default()
        };
        let board = Qemu::start(&options)?;
        if let Some(mut bench) = board.bench() {
            drain(bench.try_clone()?);
            for (axis, &position_rad) in (0..).zip(position_rad) {
                let turn = Action::Turn { axis, position_rad };
                bench.write_all(turn.encode(&mut [0; MAX_ACTION_BYTES]))?;
            }
        }
        board.port().set_write_timeout(Some(PATIENCE))?;
        let opened = Instant::now();
        Ok(Self { board, opened })
    }
}

/// The bench tells every tick and waits for nobody to listen; here nobody does.
fn drain(mut bench: TcpStream) {
    thread::spawn(move || {
        let mut buffer = [0; 4096];
        while matches!(bench.read(&mut buffer), Ok(1..)) {}
    });
}

fn failed(error: io::Error) -> TransportError {
    let port = "qemu:".to_owned();
    match error.kind() {
        ErrorKind::ConnectionReset
        | ErrorKind::ConnectionAborted
        | ErrorKind::BrokenPipe
        | ErrorKind::UnexpectedEof => TransportError::Closed { port },
        _ => TransportError::Failed { port, error },
    }
}

impl Transport for Emulated {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.board.write_all(bytes).map_err(failed)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        // Zero would mean for ever.
        let timeout = timeout.max(Duration::from_millis(1));
        let set = self.board.port().set_read_timeout(Some(timeout));
        set.map_err(failed)?;
        match self.board.read(buffer) {
            Ok(0) if !buffer.is_empty() => Err(failed(ErrorKind::UnexpectedEof.into())),
            Ok(bytes) => Ok(bytes),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(0),
                _ => Err(failed(error)),
            },
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    /// The line to the board is this process's own: it is there as long as the board is.
    fn reconnect(&mut self) -> Result<(), TransportError> {
        Ok(())
    }
}
