//! `stillpoint device monitor`: telemetry as a live table, as CSV or as JSON lines.

use super::line::{self, Board, Explained};
use super::samples::{self, Channel, NAMES};
use super::words;
use crate::cli::{Failure, terminal};
use crate::device::{DeviceError, Received, Transport};
use clap::Args;
use serde_json::json;
use std::io::{ErrorKind, IsTerminal, Write, stdout};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;
use stillpoint_shared::ordinal;
use stillpoint_shared::protocol::{Channels, Request, Telemetry, TelemetryConfig};
use stillpoint_shared::time;

/// Show telemetry until Ctrl-C. A line that fails is looked for again, ten times.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Print the samples as CSV on stdout
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Samples per second
    #[arg(long, value_name = "HZ", default_value_t = 20.0, value_parser = samples::rate_hz)]
    rate: f64,
    /// What the samples carry; all if none is named. Fewer leave the line more room
    #[arg(long, value_name = "NAME,NAME", value_enum, value_delimiter = ',')]
    channels: Vec<Channel>,
    /// Send a sign of life every 0.2 s, so that a move that was started with --comms hold or quick-stop goes on
    #[arg(long)]
    keep_alive: bool,
}

/// How long a sample is waited for before anything else is looked at.
const GLANCE: Duration = Duration::from_millis(100);
/// Time between two signs of life.
const BEAT: Duration = Duration::from_millis(200);
/// Longest silence besides the time between two samples.
const PATIENCE: Duration = Duration::from_secs(5);

/// Times a board is looked for without a sample in between.
const TRIES: u32 = 10;
/// Time between two of them: a cable is plugged in again within all.
const BETWEEN_TRIES: Duration = Duration::from_secs(1);

/// How samples are shown.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Live,
    Lines,
    Csv,
    Json,
}

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let seconds = arguments
        .seconds
        .map(Duration::try_from_secs_f64)
        .transpose();
    let seconds = seconds.map_err(|_| "--seconds takes a number of seconds from 0 on")?;
    let form = match (line.json, arguments.csv) {
        (true, _) => Form::Json,
        (_, true) => Form::Csv,
        _ if stdout().is_terminal() => Form::Live,
        _ => Form::Lines,
    };
    let mut board = line.open(None)?;
    let channels = samples::chosen(&arguments.channels);
    let telemetry = samples::telemetry(&board, arguments.rate, channels);
    board
        .order(&Request::SetTelemetry(telemetry))
        .map_err(Explained::from)?;
    let between_s = f64::from(telemetry.every_ticks) / samples::ticks_per_s(&board);
    let patience = PATIENCE + Duration::from_secs_f64(between_s);
    let watch = Watch {
        telemetry,
        form,
        seconds,
        keep_alive: arguments.keep_alive,
        patience,
    };
    let result = watch.show(&mut board);
    // What comes out of this counts less than what came before.
    let off = board.order(&Request::SetTelemetry(TelemetryConfig::OFF));
    line.say_faults(&board);
    result?;
    Ok(off.map_err(Explained::from)?)
}

/// What is watched, and how it is shown.
struct Watch {
    telemetry: TelemetryConfig,
    form: Form,
    seconds: Option<Duration>,
    keep_alive: bool,
    patience: Duration,
}

impl Watch {
    fn show(&self, board: &mut Board) -> Result<(), Failure> {
        let interrupted = terminal::interrupted();
        let began = board.transport().now();
        let (mut beat, mut heard, mut lines, mut lost) = (began, began, 0, 0u64);
        let (mut first, mut tries) = (true, 0);
        while !interrupted.load(Ordering::Relaxed) {
            let now = board.transport().now();
            if self.seconds.is_some_and(|seconds| now - began >= seconds) {
                break;
            }
            let alive = if self.keep_alive && now >= beat {
                beat = now + BEAT;
                board.order(&Request::KeepAlive)
            } else {
                Ok(())
            };
            let received = match alive.and_then(|()| board.telemetry(GLANCE)) {
                Ok(Some(received)) => received,
                Ok(None) if board.transport().now() - heard > self.patience => {
                    return Err(format!(
                        "no telemetry came for {:.1} s: the board was restarted, or somebody else has connected to it",
                        self.patience.as_secs_f64()
                    )
                    .into());
                }
                Ok(None) => continue,
                Err(error) => {
                    self.connect_anew(board, error, &mut tries)?;
                    (heard, lines) = (board.transport().now(), 0);
                    continue;
                }
            };
            (heard, tries) = (board.transport().now(), 0);
            lost += u64::from(received.lost);
            let text = match self.form {
                Form::Json => format!("{}\n", object(&received)),
                Form::Csv => {
                    let head = if first {
                        let axes = board.identity().axes;
                        samples::heading(received.telemetry.channels, axes)
                    } else {
                        String::new()
                    };
                    head + &samples::row(&received)
                }
                Form::Lines => brief(&received.telemetry),
                Form::Live => {
                    let table = table(&received.telemetry, lost, board.identity().axes.into());
                    let up = if lines > 0 {
                        format!("\x1b[{lines}A\x1b[J")
                    } else {
                        String::new()
                    };
                    lines = table.lines().count();
                    up + &table
                }
            };
            first = false;
            if !shown(&text)? {
                break;
            }
        }
        Ok(())
    }

