//! Telemetry as numbers in rows: which channels, how often, and the columns of CSV.

use super::line::Board;
use crate::device::Received;
use clap::ValueEnum;
use stillpoint_shared::ordinal;
use stillpoint_shared::protocol::{Channels, TelemetryConfig};
use stillpoint_shared::time::{self, TIME_TICKS_PER_SECOND};

/// Names of the channels with values, for headings, with their units.
pub(super) const NAMES: [(Channels, &str, &str); 5] = [
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

/// A channel by the name that its columns have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(super) enum Channel {
    /// Position set-points in rad
    SetpointPosition,
    /// Velocity set-points in rad/s
    SetpointVelocity,
    /// Torque set-points in N·m
    SetpointTorque,
    /// Measured positions in rad
    MeasuredPosition,
    /// Measured velocities in rad/s
    MeasuredVelocity,
    /// Limits in force, as bits
    Limited,
}

/// The channels somebody has named; all if none.
pub(super) fn chosen(channels: &[Channel]) -> Channels {
    let chosen = channels.iter().map(|channel| match channel {
        Channel::SetpointPosition => Channels::SETPOINT_POSITION,
        Channel::SetpointVelocity => Channels::SETPOINT_VELOCITY,
        Channel::SetpointTorque => Channels::SETPOINT_TORQUE,
        Channel::MeasuredPosition => Channels::MEASURED_POSITION,
        Channel::MeasuredVelocity => Channels::MEASURED_VELOCITY,
        Channel::Limited => Channels::LIMITS,
    });
    chosen.reduce(|all, one| all | one).unwrap_or(Channels::ALL)
}

/// Samples per second, as somebody types them.
pub(super) fn rate_hz(text: &str) -> Result<f64, String> {
    let rate_hz = text
        .parse()
        .ok()
        .filter(|rate_hz: &f64| rate_hz.is_finite());
    rate_hz
        .filter(|&rate_hz| rate_hz > 0.0)
        .ok_or_else(|| "a positive number of samples per second is needed".to_owned())
}

/// Drive ticks of a board per second.
pub(super) fn ticks_per_s(board: &Board) -> f64 {
    f64::from(TIME_TICKS_PER_SECOND) / f64::from(board.identity().period_ticks.max(1))
}

/// What a board is told to send: as near to the rate as its ticks allow.
pub(super) fn telemetry(board: &Board, rate_hz: f64, channels: Channels) -> TelemetryConfig {
    let every_ticks = (ticks_per_s(board) / rate_hz).round();
    TelemetryConfig {
        every_ticks: every_ticks.clamp(1.0, f64::from(u16::MAX)) as u16,
        channels,
    }
}

/// The line above the rows.
pub(super) fn heading(channels: Channels, axes: u8) -> String {
    let mut text = "tick,state,path_s,path_speed,dropped,lost".to_owned();
    for (channel, name, unit) in NAMES {
        if channels.contains(channel) {
            for axis in 0..axes {
                text += &format!(",{name}_{}_{unit}", ordinal(axis));
            }
        }
    }
    if channels.contains(Channels::LIMITS) {
        for axis in 0..axes {
            text += &format!(",limited_{}", ordinal(axis));
        }
    }
    text + "\n"
}

/// A sample as a row.
pub(super) fn row(received: &Received) -> String {
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
    cells.join(",") + "\n"
}
