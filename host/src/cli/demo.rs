//! `stillpoint demo`: the paper's move, planned, played and compared.

use super::{Failure, create_folder, encode_spt, output, terminal, write_file};
use crate::movefile::{MoveFile, PAPER_MOVE};
use crate::nlp::Pounce;
use crate::plan::{Plan, plan};
use crate::report::summary_json;
use crate::study::{
    Document, Run, Step, StudyError, equal_quintic, paper_row, play, play_on_board, shortest_shaped,
};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Instant;
use stillpoint_shared::time;

/// Show what Stillpoint does.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where to write report, trajectory and summary
    #[arg(long, value_name = "FOLDER", default_value = "stillpoint-demo")]
    out: PathBuf,
    /// Play the move on this board, too: an emulated one, which QEMU runs with the image that `cargo image-qemu` builds
    #[arg(long, value_name = "BOARD")]
    board: Option<Board>,
}

/// Boards that a demo needs no hardware for.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Board {
    /// The emulated controller
    Qemu,
}

/// Plays the move on the emulated board, and says in what it differs from the executor on this computer.
fn on_board(file: &MoveFile, plan: &Plan, replay: &Run) -> Result<(Run, String), Failure> {
    terminal::step("playing it on the emulated board");
    let end_ms = time::seconds(plan.trajectory.duration_ticks()) * 1e3;
    let mut board = String::new();
    let played = play_on_board(
        "stillpoint, emulated board",
        file,
        &plan.trajectory,
        |step| match step {
            Step::Greeted(greeting, waited) => {
                board = format!(
                    "{} {}, build {:016x}, answered in {:.0} ms",
                    greeting.board,
                    greeting.firmware,
                    greeting.build_id,
                    waited.as_secs_f64() * 1e3
                );
            }
            Step::Upload(progress) => {
                let (arrived, blocks) = (progress.arrived, progress.blocks);
                let words = format!("{arrived} of {blocks} blocks");
                terminal::bar("upload", arrived, blocks, &words);
            }
            Step::Move(record) => {
                let now_ms = time::seconds(record.path_ticks) * 1e3;
                let words = format!("{:?}, {now_ms:.1} of {end_ms:.1} ms", record.state);
                terminal::bar(
                    "move",
                    record.path_ticks,
                    plan.trajectory.duration_ticks(),
                    &words,
                );
            }
        },
    );
    terminal::end_bar();
    let played = played?;
    let sent = played.sent.len();
    let equal = match played.differs_from(replay) {
        None => "all equal to the bit to those of the executor on this computer".to_owned(),
        Some(tick) => format!(
            "which differ from those of the executor on this computer from tick {tick} on: build the image again with \
             `cargo image-qemu`"
        ),
    };
    let text = format!(
        "The emulated board ({board}) took {} blocks in {:.2} s and sent {sent} set-points per axis, {equal}.\n",
        played.uploaded.blocks,
        played.uploaded.time.as_secs_f64()
    );
    Ok((played.run, text))
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
    let board = match arguments.board {
        None => None,
        Some(Board::Qemu) => Some(on_board(&file, &plan, &drawn[0])?),
    };
    if let Some((run, _)) = &board {
        rows.insert(1, run.row(&file));
    }
    let document = Document {
        file: &file,
        trajectory: &plan.trajectory,
        planned: &plan.section.remarks,
        certificate: Some(&plan.section.certificate),
        rows,
        drawn: &drawn,
        sensitivities: Vec::new(),
        remarks: Vec::new(),
    };
    create_folder(&arguments.out)?;
    let write = |name: &str, bytes: &[u8]| write_file(&arguments.out.join(name), bytes);
    write("paper.spt", &encode_spt(&plan.trajectory, &plan.section)?)?;
    write("summary.json", summary_json(&document.rows).as_bytes())?;
    write("report.html", document.html().as_bytes())?;
    output::text(&format!(
        "{}\nPlayed by the board's executor on simulated drives; the shortest quintics with drives that follow exactly. Paper: \
         measured, read from its text.\n{}{:.2} s in all. Look at {}.\n",
        document.table(),
        board.map_or_else(String::new, |(_, text)| text),
        started.elapsed().as_secs_f64(),
        arguments.out.join("report.html").display()
    ))
}
