//! `stillpoint plan MOVE.toml`

use super::bench::meshes;
use super::{Failure, encode_spt, output, plan_with, terminal, verify, write_file};
use crate::baseline::Baseline;
use crate::movefile::{LimitsAt, MoveFile};
use crate::nlp::{NlpSolver, Pounce};
use crate::plan::{Effort, Plan, PlanError, plan};
use crate::study::{Loss, lost_stillness};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
    /// Where the limits are imposed [default: what the move file says, else everywhere]
    #[arg(long, value_enum)]
    limits: Option<LimitsAt>,
    /// Plan what a user would plan instead: the shortest quintic or S-curve within all limits, alone or with an input shaper
    /// on the lowest mode of vibration, or (…2) on both lowest modes
    #[arg(long, value_name = "BASELINE", value_parser = baselines(), conflicts_with_all = ["solver", "limits", "log"])]
    with: Option<Baseline>,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(super) json: bool,
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

fn baselines() -> impl TypedValueParser<Value = Baseline> {
    let names = Baseline::ALL.map(|baseline| baseline.name());
    PossibleValuesParser::new(names).try_map(|name| Baseline::named(&name).ok_or("unknown"))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let file = MoveFile::read(&arguments.file)?;
    let out = out(arguments, &file)?;
    if let Some(baseline) = arguments.with {
        return plan_with::run(&file, baseline, &out, arguments.json);
    }
    let (plan, losses) = execute(arguments, file, &out)?;
    let total = started.elapsed();
    if arguments.json {
        output::object(&success(&plan, &losses, &out, total))
    } else {
        output::text(&words(&plan, &out, total))
    }
}

/// Where to write the trajectory.
fn out(arguments: &Arguments, file: &MoveFile) -> Result<PathBuf, Failure> {
    let out =
        (arguments.out.clone()).unwrap_or_else(|| PathBuf::from(format!("{}.spt", file.name)));
    if let Some(folder) = out
        .parent()
        .filter(|f| !f.as_os_str().is_empty() && !f.is_dir())
    {
        // Better now than after the solve.
        return Err(format!(
            "cannot write {}: there is no folder {}",
            out.display(),
            folder.display()
        )
        .into());
    }
    Ok(out)
}

fn execute(
    arguments: &Arguments,
    mut file: MoveFile,
    out: &Path,
) -> Result<(Plan, Vec<Loss>), Failure> {
    file.solver.limits = arguments.limits.unwrap_or(file.solver.limits);
    let solver = arguments.solver.get()?;
    let progress = terminal::solver_progress(arguments.json, arguments.log);
    let result = plan(&file, solver.as_ref(), progress);
    terminal::end_progress(arguments.json, arguments.log);
    let plan = result?;
    write_file(out, &encode_spt(&plan.trajectory, &plan.section)?)?;
    if let Some(warning) = plan.warning() {
        eprintln!("warning: {warning}");
    }
    let losses = lost_stillness(&file, &plan.trajectory);
    for loss in &losses {
        eprintln!("warning: {loss}");
    }
    Ok((plan, losses))
}

/// Machines within the declared uncertainty on which too much is left; `residual` is `null` where the move is stopped.
pub(super) fn lost(losses: &[Loss]) -> Value {
    let loss = |loss: &Loss| {
        json!({
            "parameter": loss.parameter,
            "factor": loss.factor,
            "residual": loss.left.as_ref().ok().map(|(left, _)| left),
            "allowed": loss.allowed,
            "message": loss.to_string(),
        })
    };
    losses.iter().map(loss).collect()
}

fn effort(effort: &Effort, total: Duration) -> Value {
    json!({
        "status": effort.status.to_string(),
        "solver": effort.solver,
        "iterations": effort.iterations,
        "rounds": effort.rounds,
        "restarts": effort.restarts,
        "intervals": effort.intervals,
        "variables": effort.variables,
        "constraints": effort.constraints,
        "seconds": {
            "setup": effort.setup.as_secs_f64(),
            "solve": effort.solve.as_secs_f64(),
            "check": effort.check.as_secs_f64(),
            "total": total.as_secs_f64(),
        },
    })
}

