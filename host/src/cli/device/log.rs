//! `stillpoint device log`

use super::line::{self, Explained};
use crate::cli::{Failure, output, terminal};
use crate::device::{DeviceError, LogImage, Port, Qemu, Session, Settings, TransportError, qemu};
use clap::Args;
use std::iter;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Show what a board logs, in words. The image has to be the one that the board runs: its build id is compared with the
/// board's.
///
/// An emulated board (`qemu:`) is started and its log is shown until Ctrl-C. The log of one that was started by hand is
/// in the file that its standard output went to. A real board logs over its debug probe, not over the serial port:
/// `cargo flash-f405`, or `probe-rs attach` with the image, shows it.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A file of what the board has logged; with --port of that board its build is checked
    #[arg(value_name = "LOG")]
    log: Option<PathBuf>,
    /// The image that the board runs; else that of the emulated board
    #[arg(long, value_name = "IMAGE")]
    image: Option<PathBuf>,
}

/// Time between two looks at the log.
const BETWEEN: Duration = Duration::from_millis(50);

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let image = arguments.image.clone().unwrap_or_else(qemu::image);
    match (&arguments.log, line.port()) {
        (Some(log), port) => {
            let bytes = std::fs::read(log).map_err(|error| format!("{}: {error}", log.display()))?;
            let image = LogImage::read(&image)?;
            if port.is_some() {
                let board = line.open(None)?;
                image.expect(board.identity().greeting.build_id)?;
            } else {
                terminal::step("no --port is named, so whether this is the board's image is not checked");
            }
            show(&image, iter::once(bytes))
        }
        (None, Some(Port::Qemu)) => follow(image),
        (None, _) => Err(Explained::new(
            "only an emulated board (--port qemu:) logs to this program; give the file that another one has logged to. A real \
             board logs over its debug probe: `cargo flash-f405` shows it",
            "docs/board.md#the-log",
        )
        .into()),
    }
}

/// Starts an emulated board and shows its log until Ctrl-C.
fn follow(image: PathBuf) -> Result<(), Failure> {
    let options = qemu::Options {
        image: Some(image.clone()),
        ..qemu::Options::default()
    };
    let board = Qemu::start(&options).map_err(TransportError::from);
    let board = board.map_err(|error| Explained::from(DeviceError::from(error)))?;
    let board = Session::open(board, Settings::default()).map_err(Explained::from)?;
    let image = LogImage::read(&image)?;
    image.expect(board.identity().greeting.build_id)?;
    let interrupted = terminal::interrupted();
    let pieces = iter::from_fn(|| {
        if interrupted.load(Ordering::Relaxed) {
            return None;
        }
        std::thread::sleep(BETWEEN);
        Some(board.transport().take_log())
    });
    show(&image, pieces)
}

fn show(image: &LogImage, pieces: impl Iterator<Item = Vec<u8>>) -> Result<(), Failure> {
    let (mut result, mut lines) = (Ok(()), 0);
    image.decode(pieces, |text| {
        lines += 1;
        if result.is_ok() {
            result = output::line(text);
        }
    });
    if lines == 0 {
        terminal::step("there is no message in the log");
    }
    result
}
