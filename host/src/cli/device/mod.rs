//! `stillpoint device …`: what a board can be told and asked. One file per group of orders.

mod config;
mod drives_file;
mod entry;
mod fault;
mod hello;
mod line;
mod log;
mod monitor;
mod orders;
mod ports;
mod record;
mod run;
mod samples;
mod start;
mod status;
mod store;
mod upload;
mod words;

use super::{Failure, TrajectoryFileError};
use clap::{Args, Subcommand};
use line::Explained;
use serde_json::{Value, json};

/// Talk to a board.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    line: line::Arguments,
    #[command(subcommand)]
    order: Order,
}

#[derive(Debug, Subcommand)]
enum Order {
    /// List the ports of this computer
    Ports,
    /// Ask who is there: board, firmware, capacities, what is loaded and stored
    Hello,
    /// Ask how things are; counts as a sign of life
    Status,
    /// Show the machine's limits and the board's settings, or change them
    Config(config::Arguments),
    /// Upload a trajectory; the board checks it and loads it, or refuses it
    Upload(upload::Arguments),
    /// Switch the drives on and creep to where the move starts
    Arm,
    /// Switch the drives off, at rest
    Disarm,
    /// Start the move that is loaded
    Start(start::Arguments),
    /// Slow down along the path and stand still; resume goes on
    Hold,
    /// Go on after a hold
    Resume,
    /// Play at a part of the planned speed
    Override(orders::Override),
    /// Quick stop: slow down along the path, then take the torque away
    Stop,
    /// Leave a fault
    Clear,
    /// Limits, upload, arm, start, wait for the end and report, all in one
    Run(run::Arguments),
    /// Show the samples of the drive loop as they come; no sign of life by itself
    Monitor(monitor::Arguments),
    /// Show the fault record: the first cause and the last second before it
    Fault(fault::Arguments),
    /// Show what the board logs, in words
    Log(log::Arguments),
    /// Keep the loaded trajectory over a loss of power
    Store,
    /// List the stored trajectories
    List,
    /// Load a stored trajectory
    Load(store::Load),
    /// Forget a stored trajectory, or all
    Erase(store::Erase),
}

impl Arguments {
    /// Whether a failure, too, has to be one JSON object on stdout.
    pub(super) fn json(&self) -> bool {
        self.line.json
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let line = &arguments.line;
    match &arguments.order {
        Order::Ports => ports::run(line),
        Order::Hello => hello::run(line),
        Order::Status => status::run(line),
        Order::Config(arguments) => config::run(line, arguments),
        Order::Upload(arguments) => upload::run(line, arguments),
        Order::Arm => orders::arm(line),
        Order::Disarm => orders::disarm(line),
        Order::Start(arguments) => start::run(line, arguments),
        Order::Hold => orders::hold(line),
        Order::Resume => orders::resume(line),
        Order::Override(arguments) => orders::override_speed(line, arguments),
        Order::Stop => orders::stop(line),
        Order::Clear => orders::clear(line),
        Order::Run(arguments) => run::run(line, arguments),
        Order::Monitor(arguments) => monitor::run(line, arguments),
        Order::Fault(arguments) => fault::run(line, arguments),
        Order::Log(arguments) => log::run(line, arguments),
        Order::Store => store::store(line),
        Order::List => store::list(line),
        Order::Load(arguments) => store::load(line, arguments),
        Order::Erase(arguments) => store::erase(line, arguments),
    }
}

/// A failure as JSON: in the same words, and where they are explained.
pub(super) fn failed(failure: &(dyn std::error::Error + 'static)) -> Value {
    json!({"status": "error", "message": failure.to_string(), "see": see(failure)})
}

/// Where a failure is explained, if it is.
pub(super) fn see(failure: &(dyn std::error::Error + 'static)) -> Option<String> {
    if let Some(Explained { see, .. }) = failure.downcast_ref() {
        return see.clone();
    }
    let TrajectoryFileError { source, .. } = failure.downcast_ref()?;
    Some(entry::of_trajectory(source))
}
