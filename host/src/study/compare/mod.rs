//! Every planner on one move: how long it takes, and what is left when the machine is not the planned one.

mod motion;
mod picture;
mod planners;
mod words;

pub use motion::{Drives, Motion, Stopped, SweepFault};
pub use planners::{
    Candidate, Family, baselines, robust_beside, with_default_spread, worst_within_spread,
};

use super::parallel::in_parallel;
use crate::machine::OutputKind;
use crate::movefile::MoveFile;

/// Farthest that the payload is off, and the stiffness, as shares.
pub const PAYLOAD_SPREAD: f64 = 0.3;
/// See [`PAYLOAD_SPREAD`].
pub const STIFFNESS_SPREAD: f64 = 0.2;
/// The spread by which planners are compared.
pub const SPREAD: f64 = 0.2;
/// Distance of two factors of a sweep.
const STEP: f64 = 0.05;

/// All planners on a move.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Name of the move.
    pub name: String,
    /// What is left is measured in this.
    pub residual: ResidualUnit,
    /// What was compared, in the order of the table.
    pub planners: Vec<Planner>,
}

/// How what is left is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualUnit {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Shown value per SI value.
    pub factor: f64,
}

/// One planner.
#[derive(Clone, Debug)]
pub struct Planner {
    /// Its name.
    pub name: String,
    /// Which kind it is of.
    pub family: Family,
    /// What it comes to, or why it does not.
    pub result: Result<Rated, String>,
}

/// What a planner comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Rated {
    /// Duration of its move.
    pub duration_s: f64,
    /// With the executor and the simulated drives of the move file.
    pub simulated: Residuals,
    /// With drives that follow exactly.
    pub exact: Residuals,
    /// Machines on which it does not get to its end.
    pub stopped: Vec<Stopped>,
}

/// What is left over a range of machines: factors and residuals (SI), ascending; infinite where the move is stopped.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals {
    /// By payload.
    pub payload: Vec<(f64, f64)>,
    /// By stiffness.
    pub stiffness: Vec<(f64, f64)>,
}

impl Residuals {
    fn of(file: &MoveFile, motion: &Motion, drives: Drives, stopped: &mut Vec<Stopped>) -> Self {
        let mut sweep = |parameter, spread| {
            motion.residuals(file, parameter, &factors(spread), drives, stopped)
        };
        Self {
            payload: sweep(file.machine.payload(), PAYLOAD_SPREAD),
            stiffness: sweep(file.machine.stiffness(), STIFFNESS_SPREAD),
        }
    }

    /// With the planned machine.
    #[must_use]
    pub fn nominal(&self) -> f64 {
        worst(&self.payload, 0.0)
    }

    /// The most that is left with a payload off by no more than a share.
    #[must_use]
    pub fn worst_by_payload(&self, spread: f64) -> f64 {
        worst(&self.payload, spread)
    }

    /// The most that is left over all stiffnesses.
    #[must_use]
    pub fn worst_by_stiffness(&self) -> f64 {
        worst(&self.stiffness, STIFFNESS_SPREAD)
    }
}

/// 1 − spread to 1 + spread.
#[must_use]
pub fn factors(spread: f64) -> Vec<f64> {
    let steps = (spread / STEP).round() as i32;
    let share = |step: i32| 1.0 + f64::from(step) * STEP;
    // Two digits, as people write them.
    (-steps..=steps)
        .map(|step| (share(step) * 100.0).round() / 100.0)
        .collect()
}

/// The largest residual within a spread.
#[must_use]
pub fn worst(sweep: &[(f64, f64)], spread: f64) -> f64 {
    let inside = sweep
        .iter()
        .filter(|(factor, _)| (factor - 1.0).abs() < spread + 0.1 * STEP);
    inside.fold(0.0, |most, (_, residual)| most.max(*residual))
}

impl ResidualUnit {
    /// That of a move's machine: strain where there are gauges, else elastic displacement.
    #[must_use]
    pub fn of(file: &MoveFile) -> Self {
        let outputs = file.machine.plant().outputs();
        let (name, unit, factor) = if outputs.iter().any(|o| o.kind == OutputKind::Strain) {
            ("residual strain", "µε", 1e6)
        } else {
            let mut outputs = outputs.iter();
            let first = outputs.find(|o| o.kind == OutputKind::ElasticDisplacement);
            match first.map(|output| output.unit) {
                Some("rad") => ("residual twist", "mrad", 1e3),
                _ => ("residual displacement", "mm", 1e3),
            }
        };
        Self { name, unit, factor }
    }
}

/// Plans and simulates all.
#[must_use]
pub fn compare(file: &MoveFile) -> Comparison {
    let mut candidates = robust_beside(file);
    candidates.extend(baselines(file));
    let mut planners = in_parallel(&candidates, |candidate| Planner {
        name: candidate.name.clone(),
        family: candidate.family,
        result: candidate
            .motion
            .as_ref()
            .map_err(Clone::clone)
            .map(|motion| {
                let mut stopped = Vec::new();
                Rated {
                    duration_s: motion.duration_s(),
                    simulated: Residuals::of(file, motion, Drives::Simulated, &mut stopped),
                    exact: Residuals::of(file, motion, Drives::Exact, &mut stopped),
                    stopped,
                }
            }),
    });
    let duration_s = |planner: &Planner| {
        let rated = planner.result.as_ref().ok();
        rated.map_or(f64::INFINITY, |rated| rated.duration_s)
    };
    planners.sort_by(|a, b| {
        let key = |planner: &Planner| (planner.family.is_shaped(), duration_s(planner));
        let ((a, a_s), (b, b_s)) = (key(a), key(b));
        a.cmp(&b).then(a_s.total_cmp(&b_s))
    });
    Comparison {
        name: file.name.clone(),
        residual: ResidualUnit::of(file),
        planners,
    }
}

impl Comparison {
    /// The baselines that no other one beats in both duration and worst residual over the payload ±20 %, shortest first.
    #[must_use]
    pub fn front(&self) -> Vec<&Planner> {
        let rated = |planner: &Planner| {
            let rated = planner.result.as_ref().ok()?;
            let worst = rated.simulated.worst_by_payload(SPREAD);
            worst.is_finite().then_some((rated.duration_s, worst))
        };
        let baselines = || self.planners.iter().filter(|p| p.family.is_shaped());
        let beaten = |own: (f64, f64)| {
            let others = baselines().filter_map(rated);
            others
                .into_iter()
                .any(|other| other.0 <= own.0 && other.1 <= own.1 && other != own)
        };
        let best = baselines().filter(|planner| rated(planner).is_some_and(|own| !beaten(own)));
        best.collect()
    }
}

#[cfg(test)]
mod tests;
