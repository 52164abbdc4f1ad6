//! Robust plans against shaped baselines that leave as much: `cargo run --release -p stillpoint --example planners [COUNT] [SEED] [FIRST]`.
//!
//! For the paper's move, the elastic axis and COUNT random moves of the manipulator: all baselines, what each leaves at most with
//! payloads of ±20 % and drives that follow exactly, and against the shaped ones that no other beats a robust plan whose
//! bound is just that; of a random move against the shortest of them, from which the distance is the least. Prints the table
//! of docs/comparison.md, a row for each, those that fail among them. With FIRST above 1 it begins with that random move.
//!
//! Planned are payloads of 80 % and 120 %; where more is left in between, 90 % and 110 % besides, and where that is not enough,
//! with bounds drawn in by what is left too much.

use std::time::{Duration, Instant};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::study::compare::{
    Motion, ResidualUnit, baselines, robust_for, worst_within_spread,
};
use stillpoint::study::{PAYLOADS, random_moves};

/// A robust plan that takes longer has failed.
const PATIENCE: Duration = Duration::from_secs(600);

/// Share that the robust plan has to be shorter.
const WANTED: f64 = 0.25;

/// Share by which a plan may leave more than its bound.
const EQUAL: f64 = 0.02;

/// Times that bounds are drawn in where more is left between the planned payloads, and by how much further than what is too much.
const TIGHTENINGS: usize = 3;
const BEYOND: f64 = 0.01;

/// A shaped baseline: name, duration (s), the most that is left.
type Shaped = (String, f64, f64);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse());
    let (count, seed, first) = (number(20)?, number(12345)?, number(1)?);
    let paper = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
    let axis = MoveFile::parse(include_str!("../moves/axis.toml"), "axis.toml")?;
    let random = random_moves(&paper, seed).ok_or("the paper's machine is no 3-RRR")?;
    let mut moves = vec![
        ("paper".to_owned(), paper.clone()),
        ("axis".to_owned(), axis),
    ];
    if first > 1 {
        moves.clear();
    }
    let named = moves.len();
    let skipped = usize::try_from(first.saturating_sub(1))?;
    let random = (1..).zip(random).skip(skipped);
    let random = random.take(usize::try_from(count)?);
    moves.extend(random.map(|(index, random)| {
        let payload = PAYLOADS[random.payload];
        let name = format!("{index} {:?} ×{payload}", random.elbow);
        (name, random.file)
    }));
    println!(
        "| move | shaped baseline | ms | leaves at ±20 % | robust, ms | leaves at ±20 % | payloads | shorter by | s |\n|---|---|---|---|---|---|---|---|---|"
    );
    let (mut kept, mut beaten) = (0, 0);
    for (index, (name, file)) in moves.iter().enumerate() {
        let mut front = front(file);
        if index >= named {
            front.truncate(1);
        }
        if front.is_empty() {
            println!("| {name} | none can be planned | | | | | | | |");
        }
        let least = front.iter().map(|shaped| row(name, file, shaped));
        let least = least.fold(f64::INFINITY, f64::min);
        if least.is_finite() && least >= WANTED {
            kept += 1;
        }
        beaten += 1;
    }
    println!(
        "\n{kept} of {beaten} moves: at least {:.0} % shorter than the shaped baselines at equal worst residual.",
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

/// The robust plan for some payloads that is to leave no more than a bound; what it leaves.
fn robust(file: &MoveFile, payloads: &[f64], bound: f64) -> Result<(Motion, f64), String> {
    let started = Instant::now();
    let patience = move |_: &_, _: f64| started.elapsed() < PATIENCE;
    let robust = robust_for(file, payloads, bound)?;
    let plan = plan(&robust, &Pounce, Box::new(patience)).map_err(|error| error.to_string())?;
    let motion = Motion::Planned(Box::new(plan));
    let left = worst_within_spread(file, &motion);
    Ok((motion, left))
}

/// Prints a row and returns by which share the robust plan is shorter: none at all if there is no such plan.
fn row(name: &str, file: &MoveFile, (shaped, duration_s, bound): &Shaped) -> f64 {
    let unit = ResidualUnit::of(file);
    let shown = |residual: f64| format!("{:.1} {}", residual * unit.factor, unit.unit);
    let head = format!(
        "| {name} | {shaped} | {:.2} | {} |",
        duration_s * 1e3,
        shown(*bound)
    );
    let started = Instant::now();
    let keeps = |planned: &Result<(Motion, f64), String>| {
        let planned = planned.as_ref();
        planned.is_ok_and(|(_, left)| *left <= bound * (1.0 + EQUAL))
    };
    let mut payloads = 2;
    let mut planned = robust(file, &[0.8, 1.2], *bound);
    let mut aimed_at = *bound;
    for _ in 0..=TIGHTENINGS {
        match &planned {
            Ok(_) if keeps(&planned) => break,
            Ok((_, left)) if payloads == 4 => aimed_at *= bound / left * (1.0 - BEYOND),
            Err(_) if payloads == 4 => break,
            _ => payloads = 4,
        }
        planned = robust(file, &[0.8, 0.9, 1.1, 1.2], aimed_at);
    }
    let kept = keeps(&planned);
    let took = started.elapsed().as_secs_f64();
    match planned {
        Ok((motion, left)) => {
            let robust_s = motion.duration_s();
            let shorter = 1.0 - robust_s / duration_s;
            println!(
                "{head} {:.2} | {} | {payloads} | {:.1} %{} | {took:.0} |",
                robust_s * 1e3,
                shown(left),
                shorter * 100.0,
                if kept { "" } else { ", but leaves more" }
            );
            if kept { shorter } else { 0.0 }
        }
        Err(why) => {
            let why = why.lines().next().unwrap_or_default();
            println!("{head} no plan: {why} | | {payloads} | | {took:.0} |");
            0.0
        }
    }
}
