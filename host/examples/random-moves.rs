//! Plans random moves of the 3-RRR manipulator: `cargo run --release -p stillpoint --example random-moves [COUNT] [SEED] [FIRST]`.
//!
//! One line a move, from the FIRST on, then the table of docs/planning.md.

use std::time::Instant;
use stillpoint::machine::three_rrr::Elbow;
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::study::{PAYLOADS, random_moves};

/// What became of one move.
struct Row {
    elbow: Elbow,
    payload: usize,
    solved: bool,
    iterations: usize,
    seconds: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse());
    let (count, seed, first) = (number(200)?, number(12345)?, number(1)?);
    let base = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
    let moves = random_moves(&base, seed).ok_or("the paper's machine is no 3-RRR")?;
    let mut rows = Vec::new();
    let skipped = usize::try_from(first.saturating_sub(1))?;
    let wanted = (1..).zip(moves).skip(skipped).take(usize::try_from(count)?);
    for (index, random) in wanted {
        let started = Instant::now();
        let planned = plan(&random.file, &Pounce, Box::new(|_, _| true));
        let seconds = started.elapsed().as_secs_f64();
        let case = format!("{index} {:?} ×{}", random.elbow, PAYLOADS[random.payload]);
        let (solved, iterations) = match &planned {
            Ok(plan) => {
                let limited = plan.played.as_ref().map(|played| played.limited_ticks);
                println!(
                    "{case}: {:.3} ms, {} iterations in {} rounds of which {} led nowhere, {} intervals, {seconds:.2} s; miss {:.1e}; largest violation {:+.1e}; \
                     ticks limited: {}",
                    plan.solution.duration_s * 1e3,
                    plan.effort.iterations,
                    plan.effort.rounds,
                    plan.effort.restarts,
                    plan.effort.intervals,
                    plan.end_miss.worst().map_or(0.0, |miss| miss.relative()),
                    plan.section
                        .certificate
                        .tightest()
                        .map_or(0.0, |proof| proof.relative()),
                    limited.map_or_else(
                        |error| format!("not played: {error}"),
                        |ticks| ticks.to_string()
                    ),
                );
                (true, plan.effort.iterations)
            }
            Err(error) => {
                println!(
                    "{case}: {seconds:.2} s, from {:?} to {:?}: {error}",
                    random.file.from, random.file.to
                );
                (false, 0)
            }
        };
        rows.push(Row {
            elbow: random.elbow,
            payload: random.payload,
            solved,
            iterations,
            seconds,
        });
    }
    println!(
        "\n| elbow | payload | solved | iterations: median, 90 %, most | seconds: median, 90 %, most |\n|---|---|---|---|---|"
    );
    for elbow in [Elbow::Minus, Elbow::Plus] {
        for (payload, factor) in PAYLOADS.iter().enumerate() {
            let of = |row: &&Row| row.elbow == elbow && row.payload == payload;
            line(&format!("{elbow:?} | × {factor}"), rows.iter().filter(of));
        }
    }
    line("all | all", rows.iter());
    Ok(())
}

fn line<'a>(name: &str, rows: impl Iterator<Item = &'a Row>) {
    let rows: Vec<&Row> = rows.collect();
    let solved: Vec<&&Row> = rows.iter().filter(|row| row.solved).collect();
    let figures = |value: fn(&Row) -> f64, digits: usize| {
        let mut values: Vec<f64> = solved.iter().map(|row| value(row)).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * values.len() as f64).ceil() as usize;
            values
                .get(index.saturating_sub(1))
                .copied()
                .unwrap_or(f64::NAN)
        };
        let [median, most_of_them, most] = [0.5, 0.9, 1.0].map(at);
        format!("{median:.digits$}, {most_of_them:.digits$}, {most:.digits$}")
    };
    println!(
        "| {name} | {} of {} | {} | {} |",
        solved.len(),
        rows.len(),
        figures(|row| row.iterations as f64, 0),
        figures(|row| row.seconds, 2)
    );
}
