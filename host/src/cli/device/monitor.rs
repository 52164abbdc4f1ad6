//! `stillpoint device monitor`: telemetry as a live table, as CSV or as JSON lines.

use super::line::{self, Board, Explained};
use super::words;
use crate::cli::{Failure, terminal};
use crate::device::{Received, Transport};
use clap::Args;
use serde_json::json;
use std::io::{ErrorKind, IsTerminal, Write, stdout};
use std::sync::atomic::Ordering;
use std::time::Duration;
use stillpoint_shared::ordinal;
use stillpoint_shared::protocol::{Channels, Request, Telemetry, TelemetryConfig};
use stillpoint_shared::time::{self, TIME_TICKS_PER_SECOND};

/// Show telemetry until Ctrl-C.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Print the samples as CSV on stdout
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Samples per second
    #[arg(long, value_name = "HZ", default_value_t = 20.0)]
    rate: f64,
    /// Send a sign of life every 0.2 s, so that a move that was started with --comms hold or quick-stop goes on
    #[arg(long)]
    keep_alive: bool,
}

/// Names of the channels with values, for headings, with their units.
const NAMES: [(Channels, &str, &str); 5] = [
    (Channels::SETPOINT_POSITION, "setpoint_position", "rad"),
    (
        Channels::SETPOINT_VELOCITY,
        "setpoint_velocity",
        "rad_per_s",
    ),
    (Channels::SETPOINT_TORQUE, "setpoint_torque", "nm"),
    (Channels::MEASURED_POSITION, "measured_position", "rad"),
    (
        Channels::MEASURED_VELOCITY,
        "measured_velocity",
        "rad_per_s",
    ),
];

/// How long a sample is waited for before anything else is looked at.
const GLANCE: Duration = Duration::from_millis(100);
/// Time between two signs of life.
const BEAT: Duration = Duration::from_millis(200);
/// Longest silence besides the time between two samples.
const PATIENCE: Duration = Duration::from_secs(5);

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
    if !(arguments.rate.is_finite() && arguments.rate > 0.0) {
        return Err("--rate takes a positive number of samples per second".into());
    }
    let form = match (line.json, arguments.csv) {
        (true, _) => Form::Json,
        (_, true) => Form::Csv,
        _ if stdout().is_terminal() => Form::Live,
        _ => Form::Lines,
    };
    let mut board = line.open(None)?;
    let ticks_per_s =
        f64::from(TIME_TICKS_PER_SECOND) / f64::from(board.identity().period_ticks.max(1));
    let every_ticks = (ticks_per_s / arguments.rate)
        .round()
        .clamp(1.0, f64::from(u16::MAX));
    let telemetry = TelemetryConfig {
        every_ticks: every_ticks as u16,
        channels: Channels::ALL,
    };
    board
        .order(&Request::SetTelemetry(telemetry))
        .map_err(Explained::from)?;
    let patience = PATIENCE + Duration::from_secs_f64(every_ticks / ticks_per_s);
    let result = watch(&mut board, form, seconds, arguments.keep_alive, patience);
    // What comes out of this counts less than what came before.
    let off = board.order(&Request::SetTelemetry(TelemetryConfig::OFF));
    line.say_faults(&board);
    result?;
    Ok(off.map_err(Explained::from)?)
}

fn watch(
    board: &mut Board,
    form: Form,
    seconds: Option<Duration>,
    keep_alive: bool,
    patience: Duration,
) -> Result<(), Failure> {
    let interrupted = terminal::interrupted();
    let began = board.transport().now();
    let (mut beat, mut heard, mut lines, mut lost) = (began, began, 0, 0u64);
    let mut first = true;
    while !interrupted.load(Ordering::Relaxed) {
        let now = board.transport().now();
        if seconds.is_some_and(|seconds| now - began >= seconds) {
            break;
        }
        if keep_alive && now >= beat {
            board.order(&Request::KeepAlive).map_err(Explained::from)?;
            beat = now + BEAT;
        }
        let Some(received) = board.telemetry(GLANCE).map_err(Explained::from)? else {
            if board.transport().now() - heard > patience {
                return Err(format!(
                    "no telemetry came for {:.1} s: the board was restarted, or somebody else has connected to it",
                    patience.as_secs_f64()
                )
                .into());
            }
            continue;
        };
        heard = board.transport().now();
        lost += u64::from(received.lost);
        let text = match form {
            Form::Json => format!("{}\n", object(&received)),
            Form::Csv if first => heading(&received.telemetry) + &row(&received, ","),
            Form::Csv => row(&received, ","),
            Form::Lines => brief(&received.telemetry),
            Form::Live => {
                let table = table(&received.telemetry, lost);
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

/// Writes; false where the reader has seen enough.
fn shown(text: &str) -> Result<bool, Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(format!("cannot write to standard output: {error}").into()),
        Ok(()) => Ok(true),
    }
}

fn heading(sample: &Telemetry) -> String {
    let mut text = "tick,state,path_s,path_speed,dropped,lost".to_owned();
    for (channel, name, unit) in NAMES {
        for axis in 0..sample.channel(channel).len() {
            text += &format!(",{name}_{}_{unit}", ordinal(axis));
        }
    }
    for axis in 0..sample.limited.len() {
        text += &format!(",limited_{}", ordinal(axis));
    }
    text + "\n"
}

fn row(received: &Received, separator: &str) -> String {
    let sample = &received.telemetry;
    let mut cells = vec![
        sample.tick.to_string(),
        format!("{:?}", sample.state),
        time::seconds(sample.path_ticks).to_string(),
        sample.path_speed.to_string(),
        sample.dropped.to_string(),
        received.lost.to_string(),
    ];
    for (channel, ..) in NAMES {
        // Nothing where nothing was measured.
        cells.extend(sample.channel(channel).iter().map(|value| {
            if value.is_nan() {
                String::new()
            } else {
                value.to_string()
            }
        }));
    }
    cells.extend(sample.limited.iter().map(|flags| flags.bits().to_string()));
    cells.join(separator) + "\n"
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
        "limited": sample.limited.iter().map(|&flags| words::limits(flags)).collect::<Vec<_>>(),
    });
    for (channel, name, unit) in NAMES {
        object[format!("{name}_{unit}")] = json!(sample.channel(channel));
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
    for value in sample.channel(Channels::MEASURED_POSITION) {
        text += &format!("  {value:>10.6} rad");
    }
    text + "\n"
}

fn table(sample: &Telemetry, lost: u64) -> String {
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
    for (axis, flags) in sample.limited.iter().enumerate() {
        let wanted = of(Channels::SETPOINT_POSITION, axis);
        let measured = of(Channels::MEASURED_POSITION, axis);
        text += &format!(
            "{:>4} {wanted:>15.6} {measured:>14.6} {:>13.2e} {:>13.4} {:>13.3}  {}\n",
            ordinal(axis),
            wanted - measured,
            of(Channels::MEASURED_VELOCITY, axis),
            of(Channels::SETPOINT_TORQUE, axis),
            words::limits(*flags).join(", ")
        );
    }
    text
}
