//! `stillpoint compare MOVE.toml`

use super::{Failure, create_folder, output, terminal, write_file};
use crate::movefile::MoveFile;
use crate::study::compare::compare;
use clap::Args;
use std::path::PathBuf;

/// Compare planners.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The move file; without a [robust] table the robust plan is for a payload ±20 % and a tenth of what the nominal plan
    /// leaves then
    #[arg(value_name = "MOVE.toml")]
    file: PathBuf,
    /// Also write a self-contained HTML page
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Also write the picture as an SVG file into this folder
    #[arg(long, value_name = "FOLDER")]
    figures: Option<PathBuf>,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = MoveFile::read(&arguments.file)?;
    terminal::step("planning with every planner, and simulating each over payload and stiffness");
    let comparison = compare(&file);
    if let Some(out) = &arguments.out {
        write_file(out, comparison.html(&file).as_bytes())?;
    }
    if let Some(folder) = &arguments.figures {
        create_folder(folder)?;
        let picture = comparison.picture().svg();
        write_file(&folder.join("comparison.svg"), picture.as_bytes())?;
    }
    if arguments.json {
        return output::object(&comparison.json());
    }
    output::text(&comparison.table())
}
