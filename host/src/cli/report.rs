//! `stillpoint report F.spt --move MOVE.toml`

use super::{Failure, output, read_spt, terminal, write_file};
use crate::certify::{VerifyError, verify_move};
use crate::movefile::MoveFile;
use crate::study::sensitivity::sensitivities;
use crate::study::{Document, equal_quintic, play};
use clap::Args;
use std::path::PathBuf;
use stillpoint_shared::time;

/// Report on a trajectory.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The trajectory file
    #[arg(value_name = "F.spt")]
    trajectory: PathBuf,
    /// The move file that says which machine, limits and drives
    #[arg(long = "move", value_name = "MOVE.toml")]
    file: PathBuf,
    /// Where to write the report
    #[arg(long, value_name = "FILE.html", default_value = "report.html")]
    out: PathBuf,
    /// Also write every figure as an SVG file into this folder
    #[arg(long, value_name = "FOLDER")]
    figures: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = MoveFile::read(&arguments.file)?;
    let spt = read_spt(&arguments.trajectory)?;
    let mut remarks = Vec::new();
    let certificate = match verify_move(&spt, &file) {
        Ok(certificate) => Some(certificate),
        Err(VerifyError::NotCertified(_, certificate)) => Some(*certificate),
        Err(error) => {
            remarks.push(format!("Not verified: {error}."));
            None
        }
    };
    let planned = spt
        .section
        .map_or_else(|_| Vec::new(), |section| section.remarks);
    let trajectory = spt.trajectory;
    terminal::step("playing the trajectory and the quintic of equal duration");
    let own = play("stillpoint", &file, &trajectory)?;
    let duration_s = time::seconds(trajectory.duration_ticks());
    let mut drawn = vec![own];
    match equal_quintic("quintic, equal duration", &file, duration_s) {
        Ok(quintic) => drawn.push(quintic),
        Err(error) => {
            eprintln!("warning: no quintic to compare with: {error}");
            remarks.push(format!("No quintic to compare with: {error}."));
        }
    }
    let sensitivities = sensitivities(&file, &trajectory).unwrap_or_else(|error| {
        remarks.push(format!(
            "What small changes of the machine do is not known: {error}."
        ));
        Vec::new()
    });
    let document = Document {
        file: &file,
        trajectory: &trajectory,
        planned: &planned,
        certificate: certificate.as_ref(),
        rows: drawn.iter().map(|run| run.row(&file)).collect(),
        drawn: &drawn,
        sensitivities,
        remarks,
    };
    write_file(&arguments.out, document.html().as_bytes())?;
    output::line(&format!("written to {}", arguments.out.display()))?;
    if let Some(folder) = &arguments.figures {
        super::create_folder(folder)?;
        for figure in document.figures() {
            let path = folder.join(format!("{}.svg", figure.id));
            write_file(&path, figure.svg().as_bytes())?;
            output::line(&format!("written to {}", path.display()))?;
        }
    }
    Ok(())
}
