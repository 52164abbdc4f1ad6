//! A file with the drives' configuration.
//!
//! The types are the board's, which reads every key it knows and no other from the wire. In a file a key that nobody reads
//! is a slip of the fingers, so that it is an error here: the shapes below are those of the board's types, compared by the
//! compiler, and strict.

use super::entry;
use super::line::Explained;
use serde::Deserialize;
use std::path::Path;
use stillpoint_shared::DriveConfig;
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, Mapping};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drives {
    #[serde(with = "Bus")]
    bus: BusConfig,
    axes: Vec<Axis>,
}

#[derive(Deserialize)]
#[serde(remote = "BusConfig", deny_unknown_fields)]
struct Bus {
    period_us: u16,
    bit_rate_kbit_per_s: u16,
    heartbeat_ms: u16,
    heartbeat_timeout_ms: u16,
    controller_node: u8,
}

#[derive(Deserialize)]
#[serde(transparent)]
struct Axis(#[serde(with = "Drive")] AxisDrive);

#[derive(Deserialize)]
#[serde(remote = "AxisDrive", deny_unknown_fields)]
struct Drive {
    bus: u8,
    node: u8,
    counts_per_turn: f64,
    reversed: bool,
    home_counts: i32,
    home_rad: f32,
    gear_ratio: f32,
    rated_torque_nm: f32,
    torque_limit_permille: u16,
    mapping: Mapping,
    tells_following: bool,
}

/// The configuration that a file's text describes, or what is wrong with it, with file, line and key.
pub(super) fn parse(path: &Path, text: &str) -> Result<DriveConfig, Explained> {
    let Drives { bus, axes } = toml::from_str(text).map_err(|error| {
        Explained::new(
            format!("{}: {}", path.display(), error.to_string().trim_end()),
            entry::of_symptom("drive-configuration"),
        )
    })?;
    let axes: Vec<AxisDrive> = axes.into_iter().map(|Axis(drive)| drive).collect();
    DriveConfig::new(bus, &axes).map_err(|error| {
        Explained::new(
            format!("{}: {error}", path.display()),
            entry::of_drives(&error),
        )
    })
}
