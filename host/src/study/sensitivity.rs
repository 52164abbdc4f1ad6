//! How much depends on what nobody knows exactly: changes of the residual and of the use of every limit with payload, stiffness,
//! damping and friction.
//!
//! Differences of simulations through the executor. The use of a limit is smooth: its derivative is a central difference where
//! the parameter can change both ways. What is left after an optimal move is none: it has a kink at zero where the machine is
//! the planned one, so the greater change of both sides is given.

use super::compare::ResidualUnit;
use super::parallel::in_parallel;
use super::sweep::{Outcome, outcome};
use crate::machine::{Change, MachineError};
use crate::movefile::{MachineKind, MoveFile};
use crate::simulate::{ClosedLoopError, DriveSettings};
use stillpoint_shared::Trajectory;

/// Relative step of payload and stiffness.
const STEP: f64 = 0.01;
/// Step of the elastic members' damping, as ratio of critical.
const DAMPING_STEP: f64 = 0.01;
/// Share of the torque limit that the step of friction takes at the largest speed.
const FRICTION_SHARE: f64 = 0.01;

/// What depends on one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: String,
    /// By how much it was changed, in words.
    pub step: String,
    /// The step as a number: a share for payload and stiffness, in its unit for the others.
    pub step_size: f64,
    /// Change of the residual (SI), the greater one of both ways.
    pub residual: f64,
    /// Change of the use of each limit, a share of it: name of the limit and change.
    pub usages: Vec<(&'static str, f64)>,
}

/// Why there are no derivatives.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// There is no such machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The move does not get to its end.
    #[error("{parameter} {step}: {source}")]
    ClosedLoop {
        /// What was changed.
        parameter: String,
        /// By how much.
        step: String,
        /// What happened.
        source: ClosedLoopError,
    },
}

/// A machine and drives that differ in one parameter, one way or both.
struct Variation {
    parameter: String,
    step: String,
    step_size: f64,
    real: Vec<(MachineKind, DriveSettings)>,
}

fn variations(file: &MoveFile) -> Result<Vec<Variation>, MachineError> {
    let (real, drive) = (file.drive.real_machine(&file.machine), file.drive);
    let mut all = Vec::new();
    for key in [file.machine.payload(), file.machine.stiffness()] {
        let changed = |step: f64| real.changed(key, Change::Factor(1.0 + step));
        all.push(Variation {
            parameter: key.to_owned(),
            step: "+1 %".to_owned(),
            step_size: STEP,
            real: vec![(changed(STEP)?, drive), (changed(-STEP)?, drive)],
        });
    }
    let damped = DriveSettings {
        elastic_damping_ratio: (drive.elastic_damping_ratio + DAMPING_STEP).min(1.0),
        ..drive
    };
    all.push(Variation {
        parameter: "elastic_damping_ratio".to_owned(),
        step: format!("+{DAMPING_STEP}"),
        step_size: DAMPING_STEP,
        real: vec![(damped.real_machine(&file.machine), damped)],
    });
    let speed_rad_per_s = file
        .limits
        .joint_speed_rad_per_s(file.machine.plant().reducer_ratio());
    let friction = FRICTION_SHARE * file.limits.torque_nm / speed_rad_per_s;
    let rubbing = DriveSettings {
        joint_friction_nm_s_per_rad: drive.joint_friction_nm_s_per_rad + friction,
        ..drive
    };
    all.push(Variation {
        parameter: "joint_friction_nm_s_per_rad".to_owned(),
        step: format!("+{friction:.2e}"),
        step_size: friction,
        real: vec![(real, rubbing)],
    });
    Ok(all)
}

/// Changes with payload, stiffness, damping and friction.
///
/// # Errors
/// [`SensitivityError`] where a machine so near to the planned one does not get to its end.
pub fn sensitivities(
    file: &MoveFile,
    trajectory: &Trajectory,
) -> Result<Vec<Sensitivity>, SensitivityError> {
    let real = file.drive.real_machine(&file.machine);
    let mut variations = variations(file)?;
    variations.push(Variation {
        parameter: "nothing".to_owned(),
        step: "changed".to_owned(),
        step_size: 0.0,
        real: vec![(real, file.drive)],
    });
    let runs: Vec<_> = variations
        .iter()
        .flat_map(|variation| variation.real.iter().map(move |real| (variation, real)))
        .collect();
    let outcomes = in_parallel(&runs, |(variation, (machine, drives))| {
        outcome(file, trajectory, machine, drives).map_err(|source| SensitivityError::ClosedLoop {
            parameter: variation.parameter.clone(),
            step: variation.step.clone(),
            source,
        })
    });
    let mut outcomes = outcomes.into_iter().collect::<Result<Vec<Outcome>, _>>()?;
    // One for every variation, and the last for the machine as it is.
    let as_is = outcomes.pop();
    variations.pop();
    let mut outcomes = outcomes.into_iter();
    let all = variations.into_iter().filter_map(|variation| {
        let as_is = as_is.as_ref()?;
        let plus = outcomes.next()?;
        let minus = match variation.real.len() {
            2 => outcomes.next(),
            _ => None,
        };
        Some(variation.sensitivity(as_is, &plus, minus.as_ref()))
    });
    Ok(all.collect())
}

