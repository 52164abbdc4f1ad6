//! Robust plans against shaped baselines that leave as much: `cargo run --release -p stillpoint --example planners [COUNT] [SEED]`.
//!
//! For the paper's move, the elastic axis and COUNT random moves of the manipulator: all baselines, what each leaves at most with
//! payloads of ±20 % and drives that follow exactly, and against every shaped one that no other beats a robust plan whose
//! bound is just that. Prints the table of docs/comparison.md, a row for each, those that fail among them.

use std::time::{Duration, Instant};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::study::compare::{
    Motion, ResidualUnit, baselines, with_default_spread, worst_within_spread,
};
use stillpoint::study::{PAYLOADS, random_moves};

/// A robust plan that takes longer has failed.
const PATIENCE: Duration = Duration::from_secs(300);

/// Share that the robust plan has to be shorter.
const WANTED: f64 = 0.25;

/// A shaped baseline: name, duration (s), the most that is left.
type Shaped = (String, f64, f64);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse());
    let (count, seed) = (number(20)?, number(12345)?);
    let paper = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
    let axis = MoveFile::parse(include_str!("../moves/axis.toml"), "axis.toml")?;
    let random = random_moves(&paper, seed).ok_or("the paper's machine is no 3-RRR")?;
    let mut moves = vec![
        ("paper".to_owned(), paper.clone()),
        ("axis".to_owned(), axis),
    ];
    let random = (1..).zip(random).take(usize::try_from(count)?);
    moves.extend(random.map(|(index, random)| {
        let payload = PAYLOADS[random.payload];
        let name = format!("{index} {:?} ×{payload}", random.elbow);
        (name, random.file)
    }));
    println!(
        "| move | shaped baseline | ms | leaves at ±20 % | robust, ms | leaves at ±20 % | shorter by | s |\n|---|---|---|---|---|---|---|---|"
    );
    let (mut kept, mut beaten) = (0, 0);
    for (name, file) in &moves {
        let front = front(file);
        if front.is_empty() {
            println!("| {name} | none can be planned | | | | | | |");
        }
        let least = front.iter().map(|shaped| row(name, file, shaped));
        let least = least.fold(f64::INFINITY, f64::min);
        if least.is_finite() && least >= WANTED {
            kept += 1;
        }
        beaten += 1;
    }
    println!(
        "\n{kept} of {beaten} moves: at least {:.0} % shorter than every shaped baseline at equal worst residual.",
        WANTED * 100.0
    );
    Ok(())
}

/// The shaped baselines that no other beats in both duration and what is left.
fn front(file: &MoveFile) -> Vec<Shaped> {
    let all: Vec<Shaped> = (baselines(file).into_iter())
        .filter(|candidate| candidate.name.contains('+'))
        .filter_map(|candidate| {
            let motion = candidate.motion.ok()?;
            let left = worst_within_spread(file, &motion);
            Some((candidate.name, motion.duration_s(), left))
        })
        .collect();
    let beaten = |own: &Shaped| {
        let mut others = all.iter();
        others.any(|other| other.1 <= own.1 && other.2 <= own.2 && other.0 != own.0)
    };
    let mut front: Vec<Shaped> = all.iter().filter(|own| !beaten(own)).cloned().collect();
    front.sort_by(|a, b| a.1.total_cmp(&b.1));
    front
}

/// Prints a row and returns by which share the robust plan is shorter: none at all if there is no such plan.
fn row(name: &str, file: &MoveFile, (shaped, duration_s, left): &Shaped) -> f64 {
    let unit = ResidualUnit::of(file);
    let shown = |residual: f64| format!("{:.1} {}", residual * unit.factor, unit.unit);
    let head = format!(
        "| {name} | {shaped} | {:.2} | {} |",
        duration_s * 1e3,
        shown(*left)
    );
    let started = Instant::now();
    let planned = with_default_spread(file, *left).and_then(|file| {
        let patience = move |_: &_, _: f64| started.elapsed() < PATIENCE;
        plan(&file, &Pounce, Box::new(patience)).map_err(|error| error.to_string())
    });
    match planned {
        Ok(plan) => {
            let motion = Motion::Planned(Box::new(plan));
            let robust_s = motion.duration_s();
            let shorter = 1.0 - robust_s / duration_s;
            let took = started.elapsed().as_secs_f64();
            let left = shown(worst_within_spread(file, &motion));
            println!(
                "{head} {:.2} | {left} | {:.1} % | {took:.0} |",
                robust_s * 1e3,
                shorter * 100.0
            );
            shorter
        }
        Err(why) => {
            let why = why.lines().next().unwrap_or_default();
            println!(
                "{head} no plan: {why} | | | {:.0} |",
                started.elapsed().as_secs_f64()
            );
            0.0
        }
    }
}
