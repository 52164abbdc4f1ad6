//! Who is compared.

use super::motion::{Drives, Motion};
use super::{SPREAD, factors, worst};
use crate::baseline::{Baseline, plan_baseline};
use crate::machine::{Change, OutputKind};
use crate::movefile::{MoveFile, Residual, Robust, Scenario};
use crate::nlp::Pounce;
use crate::plan::plan;
use crate::simulate::profile::Law;
use crate::simulate::shortest::Task;
use crate::study::parallel::in_parallel;

/// What a robust plan that is made without a `[robust]` table may leave, over what the nominal one leaves with the same
/// payloads.
const LEFT_BY_DEFAULT: f64 = 0.1;

/// The kind of a planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The fastest move of the planned machine.
    Nominal,
    /// The fastest move that suits several machines.
    Robust,
    /// A quintic.
    Quintic,
    /// An S-curve.
    SCurve,
}

impl Family {
    /// Whether it is a baseline.
    #[must_use]
    pub fn is_shaped(self) -> bool {
        matches!(self, Self::Quintic | Self::SCurve)
    }
}

/// A planner and its motion, or why it has none.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub family: Family,
    /// What it planned.
    pub motion: Result<Motion, String>,
}

fn planned(file: &MoveFile) -> Result<Motion, String> {
    let plan = plan(file, &Pounce, Box::new(|_, _| true));
    plan.map(|plan| Motion::Planned(Box::new(plan)))
        .map_err(|error| error.to_string())
}

/// The fastest move of the nominal machine and that of the `[robust]` table, or else of a default one: payload ±20 %, a
/// tenth of what the nominal move leaves then.
#[must_use]
pub fn robust_beside(file: &MoveFile) -> Vec<Candidate> {
    let nominal_file = MoveFile {
        robust: None,
        ..file.clone()
    };
    let nominal = planned(&nominal_file);
    let robust = match (&file.robust, &nominal) {
        (Some(_), _) => planned(file),
        (None, Ok(motion)) => {
            let bound = LEFT_BY_DEFAULT * worst_within_spread(&nominal_file, motion);
            with_default_spread(&nominal_file, bound).and_then(|file| planned(&file))
        }
        (None, Err(_)) => Err("without a nominal plan there is no bound to plan for".to_owned()),
    };
    let candidate = |name: &str, family, motion| Candidate {
        name: name.to_owned(),
        family,
        motion,
    };
    vec![
        candidate("stillpoint, robust", Family::Robust, robust),
        candidate("stillpoint, nominal", Family::Nominal, nominal),
    ]
}

/// The most that a motion leaves with a payload ±20 % and drives that follow exactly.
#[must_use]
pub fn worst_within_spread(file: &MoveFile, motion: &Motion) -> f64 {
    let payload = file.machine.payload();
    let left = motion.residuals(file, payload, &factors(SPREAD), Drives::Exact, &mut vec![]);
    worst(&left, SPREAD)
}

/// A move file with a robust table: payload ±20 %, limits for the nominal machine, and a bound on the residual strain, or on
/// the elastic displacement of a machine without gauges.
///
/// # Errors
/// A sentence where there is no machine with such a payload.
pub fn with_default_spread(file: &MoveFile, bound: f64) -> Result<MoveFile, String> {
    let payload = file.machine.payload();
    let scenario = |factor: f64| {
        let change = Change::Factor(factor);
        Scenario::new(&file.machine, payload, change, false).map_err(|error| error.to_string())
    };
    let outputs = file.machine.plant().outputs();
    let of_kind = |kind| outputs.iter().find(move |output| output.kind == kind);
    let watched = of_kind(OutputKind::Strain).or_else(|| of_kind(OutputKind::ElasticDisplacement));
    let watched = watched.ok_or("the machine has no output that shows vibration")?;
    Ok(MoveFile {
        robust: Some(Robust {
            scenarios: vec![scenario(1.0 - SPREAD)?, scenario(1.0 + SPREAD)?],
            residuals: vec![(Residual::Outputs(watched.kind, watched.unit), bound)],
        }),
        ..file.clone()
    })
}

/// All baselines that the machine has enough modes for.
#[must_use]
pub fn baselines(file: &MoveFile) -> Vec<Candidate> {
    let task = Task::from(file);
    // Without modes each says why it fails.
    let known = Baseline::all_for(&task).unwrap_or_else(|_| Baseline::ALL.to_vec());
    in_parallel(&known, |baseline| Candidate {
        name: baseline.name().to_owned(),
        family: match baseline.law() {
            Law::Quintic => Family::Quintic,
            Law::SCurve => Family::SCurve,
        },
        motion: plan_baseline(file, *baseline)
            .map(|plan| Motion::Shaped(Box::new(plan)))
            .map_err(|error| error.to_string()),
    })
}