    /// Looks for a board that is out of reach, and has it send samples again. Nothing that moves is ordered: what a hold
    /// has stopped meanwhile stays where it is.
    fn connect_anew(
        &self,
        board: &mut Board,
        mut error: DeviceError,
        tries: &mut u32,
    ) -> Result<(), Failure> {
        let interrupted = terminal::interrupted();
        while error.is_out_of_reach() && *tries < TRIES {
            if *tries > 0 {
                thread::sleep(BETWEEN_TRIES);
            }
            if interrupted.load(Ordering::Relaxed) {
                return Ok(());
            }
            *tries += 1;
            terminal::step(&format!("{error}; connecting anew ({tries} of {TRIES})"));
            let connected = board.reconnect().map(drop);
            match connected.and_then(|()| board.order(&Request::SetTelemetry(self.telemetry))) {
                Ok(()) => {
                    terminal::step("connected again; samples between are missing");
                    return Ok(());
                }
                Err(failed) => error = failed,
            }
        }
        Err(Explained::from(error).into())
    }
}

/// Writes; false where the reader has seen enough.
fn shown(text: &str) -> Result<bool, Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(format!("cannot write to standard output: {error}").into()),
        Ok(()) => Ok(true),
    }
}

fn object(received: &Received) -> serde_json::Value {
    let sample = &received.telemetry;
    let mut object = json!({
        "tick": sample.tick,
        "state": format!("{:?}", sample.state),
        "path_s": time::seconds(sample.path_ticks),
        "path_speed": sample.path_speed,
        "dropped": sample.dropped,
        "lost": received.lost,
    });
    if sample.channels.contains(Channels::LIMITS) {
        let limited = sample.limited.iter().map(|&flags| words::limits(flags));
        object["limited"] = limited.collect();
    }
    for (channel, name, unit) in NAMES {
        if sample.channels.contains(channel) {
            object[format!("{name}_{unit}")] = json!(sample.channel(channel));
        }
    }
    object
}

fn brief(sample: &Telemetry) -> String {
    let mut text = format!(
        "{:>10}  {:<8} {:>10.4} ms",
        sample.tick,
        format!("{:?}", sample.state),
        time::seconds(sample.path_ticks) * 1e3
    );
    // One channel fits a line: where the axes are, or else the first that was chosen.
    let chosen = |(channel, ..): &&(Channels, &str, &str)| sample.channels.contains(*channel);
    let measured = NAMES
        .iter()
        .filter(chosen)
        .find(|(channel, ..)| *channel == Channels::MEASURED_POSITION);
    if let Some((channel, _, unit)) = measured.or_else(|| NAMES.iter().find(chosen)) {
        for value in sample.channel(*channel) {
            text += &format!("  {value:>10.6} {unit}");
        }
    }
    text + "\n"
}

fn table(sample: &Telemetry, lost: u64, axes: usize) -> String {
    let mut text = format!(
        "{:?}  {:.4} ms  speed {:.0} %  tick {}  dropped {}  lost {lost}\n\
         axis   set-point/rad   measured/rad     error/rad   speed/rad/s    torque/N·m  limits\n",
        sample.state,
        time::seconds(sample.path_ticks) * 1e3,
        sample.path_speed * 100.0,
        sample.tick,
        sample.dropped,
    );
    let of = |channel, axis| {
        let values: &[f32] = sample.channel(channel);
        values.get(axis).copied().unwrap_or(f32::NAN)
    };
    for axis in 0..axes {
        let limits = match sample.limited.get(axis) {
            Some(&flags) => words::limits(flags).join(", "),
            None => "–".to_owned(),
        };
        let wanted = of(Channels::SETPOINT_POSITION, axis);
        let measured = of(Channels::MEASURED_POSITION, axis);
        text += &format!(
            "{:>4} {wanted:>15.6} {measured:>14.6} {:>13.2e} {:>13.4} {:>13.3}  {limits}\n",
            ordinal(axis),
            wanted - measured,
            of(Channels::MEASURED_VELOCITY, axis),
            of(Channels::SETPOINT_TORQUE, axis),
        );
    }
    text
}
