//! `stillpoint bench`: problems with known answers.

use super::{Failure, output, terminal};
use crate::benchmarks::{Approach, Benchmark, Measured, all, named, run as measure};
use crate::nlp::Pounce;
use crate::ocp::{Mesh, MeshRecord, Side};
use clap::Args;
use serde_json::{Value, json};

/// Solve problems with known answers.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Which problems [default: all]
    #[arg(value_name = "PROBLEM", value_parser = known)]
    names: Vec<String>,
    /// Relative error that refinement of the mesh aims at
    #[arg(long, default_value_t = 1e-7, value_parser = possible)]
    tolerance: f64,
    /// Solve once on this mesh, say 50x4, with neither refinement nor free arcs
    #[arg(long, value_name = "INTERVALSxPOINTS", value_parser = mesh, conflicts_with = "tolerance")]
    mesh: Option<(usize, usize)>,
    /// Print the results as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
    /// Log every mesh and the arcs on stderr
    #[arg(long)]
    log: bool,
}

fn known(name: &str) -> Result<String, String> {
    let all = all();
    if all.iter().any(|benchmark| benchmark.name == name) {
        return Ok(name.to_owned());
    }
    let names: Vec<&str> = all.iter().map(|benchmark| benchmark.name).collect();
    Err(format!("there are {}", names.join(", ")))
}

fn possible(text: &str) -> Result<f64, String> {
    let tolerance = text.parse().map_err(|error| format!("{error}"))?;
    // Below, the solver's own tolerance and f64 decide.
    if (1e-9..=1e-1).contains(&tolerance) {
        Ok(tolerance)
    } else {
        Err("must lie between 1e-9 and 0.1".into())
    }
}

fn mesh(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('x');
    parts
        .and_then(|(intervals, points)| Some((intervals.parse().ok()?, points.parse().ok()?)))
        .filter(|(intervals, points)| (1..=1000).contains(intervals) && (2..=32).contains(points))
        .ok_or_else(|| "write 1 to 1000 intervals, x, and 2 to 32 points: 50x4".into())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let benchmarks: Vec<Benchmark> = if arguments.names.is_empty() {
        all()
    } else {
        arguments
            .names
            .iter()
            .filter_map(|name| named(name))
            .collect()
    };
    let approach = match arguments.mesh {
        Some((intervals, points)) => Approach::Fixed(Mesh::uniform(intervals, points)),
        None => Approach::Automatic {
            tolerance: arguments.tolerance,
        },
    };
    let mut rows = Vec::new();
    if !arguments.json {
        output::line(HEADING)?;
    }
    for benchmark in benchmarks {
        let (name, answer) = (benchmark.name, benchmark.answer);
        let (uncertainty, source) = (benchmark.uncertainty, benchmark.source);
        let measured = measure(benchmark, &approach, &Pounce)?;
        if arguments.log {
            log(name, &measured);
        }
        let error = ((measured.objective - answer) / answer).abs();
        if arguments.json {
            let mut row = object(&measured);
            row["name"] = json!(name);
            row["answer"] = json!(answer);
            row["answer_uncertainty"] = json!(uncertainty);
            row["source"] = json!(source);
            row["error"] = json!(error);
            rows.push(row);
        } else {
            output::line(&words(name, answer, error, &measured))?;
        }
    }
    if arguments.json {
        output::object(&json!({"status": "solved", "benchmarks": rows}))?;
    }
    Ok(())
}

const HEADING: &str = "problem                       value          answer    error     miss  points  variables  iterations  meshes  arcs  seconds";

fn words(name: &str, answer: f64, error: f64, measured: &Measured) -> String {
    let miss = measured
        .miss
        .map_or("–".into(), |miss| format!("{miss:.1e}"));
    let arcs = (measured.arcs.as_ref()).map_or("–".into(), |found| found.arcs.len().to_string());
    format!(
        "{name:<20} {:>14.10}  {answer:>14.10}  {error:>7.1e}  {miss:>7}  {:>6}  {:>9}  {:>10}  {:>6}  {arcs:>4}  {:>7.2}",
        measured.objective,
        measured.solution.mesh.points(),
        measured.variables,
        measured.iterations,
        measured.log.len(),
        measured.time.as_secs_f64(),
    )
}

fn log(name: &str, measured: &Measured) {
    terminal::step(&format!(
        "{name}\n  intervals  points        objective    error   change  iterations"
    ));
    for mesh in &measured.log {
        let change = mesh
            .change
            .map_or("–".into(), |change| format!("{change:.1e}"));
        terminal::step(&format!(
            "  {:>9}  {:>6}  {:>15.10}  {:>7.1e}  {change:>7}  {:>10}",
            mesh.intervals, mesh.points, mesh.objective, mesh.error, mesh.iterations
        ));
    }
    let Some(found) = &measured.arcs else {
        return;
    };
    let mut end_s = 0.0;
    for arc in &found.arcs {
        end_s += arc.duration_s;
        let sides: String = arc.sides.iter().map(|side| sign(*side)).collect();
        terminal::step(&format!("  {sides} until {end_s:.12}"));
    }
    let optimality = found.optimality;
    terminal::step(&format!(
        "  Hamiltonian constant to {:.1e}, switching functions of the wrong sign by {:.1e}, bounds exceeded by {:.1e}",
        optimality.hamiltonian, optimality.switching, optimality.bounds
    ));
}

const fn sign(side: Side) -> char {
    match side {
        Side::Lower => '−',
        Side::Upper => '+',
    }
}

/// A log of meshes.
pub(super) fn meshes(log: &[MeshRecord]) -> Value {
    let of = |mesh: &MeshRecord| {
        json!({
            "intervals": mesh.intervals,
            "points": mesh.points,
            "objective": mesh.objective,
            "error": mesh.error,
            "objective_change": mesh.change,
            "iterations": mesh.iterations,
        })
    };
    log.iter().map(of).collect()
}

fn object(measured: &Measured) -> Value {
    let arcs = measured.arcs.as_ref().map(|found| {
        let arcs: Vec<Value> = (found.arcs.iter())
            .map(|arc| {
                let controls: String = arc.sides.iter().map(|side| sign(*side)).collect();
                json!({"duration_s": arc.duration_s, "controls": controls})
            })
            .collect();
        json!({
            "arcs": arcs,
            "hamiltonian": found.optimality.hamiltonian,
            "switching": found.optimality.switching,
            "bounds": found.optimality.bounds,
        })
    });
    json!({
        "objective": measured.objective,
        "miss": measured.miss,
        "intervals": measured.solution.mesh.intervals().len(),
        "points": measured.solution.mesh.points(),
        "variables": measured.variables,
        "iterations": measured.iterations,
        "seconds": measured.time.as_secs_f64(),
        "meshes": meshes(&measured.log),
        "structure": arcs,
    })
}
