//! A trajectory on machines that differ in one parameter, played by the executor on the simulated drives.

use crate::machine::{Change, MachineError};
use crate::movefile::{MachineKind, MoveFile};
use crate::simulate::usage::Usage;
use crate::simulate::{ClosedLoop, ClosedLoopError, DriveSettings, Metrics};
use std::str::FromStr;
use stillpoint_shared::Trajectory;

/// A parameter and the factors that it is multiplied by: `platform_mass_kg=0.8..1.2:9`.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRange {
    /// Key in the move file's `[machine]` table.
    pub parameter: String,
    /// Factors, ascending.
    pub factors: Vec<f64>,
}

/// Most machines of a sweep.
const MOST: usize = 1000;

/// What a text for a [`SweepRange`] looks like.
const FORM: &str =
    "write a parameter of [machine], two factors and how many: platform_mass_kg=0.8..1.2:9";

impl FromStr for SweepRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = || {
            let (parameter, range) = text.split_once('=')?;
            let (range, count) = range.rsplit_once(':')?;
            let (from, to) = range.split_once("..")?;
            let factor = |text: &str| text.trim().parse::<f64>().ok();
            Some((
                parameter.trim(),
                factor(from)?,
                factor(to)?,
                count.trim().parse().ok()?,
            ))
        };
        let (parameter, from, to, count): (&str, f64, f64, usize) = parts().ok_or(FORM)?;
        if parameter.is_empty() {
            return Err(FORM.to_owned());
        }
        if !(from.is_finite() && to.is_finite() && from > 0.0 && to > from) {
            return Err(format!(
                "the factors {from} and {to}: both must be positive numbers, and the second the greater one"
            ));
        }
        if !(2..=MOST).contains(&count) {
            return Err(format!("{count} machines: from 2 to {MOST} are possible"));
        }
        let step = (to - from) / (count - 1) as f64;
        Ok(Self {
            parameter: parameter.to_owned(),
            factors: (0..count).map(|k| from + step * k as f64).collect(),
        })
    }
}

/// What a machine does with a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Figures of merit.
    pub metrics: Metrics,
    /// How much of each limit is used.
    pub usages: Vec<Usage>,
    /// Ticks in which the executor's limiter acted.
    pub limited_ticks: usize,
}

/// One machine of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// By what the parameter was multiplied.
    pub factor: f64,
    /// The parameter, in the unit of its key.
    pub value: f64,
    /// What it does, or why it does not get to its end.
    pub outcome: Result<Outcome, ClosedLoopError>,
}

/// Why nothing can be swept.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// There is no such parameter, or no such machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// A factor changes nothing.
    #[error(
        "{parameter} is 0, and so is every multiple of it: sweep another parameter, or give it a value in [machine]"
    )]
    Zero {
        /// Key of the parameter.
        parameter: String,
    },
}

/// Plays a trajectory on one machine with some drives.
///
/// # Errors
/// [`ClosedLoopError`] when it does not get to its end.
pub fn outcome(
    file: &MoveFile,
    trajectory: &Trajectory,
    machine: &MachineKind,
    drives: &DriveSettings,
) -> Result<Outcome, ClosedLoopError> {
    let plant = machine.plant();
    let recording = ClosedLoop::new(plant, &file.limits, &file.from, drives).play(trajectory)?;
    Ok(Outcome {
        metrics: Metrics::of(plant, &recording),
        usages: Usage::all(plant, &file.limits, &recording),
        limited_ticks: recording.limited_ticks(),
    })
}

/// Plays a trajectory on every machine of a range, on all cores.
///
/// # Errors
/// [`SweepError`]; a machine that does not get to its end is none.
pub fn sweep(
    file: &MoveFile,
    trajectory: &Trajectory,
    range: &SweepRange,
) -> Result<Vec<Point>, SweepError> {
    let parameter = &range.parameter;
    let real = file.drive.real_machine(&file.machine);
    let mut machines = Vec::new();
    for &factor in &range.factors {
        machines.push((factor, real.changed(parameter, Change::Factor(factor))?));
    }
    if real.parameter(parameter) == Some(0.0) {
        return Err(SweepError::Zero {
            parameter: parameter.clone(),
        });
    }
    Ok(super::parallel::in_parallel(
        &machines,
        |(factor, machine)| Point {
            factor: *factor,
            value: machine.parameter(parameter).unwrap_or(f64::NAN),
            outcome: outcome(file, trajectory, machine, &file.drive),
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::{SweepError, SweepRange, sweep};
    use crate::baseline::{Baseline, plan_baseline};
    use crate::movefile::MoveFile;
    use crate::study::play;

    #[test]
    fn ranges_are_written_in_one_way() {
        let range: SweepRange = "platform_mass_kg=0.8..1.2:5".parse().expect("a range");
        assert_eq!(range.parameter, "platform_mass_kg");
        let close = range.factors.iter().zip([0.8, 0.9, 1.0, 1.1, 1.2]);
        assert!(close.clone().count() == 5 && close.clone().all(|(a, b)| (a - b).abs() < 1e-15));
        for (text, word) in [
            ("platform_mass_kg", "0.8..1.2:9"),
            ("=0.8..1.2:9", "0.8..1.2:9"),
            ("m=0.8..1.2", "0.8..1.2:9"),
            ("m=a..b:3", "0.8..1.2:9"),
            ("m=0..1.2:3", "positive"),
            ("m=1.2..0.8:3", "greater"),
            ("m=0.8..inf:3", "positive"),
            ("m=NaN..1:3", "positive"),
            ("m=0.8..1.2:1", "from 2"),
            ("m=0.8..1.2:100000", "from 2"),
        ] {
            let refused = text.parse::<SweepRange>().expect_err(text);
            assert!(refused.contains(word), "{text}: {refused}");
        }
    }

    #[test]
    fn a_machine_of_the_sweep_does_what_it_does_alone() {
        let file = MoveFile::parse(include_str!("../../moves/axis.toml"), "axis.toml");
        let file = file.expect("a move");
        let baseline = Baseline::named("quintic+zvd").expect("known");
        let trajectory = plan_baseline(&file, baseline).expect("possible").trajectory;
        let range = "load_inertia_kg_m2=0.9..1.1:3".parse().expect("a range");
        let points = sweep(&file, &trajectory, &range).expect("possible");
        assert!((points[2].value - 0.033).abs() < 1e-12);
        for (point, payload) in points.iter().zip([0.9, 1.0, 1.1]) {
            let mut alone = file.clone();
            alone.drive.payload_factor = payload;
            let alone = play("alone", &alone, &trajectory).expect("plays");
            let outcome = point.outcome.as_ref().expect("plays");
            let difference = outcome.metrics.residual() - alone.metrics.residual();
            assert!(difference.abs() < 1e-9, "{difference}");
            let twist = outcome.usages.iter().find(|u| u.group == "twist_rad");
            let peak = alone.metrics.elastic_displacement[0].peak;
            assert!((twist.expect("limited").ratio - peak / 0.05).abs() < 1e-6);
        }

        let unknown = "payload=0.9..1.1:3".parse().expect("a range");
        let refused = sweep(&file, &trajectory, &unknown).expect_err("no such parameter");
        assert!(
            refused.to_string().contains("load_inertia_kg_m2"),
            "{refused}"
        );
        let nothing = "damping_nm_s_per_rad=0.9..1.1:3".parse().expect("a range");
        let refused = sweep(&file, &trajectory, &nothing);
        assert!(matches!(refused, Err(SweepError::Zero { .. })));
    }
}
