//! `stillpoint device hello`

use super::{line, words};
use crate::cli::{Failure, output};
use serde_json::json;
use stillpoint_shared::protocol::Versions;
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

pub(super) fn run(line: &line::Arguments) -> Result<(), Failure> {
    let board = line.open(None)?;
    line.say_faults(&board);
    let identity = board.identity();
    let (greeting, fits) = (&identity.greeting, &identity.capacities);
    let period_ticks = identity.period_ticks.max(1);
    let rate_hz = f64::from(TIME_TICKS_PER_SECOND) / f64::from(period_ticks);
    let stored: Vec<_> = identity
        .stored
        .iter()
        .map(|&hash| words::hash(hash))
        .collect();
    if line.json {
        return output::object(&json!({
            "status": "done",
            "board": greeting.board.as_str(),
            "firmware": greeting.firmware.as_str(),
            "build_id": words::hash(greeting.build_id),
            "protocol": greeting.versions.to_string(),
            "own_protocol": Versions::OWN.to_string(),
            "axes": identity.axes,
            "tick_rate_hz": rate_hz,
            "state": format!("{:?}", identity.state),
            "limits_hash": words::limits_hash(identity.limits_hash),
            "loaded": identity.loaded.map(words::hash),
            "stored": stored,
            "capacities": {
                "intervals": fits.intervals,
                "points": fits.points,
                "bases": fits.bases,
                "coefficients": fits.coefficients,
                "window": fits.window,
                "stored": fits.stored,
                "store_bytes": fits.store_bytes,
            },
        }));
    }
    output::text(&format!(
        "{} {}, build {}\n  protocol {}, this program {}\n  {} axes, {rate_hz} Hz, {:?}\n  limits {}\n  loaded: {}\n  stored: {}\n  \
         fits: {} values in {} intervals of up to {} points; {} moves in {} bytes of store\n",
        greeting.board,
        greeting.firmware,
        words::hash(greeting.build_id),
        greeting.versions,
        Versions::OWN,
        identity.axes,
        identity.state,
        words::limits_or_none(identity.limits_hash),
        identity
            .loaded
            .map_or_else(|| "nothing".to_owned(), words::hash),
        if stored.is_empty() {
            "nothing".to_owned()
        } else {
            stored.join(", ")
        },
        fits.coefficients,
        fits.intervals,
        fits.points,
        fits.stored,
        fits.store_bytes,
    ))
}
