//! `stillpoint simulate F.spt --move MOVE.toml`

use super::{Failure, output, read_trajectory, simulate_sweep};
use crate::movefile::MoveFile;
use crate::study::sweep::SweepRange;
use crate::study::{Document, play};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Play a trajectory.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// The move file that says which machine, limits and drives
    #[arg(long = "move", value_name = "MOVE.toml")]
    file: PathBuf,
    /// Play it on machines whose parameter is multiplied by evenly spaced factors, such as platform_mass_kg=0.8..1.2:9, and show
    /// what small changes of payload, stiffness, damping and friction do
    #[arg(long, value_name = "PARAMETER=FROM..TO:COUNT")]
    sweep: Option<SweepRange>,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = MoveFile::read(&arguments.file)?;
    let trajectory = read_trajectory(&arguments.trajectory)?;
    if let Some(range) = &arguments.sweep {
        return simulate_sweep::run(&file, &trajectory, range, arguments.json);
    }
    let run = play(&file.name, &file, &trajectory)?;
    if arguments.json {
        let limited = run.recording.commands.iter();
        let ticks = limited
            .filter(|c| c.limited.iter().any(|flags| !flags.is_empty()))
            .count();
        return output::object(
            &json!({"name": run.name, "metrics": run.metrics, "limited_ticks": ticks}),
        );
    }
    let document = Document {
        file: &file,
        trajectory: &trajectory,
        planned: &[],
        certificate: None,
        rows: vec![run.row(&file)],
        drawn: &[],
        sensitivities: Vec::new(),
        remarks: Vec::new(),
    };
    let mut text = document.table();
    for peak in &run.metrics.elastic_displacement {
        text += &format!(
            "{}: {:.4e} {} at most, {:.4e} {} left after the move\n",
            peak.label, peak.peak, peak.unit, peak.residual, peak.unit
        );
    }
    output::text(&text)
}
