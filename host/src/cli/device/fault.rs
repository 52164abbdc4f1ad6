//! `stillpoint device fault`

use super::line::{self, Explained};
use super::{entry, words};
use crate::cli::{Failure, output};
use crate::device::FaultReport;
use clap::Args;
use serde_json::{Value, json};
use stillpoint_shared::ordinal;
use stillpoint_shared::protocol::FaultSample;
use stillpoint_shared::time;

/// Samples shown where nobody asks for all.
const SHOWN: usize = 10;

/// Show the fault record.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Print all samples of the last second as CSV on stdout
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

pub(super) fn run(line: &line::Arguments, arguments: &Arguments) -> Result<(), Failure> {
    let mut board = line.open(None)?;
    let report = board.fault_report().map_err(Explained::from)?;
    line.say_faults(&board);
    if line.json {
        return output::object(&object(report.as_ref()));
    }
    let Some(report) = report else {
        return if arguments.csv {
            Err("there is no fault in the record, so there are no samples".into())
        } else {
            output::line("no fault in the record")
        };
    };
    output::text(&if arguments.csv {
        csv(&report)
    } else {
        text(&report)
    })
}

fn text(report: &FaultReport) -> String {
    let head = &report.head;
    let mut text = format!(
        "{}\n  see {}\n  trajectory {}, recorded by build {}, {} samples{}\n",
        head.fault,
        entry::of_fault(&head.fault.cause),
        words::hash(head.trajectory_hash),
        words::hash(head.build_id),
        report.samples.len(),
        if report.samples.len() > SHOWN {
            ", the last ones (--csv for all):"
        } else {
            ""
        },
    );
    let first = report.samples.len().saturating_sub(SHOWN);
    for sample in report.samples.get(first..).unwrap_or_default() {
        text += &format!(
            "  tick {:>10}  {:>9.4} ms  {:<8}",
            sample.tick,
            time::seconds(sample.path_ticks) * 1e3,
            state(sample)
        );
        for axis in &sample.axes {
            text += &format!(
                "  {:>10.2e} rad {:>9.3} rad/s {:>9.3} N·m",
                axis.following_error_rad, axis.velocity_rad_per_s, axis.torque_nm
            );
        }
        text += "\n";
    }
    text
}

fn state(sample: &FaultSample) -> String {
    sample
        .state
        .map_or_else(|| "?".to_owned(), |state| format!("{state:?}"))
}

fn csv(report: &FaultReport) -> String {
    let mut text = "tick,path_s,state,limited,path_speed,age_ticks".to_owned();
    let axes = report.samples.first().map_or(0, |sample| sample.axes.len());
    for axis in 0..axes {
        let axis = ordinal(axis);
        text += &format!(",following_error_{axis}_rad,velocity_{axis}_rad_per_s,torque_{axis}_nm");
    }
    text += "\n";
    for sample in &report.samples {
        text += &format!(
            "{},{},{},{},{},{}",
            sample.tick,
            time::seconds(sample.path_ticks),
            state(sample),
            sample.limited.bits(),
            f64::from(sample.path_speed) / 255.0,
            sample.age_ticks
        );
        for axis in &sample.axes {
            text += &format!(
                ",{},{},{}",
                axis.following_error_rad, axis.velocity_rad_per_s, axis.torque_nm
            );
        }
        text += "\n";
    }
    text
}

fn object(report: Option<&FaultReport>) -> Value {
    let Some(report) = report else {
        return json!({"status": "done", "fault": null});
    };
    let head = &report.head;
    let samples: Vec<Value> = report.samples.iter().map(sample_object).collect();
    json!({
        "status": "done",
        "fault": {
            "message": head.fault.cause.to_string(),
            "tick": head.fault.tick,
            "see": entry::of_fault(&head.fault.cause),
            "build_id": words::hash(head.build_id),
            "trajectory_hash": words::hash(head.trajectory_hash),
            "period_s": time::seconds(head.period_ticks),
            "samples": samples,
        },
    })
}

fn sample_object(sample: &FaultSample) -> Value {
    let axes: Vec<Value> = (sample.axes.iter())
        .map(|axis| {
            json!({
                "following_error_rad": axis.following_error_rad,
                "velocity_rad_per_s": axis.velocity_rad_per_s,
                "torque_nm": axis.torque_nm,
            })
        })
        .collect();
    json!({
        "tick": sample.tick,
        "path_s": time::seconds(sample.path_ticks),
        "state": state(sample),
        "limited": words::limits(sample.limited),
        "path_speed": f64::from(sample.path_speed) / 255.0,
        "age_ticks": sample.age_ticks,
        "axes": axes,
    })
}
