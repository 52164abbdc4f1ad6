//! `stillpoint export F.spt --csv --rate HZ`

use super::{Failure, output, read_trajectory, write_file};
use clap::Args;
use std::fmt::Write;
use std::path::PathBuf;
use stillpoint_shared::{Player, Trajectory, TrajectoryError, time};

/// Write set-points.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// Comma-separated values: time, then position, velocity and torque of every axis
    #[arg(long, required = true)]
    csv: bool,
    /// Set-points per second; the end of the move is always the last line
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: f64,
    /// Where to write them [default: stdout]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Highest rate: one set-point per tick of the trajectory's clock.
fn rate(text: &str) -> Result<f64, String> {
    let highest = f64::from(time::TIME_TICKS_PER_SECOND);
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= highest => Ok(value),
        Ok(value) => Err(format!(
            "{value} Hz: the rate must be positive and at most {highest} Hz"
        )),
        Err(_) => Err("the rate must be a number of hertz".to_owned()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let trajectory = read_trajectory(&arguments.trajectory)?;
    let text = match trajectory.axes() {
        1 => csv::<1>(&trajectory, arguments.rate),
        2 => csv::<2>(&trajectory, arguments.rate),
        3 => csv::<3>(&trajectory, arguments.rate),
        4 => csv::<4>(&trajectory, arguments.rate),
        5 => csv::<5>(&trajectory, arguments.rate),
        _ => csv::<6>(&trajectory, arguments.rate),
    }?;
    match &arguments.out {
        Some(path) => write_file(path, text.as_bytes())?,
        None => output::text(&text)?,
    }
    Ok(())
}

fn csv<const AXES: usize>(
    trajectory: &Trajectory,
    rate_hz: f64,
) -> Result<String, TrajectoryError> {
    const UNITS: [&str; 3] = ["position_rad", "velocity_rad_per_s", "torque_nm"];
    let player = Player::<AXES>::new(trajectory)?;
    let mut text = String::from("time_s");
    for unit in UNITS {
        for axis in 1..=AXES {
            text += &format!(",{unit}_{axis}");
        }
    }
    text.push('\n');
    let per_point = f64::from(time::TIME_TICKS_PER_SECOND) / rate_hz;
    let end = trajectory.duration_ticks();
    let mut index = 0_u32;
    loop {
        // Saturates at the end.
        let ticks = ((f64::from(index) * per_point).round() as u32).min(end);
        let Some(sample) = player.sample(ticks) else {
            break;
        };
        // Writing to a string cannot fail.
        let _ = write!(text, "{:.7}", time::seconds(ticks));
        for channel in [
            sample.position_rad,
            sample.velocity_rad_per_s,
            sample.torque_nm,
        ] {
            for value in channel {
                let _ = write!(text, ",{value}");
            }
        }
        text.push('\n');
        if ticks == end {
            break;
        }
        index += 1;
    }
    Ok(text)
}
