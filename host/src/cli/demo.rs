//! `stillpoint demo`: the paper's move, planned, played and compared.

use super::{Failure, create_folder, encode_plan, output, terminal, write_file};
use crate::movefile::{MoveFile, PAPER_MOVE};
use crate::nlp::Pounce;
use crate::plan::plan;
use crate::report::summary_json;
use crate::study::{Document, Run, StudyError, equal_quintic, paper_row, play, shortest_shaped};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use stillpoint_shared::time;

/// Show what Stillpoint does.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where to write report, trajectory and summary
    #[arg(long, value_name = "FOLDER", default_value = "stillpoint-demo")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
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
    let rows = drawn.iter().chain(&shaped).map(|run| run.row(&file));
    let mut rows: Vec<_> = rows.collect();
    rows.insert(drawn.len(), paper_row());
    let document = Document {
        file: &file,
        trajectory: &plan.trajectory,
        plan: Some(&plan),
        certificate: Some(&plan.section.certificate),
        rows,
        drawn: &drawn,
        remarks: Vec::new(),
    };
    create_folder(&arguments.out)?;
    let write = |name: &str, bytes: &[u8]| write_file(&arguments.out.join(name), bytes);
    write("paper.spt", &encode_plan(&plan)?)?;
    write("summary.json", summary_json(&document.rows).as_bytes())?;
    write("report.html", document.html().as_bytes())?;
    output::text(&format!(
        "{}\nPlayed by the board's executor on simulated drives; the shortest quintics with drives that follow exactly. Paper: \
         measured, read from its text.\n{:.2} s in all. Look at {}.\n",
        document.table(),
        started.elapsed().as_secs_f64(),
        arguments.out.join("report.html").display()
    ))
}