fn success(plan: &Plan, losses: &[Loss], out: &Path, total: Duration) -> Value {
    let mut object = effort(&plan.effort, total);
    let by_state: Map<String, Value> = (plan.end_miss.states.iter())
        .map(|miss| {
            (
                miss.name.clone(),
                json!({"miss": miss.miss, "relative": miss.relative()}),
            )
        })
        .collect();
    object["duration_s"] = json!(plan.solution.duration_s);
    object["largest_violation"] = json!(
        plan.section
            .certificate
            .tightest()
            .map(|proof| proof.relative())
    );
    object["refinement"] = json!(plan.refinement.as_ref().map(|refinement| {
        json!({
            "tolerance": refinement.tolerance,
            "met": refinement.shortfall.is_none(),
            "meshes": meshes(&refinement.meshes),
            "words": refinement.in_words(),
        })
    }));
    object["finer_mesh"] = json!(plan.finer.map(|finer| {
        json!({"points": finer.points, "duration_s": finer.duration_s, "own_duration_s": finer.own_s, "relative_change": plan.change_to_finer()})
    }));
    let h = &plan.hamiltonian;
    object["hamiltonian"] =
        json!({"mean": h.mean, "rms_deviation": h.spread, "largest_deviation": h.largest});
    object["played"] = match &plan.played {
        Ok(played) => json!({
            "coordinate": played.coordinate,
            "miss": played.miss,
            "residual": played.residual,
            "residual_is_strain": played.strain,
            "limited_ticks": played.limited_ticks,
        }),
        Err(error) => json!({"error": error.to_string()}),
    };
    object["end_miss"] = json!(plan.end_miss.largest());
    object["end_miss_relative"] = json!(plan.end_miss.worst().map(|miss| miss.relative()));
    object["end_miss_by_state"] = Value::Object(by_state);
    object["warning"] = json!(plan.warning());
    object["stillness_lost"] = lost(losses);
    object["certificate"] = verify::object(&plan.section.certificate);
    object["trajectory"] = json!(out.display().to_string());
    object
}

/// What a failed command says in JSON.
pub(super) fn failed(failure: &(dyn std::error::Error + 'static), total: Duration) -> Value {
    let failure_of_plan = failure.downcast_ref::<PlanError>();
    let failure_of_plan = match failure_of_plan {
        Some(PlanError::TooFarApart { unsolved, .. }) => Some(unsolved.as_ref()),
        other => other,
    };
    let mut object = match failure_of_plan {
        Some(PlanError::Unsolved(diagnosis, spent)) => {
            let mut object = effort(spent, total);
            let worst = diagnosis.worst.as_ref().map(|v| {
                json!({"constraint": v.name, "dynamics": v.dynamics, "time_s": v.time_s, "amount": v.amount})
            });
            let saturated: Vec<Value> = (diagnosis.saturated.iter())
                .map(|s| json!({"limit": s.name, "share": s.share, "from_s": s.from_s, "to_s": s.to_s}))
                .collect();
            object["duration_s"] = json!(diagnosis.duration_s);
            object["violated_most"] = json!(worst);
            object["saturated"] = json!(saturated);
            object["nearest_limit"] = json!(
                diagnosis
                    .nearest
                    .as_ref()
                    .map(|n| json!({"limit": n.name, "share": n.share, "time_s": n.time_s}))
            );
            object
        }
        Some(
            PlanError::Missed { effort: spent, .. }
            | PlanError::Check { effort: spent, .. }
            | PlanError::NotCertified { effort: spent, .. }
            | PlanError::OtherPlant { effort: spent, .. },
        ) => {
            let mut object = effort(spent, total);
            object["status"] = json!("inaccurate");
            object
        }
        _ => json!({"status": "error"}),
    };
    object["message"] = json!(failure.to_string());
    object
}

fn words(plan: &Plan, out: &Path, total: Duration) -> String {
    let Effort {
        solver,
        iterations,
        rounds,
        restarts,
        intervals,
        variables,
        constraints,
        setup,
        solve,
        check,
        ..
    } = &plan.effort;
    let mut text = format!(
        "{:.3} ms, written to {}\n  {solver}: {iterations} iterations in {rounds} rounds, of which {restarts} led nowhere, {intervals} intervals, {variables} variables, {constraints} constraints\n",
        plan.solution.duration_s * 1e3,
        out.display()
    );
    text += &format!(
        "  setup {:.3} s, solve {:.3} s, check {:.3} s, in all {:.3} s\n",
        setup.as_secs_f64(),
        solve.as_secs_f64(),
        check.as_secs_f64(),
        total.as_secs_f64()
    );
    if let Some(worst) = plan.end_miss.worst() {
        text += &format!(
            "  integrated under the planned control the machine misses the end by {:.1e} of a state's range at most ({})\n",
            worst.relative(),
            worst.name
        );
    }
    if let Some(refinement) = &plan.refinement {
        text += &format!("  {}\n", refinement.in_words());
    }
    let certificate = &plan.section.certificate;
    let lines = [
        Some(certificate.verdict()),
        certificate.plants_in_words(),
        Some(plan.finer_in_words()),
        Some(plan.hamiltonian_in_words()),
        Some(plan.played_in_words()),
    ];
    for line in lines.into_iter().flatten() {
        text += &format!("  {line}\n");
    }
    text
}
