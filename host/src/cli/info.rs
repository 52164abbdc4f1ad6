//! `stillpoint info F.spt`

use super::{Failure, encode, output, read_spt};
use crate::sptfile::{SectionError, SptFile};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use stillpoint_shared::time;

/// Show what a trajectory contains.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let SptFile {
        trajectory,
        section,
        section_bytes,
    } = read_spt(&arguments.trajectory)?;
    let header = trajectory.header();
    let bytes = encode(&trajectory)?.len();
    if arguments.json {
        let intervals: Vec<_> = (trajectory.intervals())
            .map(|i| json!({"duration_s": time::seconds(i.duration_ticks), "points": i.points}))
            .collect();
        let object = json!({
            "version": header.version,
            "id": header.id,
            "axes": header.axes,
            "duration_s": time::seconds(header.duration_ticks),
            "duration_ticks": header.duration_ticks,
            "limits_hash": format!("{:016x}", header.limits_hash),
            "content_hash": format!("{:016x}", header.content_hash),
            "bytes": bytes,
            "intervals": intervals,
            "certificate": match &section {
                Ok(section) => json!({
                    "status": "present",
                    "bytes": section_bytes,
                    "tool": section.certificate.tool,
                    "trajectory_hash": format!("{:016x}", section.certificate.trajectory_hash),
                    "limits_hash": format!("{:016x}", section.certificate.limits_hash),
                    "certified": section.certificate.is_certified(),
                    "plants": section.certificate.plants.iter().map(|plant| &plant.name).collect::<Vec<_>>(),
                }),
                Err(SectionError::Missing) => json!(null),
                Err(error) => json!({"status": "damaged", "bytes": section_bytes, "message": error.to_string()}),
            },
        });
        return output::object(&object);
    }
    let mut text = format!(
        "move {} in format {}, {bytes} bytes\n  {} axes, {:.4} ms ({} ticks of 0.1 µs)\n  content {:016x}, planned for limits {:016x}\n",
        header.id,
        header.version,
        header.axes,
        time::seconds(header.duration_ticks) * 1e3,
        header.duration_ticks,
        header.content_hash,
        header.limits_hash
    );
    for (index, interval) in trajectory.intervals().enumerate() {
        text += &format!(
            "  interval {}: {:.4} ms, {} points\n",
            index + 1,
            time::seconds(interval.duration_ticks) * 1e3,
            interval.points
        );
    }
    text += &match section {
        Ok(section) => {
            let plants = section.certificate.plants_in_words();
            format!(
                "  certificate of {section_bytes} bytes by version {}, not verified here: {}\n{}",
                section.certificate.tool,
                section.certificate.verdict(),
                plants.map_or_else(String::new, |words| format!("  {words}\n"))
            )
        }
        Err(error) => format!("  {error}\n"),
    };
    output::text(&text)
}
