//! The command line: one file per subcommand. Results go to stdout, everything else to stderr; the exit code is 0 only
//! for success.

mod bench;
mod compare;
mod demo;
mod device;
mod export;
mod info;
mod output;
mod plan;
mod plan_with;
mod report;
mod simulate;
mod simulate_sweep;
mod terminal;
mod verify;

use crate::sptfile::{MAX_FILE_BYTES, Section, SptFile};
use clap::{Parser, Subcommand};
use serde_json::json;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use stillpoint_shared::trajectory::MAX_ENCODED_BYTES;
use stillpoint_shared::{Trajectory, TrajectoryError};

/// Plans the fastest move of a flexible machine that ends still, checks it, and plays it through the board's executor.
#[derive(Debug, Parser)]
#[command(
    name = "stillpoint",
    version,
    about,
    propagate_version = true,
    max_term_width = 100
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Plan a move and write the trajectory that the board plays
    Plan(plan::Arguments),
    /// Play a trajectory through the board's executor against the flexible machine
    Simulate(simulate::Arguments),
    /// Write a self-contained HTML report of a trajectory and its simulation
    Report(report::Arguments),
    /// Prove anew that a trajectory file keeps every limit of its move file everywhere
    Verify(verify::Arguments),
    /// Compare the plan with what a user would plan instead: duration against what is left over payloads and stiffnesses
    Compare(compare::Arguments),
    /// Show what a trajectory file contains
    Info(info::Arguments),
    /// Write a trajectory as set-points in CSV
    Export(export::Arguments),
    /// Plan, play and compare the paper's move; writes the folder stillpoint-demo
    Demo(demo::Arguments),
    /// Solve optimal control problems with known answers and print the errors
    Bench(bench::Arguments),
    /// Talk to a board: upload a trajectory, run it, watch it, stop it
    Device(device::Arguments),
}

/// An error for the user, already in words.
type Failure = Box<dyn std::error::Error>;

impl Command {
    /// Whether a failure, too, has to be one JSON object on stdout.
    fn json(&self) -> bool {
        match self {
            Self::Plan(arguments) => arguments.json,
            Self::Simulate(arguments) => arguments.json,
            Self::Verify(arguments) => arguments.json,
            Self::Compare(arguments) => arguments.json,
            Self::Info(arguments) => arguments.json,
            Self::Bench(arguments) => arguments.json,
            Self::Device(arguments) => arguments.json(),
            Self::Report(_) | Self::Export(_) | Self::Demo(_) => false,
        }
    }

    fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Plan(arguments) => plan::run(arguments),
            Self::Simulate(arguments) => simulate::run(arguments),
            Self::Report(arguments) => report::run(arguments),
            Self::Verify(arguments) => verify::run(arguments),
            Self::Compare(arguments) => compare::run(arguments),
            Self::Info(arguments) => info::run(arguments),
            Self::Export(arguments) => export::run(arguments),
            Self::Demo(arguments) => demo::run(arguments),
            Self::Bench(arguments) => bench::run(arguments),
            Self::Device(arguments) => device::run(arguments),
        }
    }
}

/// Runs the command of this process.
#[must_use]
pub fn run() -> ExitCode {
    let started = Instant::now();
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(usage) => {
            if usage.use_stderr() && std::env::args().any(|argument| argument == "--json") {
                let message = usage.render().to_string();
                let _ = output::object(&json!({"status": "error", "message": message}));
            }
            usage.exit()
        }
    };
    let Err(failure) = command.run() else {
        return ExitCode::SUCCESS;
    };
    eprintln!("error: {failure}");
    if let Some(see) = device::see(failure.as_ref()) {
        eprintln!("  see {see}");
    }
    if command.json() {
        let object = match command {
            Command::Device(_) => device::failed(failure.as_ref()),
            Command::Verify(_) => verify::failed(failure.as_ref()),
            _ => plan::failed(failure.as_ref(), started.elapsed()),
        };
        if let Err(failure) = output::object(&object) {
            eprintln!("error: {failure}");
        }
    }
    ExitCode::FAILURE
}

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[error("cannot {verb} {path}: {source}", path = path.display())]
struct FileError {
    verb: &'static str,
    path: PathBuf,
    source: std::io::Error,
}

/// A trajectory file that is damaged or something else.
#[derive(Debug, thiserror::Error)]
#[error("{path} is not a trajectory that can be used: {source}", path = path.display())]
struct TrajectoryFileError {
    path: PathBuf,
    source: TrajectoryError,
}

fn read_spt(path: &Path) -> Result<SptFile, Failure> {
    let mut bytes = Vec::new();
    // One byte more than any file has is enough to refuse one.
    let most = MAX_FILE_BYTES as u64 + 1;
    File::open(path)
        .and_then(|file| file.take(most).read_to_end(&mut bytes))
        .map_err(|source| FileError {
            verb: "read",
            path: path.to_owned(),
            source,
        })?;
    Ok(
        SptFile::decode(&bytes).map_err(|source| TrajectoryFileError {
            path: path.to_owned(),
            source,
        })?,
    )
}

/// What the board is sent of a file.
fn read_trajectory(path: &Path) -> Result<Trajectory, Failure> {
    Ok(read_spt(path)?.trajectory)
}

fn create_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path).map_err(|source| FileError {
        verb: "create",
        path: path.to_owned(),
        source,
    })
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    std::fs::write(path, bytes).map_err(|source| FileError {
        verb: "write",
        path: path.to_owned(),
        source,
    })
}

fn encode(trajectory: &Trajectory) -> Result<Vec<u8>, TrajectoryError> {
    let mut buffer = vec![0; MAX_ENCODED_BYTES];
    let length = trajectory.encode(&mut buffer)?.len();
    buffer.truncate(length);
    Ok(buffer)
}

/// A trajectory file.
fn encode_spt(trajectory: &Trajectory, section: &Section) -> Result<Vec<u8>, TrajectoryError> {
    let mut bytes = encode(trajectory)?;
    bytes.extend(section.encode());
    Ok(bytes)
}
