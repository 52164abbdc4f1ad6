//! States, hashes and times as text and as JSON.

use serde_json::{Value, json};
use stillpoint_shared::protocol::{AxisStatus, Status};
use stillpoint_shared::status::LimitFlags;
use stillpoint_shared::{ordinal, time};

/// A hash as everywhere: 16 hexadecimal digits.
pub(super) fn hash(hash: u64) -> String {
    format!("{hash:016x}")
}

/// The hash of a machine's limits; a board that knows none yet gives 0.
pub(super) fn limits_hash(limits_hash: u64) -> Option<String> {
    (limits_hash != 0).then(|| hash(limits_hash))
}

/// The same for people.
pub(super) fn limits_or_none(hash: u64) -> String {
    limits_hash(hash).unwrap_or_else(|| "none yet".to_owned())
}

/// Whether the drives are on, in words.
pub(super) fn drives(status: &Status) -> String {
    let on = status.state.is_energised() && !status.dry_run;
    let switch = if on { "on" } else { "off" };
    format!("the drives are {switch} (state {:?})", status.state)
}

/// Names of limits in force.
pub(super) fn limits(flags: LimitFlags) -> Vec<String> {
    let names = format!("{flags:?}");
    let inner = names.trim_matches(['{', '}']);
    inner
        .split(", ")
        .map(|name| name.trim_matches('"').to_owned())
        .filter(|name| !name.is_empty())
        .collect()
}

/// The status as one JSON object.
pub(super) fn status_object(status: &Status) -> Value {
    let axes: Vec<Value> = status.axes.iter().map(axis_object).collect();
    let link = &status.link;
    json!({
        "status": "done",
        "state": format!("{:?}", status.state),
        "held_by": status.held_by.map(|reason| format!("{reason:?}")),
        "fault": status.fault.map(|fault| json!({"tick": fault.tick, "message": fault.cause.to_string()})),
        "tick": status.tick,
        "path_s": time::seconds(status.path_ticks),
        "duration_s": time::seconds(status.duration_ticks),
        "loaded": status.loaded.map(hash),
        "limits_hash": limits_hash(status.limits_hash),
        "override_percent": status.override_percent,
        "dry_run": status.dry_run,
        "axes": axes,
        "upload": {"blocks": status.upload.blocks, "missing": status.upload.missing()},
        "link": {
            "requests": link.requests,
            "damaged": link.damaged,
            "overrun_bytes": link.overrun_bytes,
            "repeated": link.repeated,
            "dropped": link.dropped,
        },
    })
}

fn axis_object(axis: &AxisStatus) -> Value {
    json!({
        "drive": axis.drive.map(|drive| drive.to_string()),
        "measured_rad": axis.measured_rad,
        "following_peak_rad": axis.following_peak_rad,
        "limited": limits(axis.limited),
    })
}

/// The axes, a line each.
pub(super) fn axes(status: &Status) -> String {
    let mut text = String::new();
    for (index, axis) in status.axes.iter().enumerate() {
        let drive = match axis.drive {
            Some(drive) => format!("drive {drive}"),
            None => "no drive".to_owned(),
        };
        let measured = match axis.measured_rad {
            Some(rad) => format!("at {rad:.6} rad"),
            None => "not heard".to_owned(),
        };
        let limited = limits(axis.limited);
        let limited = if limited.is_empty() {
            "none".to_owned()
        } else {
            limited.join(", ")
        };
        text += &format!(
            "  axis {}: {measured}, {drive}; largest following error {:.2e} rad, limits reached: {limited}\n",
            ordinal(index),
            axis.following_peak_rad
        );
    }
    text
}
