//! `stillpoint demo`: the paper's move, planned, played and compared.

use super::{Failure, create_folder, encode, terminal, write_file};
use crate::movefile::MoveFile;
use crate::nlp::Pounce;
use crate::plan::plan;
use crate::report::summary_json;
use crate::study::{Document, Run, StudyError, equal_quintic, paper_row, play, shortest_shaped};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use stillpoint_shared::time;

/// The paper's move comes with the program, so that the demo runs anywhere.
const PAPER: &str = include_str!("../../moves/paper.toml");

/// Show what Stillpoint does.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where to write report, trajectory and summary
    #[arg(long, value_name = "FOLDER", default_value = "stillpoint-demo")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let file = MoveFile::parse(PAPER, "paper.toml")?;
    terminal::step(
        "planning the paper's move; in parallel, what a user would pick instead: shaped quintics",
    );
    let (planned, shaped) = std::thread::scope(|scope| {
        let shaped = scope.spawn(|| shortest_shaped(&file));
        let planned = plan(&file, &Pounce, terminal::solver_progress(false, false));
        terminal::end_progress(false, false);
        (planned, shaped.join())
    });
    let plan = planned?;
    let shaped: Result<Vec<Run>, StudyError> =
        shaped.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let shaped = shaped?;
    terminal::step("playing it, and the quintic of equal duration, through the board's executor");
    let drawn = [
        play("stillpoint", &file, &plan.trajectory)?,
        equal_quintic(
            "quintic, equal duration",
            &file,
            time::seconds(plan.trajectory.duration_ticks()),
        )?,
    ];
    let rows = drawn.iter().map(Run::row);
    let document = Document {
        file: &file,
        trajectory: &plan.trajectory,
        plan: Some(&plan),
        rows: rows
            .chain([paper_row()])
            .chain(shaped.iter().map(Run::row))
            .collect(),
        drawn: &drawn,
        paper: true,
    };
    create_folder(&arguments.out)?;
    let write = |name: &str, bytes: &[u8]| write_file(&arguments.out.join(name), bytes);
    write("paper.spt", &encode(&plan.trajectory)?)?;
    write("summary.json", summary_json(&document.rows).as_bytes())?;
    write("report.html", document.html().as_bytes())?;
    println!("{}", document.table());
    println!(
        "Played by the board's executor on simulated drives; the shortest quintics with drives that follow exactly. Paper: \
         measured, read from its text."
    );
    println!(
        "{:.2} s in all. Look at {}.",
        started.elapsed().as_secs_f64(),
        arguments.out.join("report.html").display()
    );
    Ok(())
}
