//! `stillpoint plan MOVE.toml`

use super::{Failure, encode, terminal, write_file};
use crate::movefile::MoveFile;
use crate::nlp::{NlpSolver, Pounce};
use crate::plan::{Effort, Plan, PlanError, plan};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Plan a move.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The move file
    #[arg(value_name = "MOVE.toml")]
    file: PathBuf,
    /// Where to write the trajectory [default: the move's name with .spt, in this folder]
    #[arg(long, value_name = "F.spt")]
    out: Option<PathBuf>,
    /// Which solver to use
    #[arg(long, value_enum, default_value_t = Solver::Pounce)]
    solver: Solver,
    /// Where the limits are imposed
    #[arg(long, value_enum, default_value_t = LimitsAt::Nodes)]
    limits: LimitsAt,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Log every iteration of the solver
    #[arg(long)]
    log: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Solver {
    /// Pounce: built in
    Pounce,
    /// Ipopt: needs the system library and a build with `--features ipopt`
    Ipopt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LimitsAt {
    /// At the collocation points, as the paper does
    Nodes,
}

impl Solver {
    fn get(self) -> Result<Box<dyn NlpSolver>, Failure> {
        match self {
            Self::Pounce => Ok(Box::new(Pounce)),
            #[cfg(feature = "ipopt")]
            Self::Ipopt => Ok(Box::new(crate::nlp::Ipopt)),
            #[cfg(not(feature = "ipopt"))]
            Self::Ipopt => Err(
                "this stillpoint was built without Ipopt: install it as the README says and build with `--features ipopt`, \
                 or use `--solver pounce`"
                    .into(),
            ),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    let started = Instant::now();
    let result = execute(arguments);
    let total_s = started.elapsed().as_secs_f64();
    let (mut object, code) = match &result {
        Ok((plan, out)) => (success(plan, out), ExitCode::SUCCESS),
        Err(failure) => {
            eprintln!("error: {failure}");
            (failed(failure.as_ref()), ExitCode::FAILURE)
        }
    };
    if arguments.json {
        if let Some(seconds) = object.get_mut("seconds").and_then(Value::as_object_mut) {
            seconds.insert("total".into(), json!(total_s));
        }
        println!("{}", Value::Object(object));
    } else if let Ok((plan, out)) = &result {
        print_words(plan, out, total_s);
    }
    code
}

fn execute(arguments: &Arguments) -> Result<(Plan, PathBuf), Failure> {
    let LimitsAt::Nodes = arguments.limits;
    let file = MoveFile::read(&arguments.file)?;
    let solver = arguments.solver.get()?;
    let progress = terminal::solver_progress(arguments.json, arguments.log);
    let result = plan(&file, solver.as_ref(), progress);
    terminal::end_progress(arguments.json, arguments.log);
    let plan = result?;
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(&file.name).with_extension("spt"));
    write_file(&out, &encode(&plan.trajectory)?)?;
    Ok((plan, out))
}

fn effort(effort: &Effort) -> Map<String, Value> {
    let mut object = Map::new();
    object.insert("status".into(), json!(effort.status.to_string()));
    object.insert("solver".into(), json!(effort.solver));
    object.insert("iterations".into(), json!(effort.iterations));
    object.insert("variables".into(), json!(effort.variables));
    object.insert("constraints".into(), json!(effort.constraints));
    let seconds = json!({
        "setup": effort.setup.as_secs_f64(),
        "solve": effort.solve.as_secs_f64(),
        "check": effort.check.as_secs_f64(),
    });
    object.insert("seconds".into(), seconds);
    object
}

fn success(plan: &Plan, out: &std::path::Path) -> Map<String, Value> {
    let mut object = effort(&plan.effort);
    object.insert("duration_s".into(), json!(plan.solution.duration_s));
    let violation = plan.largest_violation.as_ref().map(|v| {
        json!({"limit": v.limit, "time_s": v.time_s, "value": v.value, "bound": v.bound, "relative": v.relative()})
    });
    object.insert("largest_violation".into(), json!(violation));
    object.insert("end_miss".into(), json!(plan.end_miss.largest()));
    let by_state: Map<String, Value> = (plan.end_miss.states.iter())
        .map(|(name, miss)| (name.clone(), json!(miss)))
        .collect();
    object.insert("end_miss_by_state".into(), Value::Object(by_state));
    object.insert("trajectory".into(), json!(out.display().to_string()));
    object
}

fn failed(failure: &(dyn std::error::Error + 'static)) -> Map<String, Value> {
    let mut object = match failure.downcast_ref::<PlanError>() {
        Some(PlanError::Unsolved(diagnosis, spent)) => {
            let mut object = effort(spent);
            object.insert("duration_s".into(), json!(diagnosis.duration_s));
            let worst = diagnosis.worst.as_ref().map(|v| {
                json!({"constraint": v.name, "dynamics": v.dynamics, "time_s": v.time_s, "amount": v.amount})
            });
            object.insert("violated_most".into(), json!(worst));
            let saturated: Vec<Value> = (diagnosis.saturated.iter())
                .map(|s| json!({"limit": s.name, "share": s.share, "from_s": s.from_s, "to_s": s.to_s}))
                .collect();
            object.insert("saturated".into(), json!(saturated));
            object
        }
        _ => Map::from_iter([("status".to_owned(), json!("error"))]),
    };
    object.insert("message".into(), json!(failure.to_string()));
    object
}

fn print_words(plan: &Plan, out: &std::path::Path, total_s: f64) {
    let Effort {
        solver,
        iterations,
        variables,
        constraints,
        setup,
        solve,
        check,
        ..
    } = &plan.effort;
    println!(
        "{:.3} ms, written to {}",
        plan.solution.duration_s * 1e3,
        out.display()
    );
    println!(
        "  {solver}: {iterations} iterations, {variables} variables, {constraints} constraints"
    );
    println!(
        "  setup {:.3} s, solve {:.3} s, check {:.3} s, in all {total_s:.3} s",
        setup.as_secs_f64(),
        solve.as_secs_f64(),
        check.as_secs_f64()
    );
    println!(
        "  the dynamics integrated under the planned control miss the end by {:.1e} (largest coordinate, SI)",
        plan.end_miss.largest()
    );
    if let Some(v) = &plan.largest_violation {
        let relation = if v.relative() > 0.0 {
            "exceeds"
        } else {
            "stays inside"
        };
        println!(
            "  between the points {} {relation} its limit by {:.2} % at {:.3} ms ({:.6} against {:.6})",
            v.limit,
            v.relative().abs() * 100.0,
            v.time_s * 1e3,
            v.value,
            v.bound
        );
    }
}
