//! Plans random moves of the 3-RRR manipulator for three payloads at once: `cargo run --release -p stillpoint --example
//! robust-moves [COUNT] [SEED]`.
//!
//! Payload ±20 %, at most 15 µε left, limits for the nominal payload. A line a move: what the nominal plan takes, what the robust one.

use std::time::Instant;
use stillpoint::machine::{Change, OutputKind};
use stillpoint::movefile::{MoveFile, PAPER_MOVE, Residual, Robust, Scenario};
use stillpoint::nlp::Pounce;
use stillpoint::plan::{Plan, PlanError, plan};
use stillpoint::study::random_moves;

const FACTORS: [f64; 2] = [0.8, 1.2];
const RESIDUAL_STRAIN: f64 = 15e-6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse());
    let (count, seed) = (number(10)?, number(12345)?);
    let base = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
    let moves = random_moves(&base, seed).ok_or("the paper's machine is no 3-RRR")?;
    for (index, random) in (1..).zip(moves).take(usize::try_from(count)?) {
        let (nominal, nominal_s) = timed(&random.file);
        let scenarios = FACTORS.map(|factor| {
            let change = Change::Factor(factor);
            Scenario::new(&random.file.machine, "platform_mass_kg", change, false)
        });
        let robust = MoveFile {
            robust: Some(Robust {
                scenarios: scenarios.into_iter().collect::<Result<_, _>>()?,
                residuals: vec![(Residual::Outputs(OutputKind::Strain, ""), RESIDUAL_STRAIN)],
            }),
            ..random.file
        };
        let (robust, robust_s) = timed(&robust);
        println!(
            "{index}: nominal {}, {nominal_s:.1} s; robust {}, {robust_s:.1} s",
            in_words(&nominal),
            in_words(&robust)
        );
    }
    Ok(())
}

fn timed(file: &MoveFile) -> (Result<Plan, PlanError>, f64) {
    let started = Instant::now();
    let planned = plan(file, &Pounce, Box::new(|_, _| true));
    (planned, started.elapsed().as_secs_f64())
}

fn in_words(planned: &Result<Plan, PlanError>) -> String {
    match planned {
        Ok(plan) => {
            let rows = plan.section.certificate.plants.iter();
            let left = rows.flat_map(|plant| plant.simulated.iter().map(|row| row.value));
            let left = left.reduce(f64::max);
            let left = left.map_or_else(String::new, |left| format!(", {:.1} µε left", left * 1e6));
            format!(
                "{:.2} ms{left}, {} iterations",
                plan.solution.duration_s * 1e3,
                plan.effort.iterations
            )
        }
        Err(error) => format!("none: {error}"),
    }
}