impl Sensitivity {
    /// Headings and cells of a table: residuals as they are shown, uses of limits in points of a per cent.
    #[must_use]
    pub fn table(file: &MoveFile, all: &[Self]) -> (Vec<String>, Vec<Vec<String>>) {
        let unit = ResidualUnit::of(file);
        let mut headings = vec![
            "change of".to_owned(),
            "by".to_owned(),
            format!("{}, {}", unit.name, unit.unit),
        ];
        let groups = all.first().map_or(&[][..], |first| &first.usages);
        headings.extend(groups.iter().map(|(group, _)| format!("{group}, %")));
        let row = |sensitivity: &Self| {
            let mut cells = vec![
                sensitivity.parameter.clone(),
                sensitivity.step.clone(),
                format!("{:+.2}", sensitivity.residual * unit.factor),
            ];
            let usages = sensitivity.usages.iter();
            cells.extend(usages.map(|(_, change)| format!("{:+.2}", change * 100.0)));
            cells
        };
        (headings, all.iter().map(row).collect())
    }
}

impl Variation {
    fn sensitivity(self, as_is: &Outcome, plus: &Outcome, minus: Option<&Outcome>) -> Sensitivity {
        let residual = |outcome: &Outcome| outcome.metrics.residual() - as_is.metrics.residual();
        let changes = [Some(residual(plus)), minus.map(residual)];
        let greatest = changes
            .into_iter()
            .flatten()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let (from, steps) = minus.map_or((as_is, 1.0), |minus| (minus, 2.0));
        let pairs = plus.usages.iter().zip(&from.usages);
        Sensitivity {
            residual: greatest.unwrap_or(0.0),
            usages: pairs
                .map(|(plus, minus)| (plus.group, (plus.ratio - minus.ratio) / steps))
                .collect(),
            parameter: self.parameter,
            step: self.step,
            step_size: self.step_size,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Sensitivity, sensitivities};
    use crate::movefile::MoveFile;
    use crate::simulate::path::RigidPath;
    use crate::simulate::profile::{Law, Profile};
    use crate::simulate::shaper::Shaper;
    use crate::simulate::trajectory::{Feedforward, from_path};

    /// An axis that moves slowly bends as a static load bends it, J θ̈ / k, and its motor moves both inertias.
    #[test]
    fn a_slow_axis_shows_the_laws_of_statics() {
        let file = MoveFile::parse(include_str!("../../moves/axis.toml"), "axis.toml");
        let file = file.expect("a move");
        let duration_s = 2.0;
        let profile = Profile::new(Law::Quintic, duration_s, Shaper::none());
        let plant = file.machine.plant();
        let path = RigidPath::new(plant, &file.from, &file.to, &profile);
        let trajectory = from_path(1, plant, &file.limits, &path, Feedforward::Rigid);
        let all = sensitivities(&file, &trajectory.expect("fits")).expect("plays");
        let names: Vec<&str> = all.iter().map(|s| s.parameter.as_str()).collect();
        let expected = [
            "load_inertia_kg_m2",
            "stiffness_nm_per_rad",
            "elastic_damping_ratio",
            "joint_friction_nm_s_per_rad",
        ];
        assert_eq!(names, expected);
        let use_of = |sensitivity: &Sensitivity, group: &str| {
            let mut usages = sensitivity.usages.iter();
            usages.find(|(name, _)| *name == group).expect(group).1
        };
        let close = |found: f64, expected: f64, off: f64| {
            assert!((found / expected - 1.0).abs() < off, "{found} {expected}");
        };
        // Largest acceleration of the quintic: 10/√3 over the duration squared.
        let most = 10.0 / 3.0_f64.sqrt() / (duration_s * duration_s);
        let twist = 0.03 * most / 200.0 / 0.05;
        close(use_of(&all[0], "twist_rad"), 0.01 * twist, 0.05);
        close(use_of(&all[1], "twist_rad"), -0.01 * twist, 0.05);
        // The drives give way a little before they push.
        close(use_of(&all[0], "torque"), 0.01 * 0.03 * most / 20.0, 0.15);
        // Where the acceleration is largest, the speed is 5/6 of the mean. The last digit of the position in f32 makes a part of
        // so small a torque.
        let speed_rad_per_s = 5.0 / 6.0 / duration_s;
        close(
            use_of(&all[3], "torque"),
            all[3].step_size * speed_rad_per_s / 20.0,
            0.5,
        );
        assert!(use_of(&all[0], "speed").abs() < 1e-3);
    }
}
