//! What the plants of a robust move ring with, by simulation along what is shipped, against what is asked for.
//!
//! The plan bounds it for its own polynomials, which keep the dynamics at the points only: simulated, somewhat more or less is
//! left. Where it is more, bounds are drawn in by that, and the plan is solved again from where it ended.

use super::attempt::{Attempt, Solved};
use super::finer::Beside;
use super::robust::robust_problem;
use super::shipped::Shipped;
use super::spread::suited;
use super::{Effort, PlanError};
use crate::certify::{PlantProofs, Simulated};
use crate::movefile::{LimitsAt, MoveFile};
use crate::nlp::Status;
use crate::ocp::Guess;

/// Times that bounds are drawn in.
const ROUNDS: usize = 3;

/// By how much further than what is left too much, as a share.
const BEYOND: f64 = 1e-3;

/// What is left of a bound at least when it is drawn in.
const LEAST_FACTOR: f64 = 0.3;

/// Solves again with bounds drawn in until every plant is as still as it is asked to be, or no answer is found any more.
/// Returns the file with the bounds that led there.
pub(super) fn drawn_in(
    attempt: &Attempt<'_>,
    solved: &mut Solved,
    shipped: &mut Shipped,
    effort: &mut Effort,
    beside: &mut Beside<'_, '_>,
) -> Result<MoveFile, PlanError> {
    let file = attempt.file;
    let mut narrower = file.clone();
    for _ in 0..ROUNDS {
        let Some((_, worst)) = rings_most(shipped).filter(|(_, worst)| !worst.holds()) else {
            break;
        };
        // What is too much comes from the mesh, and hardly falls with the bound.
        let excess = worst.value / worst.limit - 1.0;
        let Some(robust) = &mut narrower.robust else {
            break;
        };
        let factor = (1.0 - excess - BEYOND).max(LEAST_FACTOR);
        for (_, bound) in &mut robust.residuals {
            *bound *= factor;
        }
        let robust = robust.clone();
        let problem = robust_problem(&narrower, &robust, Some(&solved.solution))?;
        let attempt = attempt.at(&narrower, problem);
        let again = match file.solver.limits {
            LimitsAt::Everywhere => attempt.rounds(solved.clone(), effort, beside),
            LimitsAt::Nodes => {
                let guess = Guess::from_solution(solved.solution.clone());
                let left = file.solver.max_iterations.saturating_sub(effort.iterations);
                attempt.solve(solved.solution.mesh.clone(), &guess, left, effort, beside)
            }
        };
        match again {
            Ok(again) => *solved = again,
            Err(diagnosis) if diagnosis.status == Status::Stopped => {
                return Err(PlanError::unsolved(diagnosis, effort));
            }
            Err(_) => break,
        }
        *shipped = Shipped::of(file, &solved.solution)?;
    }
    Ok(narrower)
}

/// What is left too much, or beyond another plant's limits, as an error.
pub(super) fn check(file: &MoveFile, shipped: &Shipped, effort: &Effort) -> Result<(), PlanError> {
    let rings = rings_most(shipped).filter(|(_, worst)| !worst.holds());
    let left = rings.map(|(plant, worst)| format!("{worst} with {plant}, by simulation"));
    let rings = left.is_some();
    let mut plants = shipped.certificate.plants.iter();
    let Some(broken) = left.or_else(|| plants.find_map(PlantProofs::broken)) else {
        return Ok(());
    };
    let robust = file.robust.as_ref().filter(|_| rings);
    let suits = robust.and_then(|robust| suited(file, robust, &shipped.trajectory));
    Err(PlanError::OtherPlant {
        broken,
        suits: suits.map_or_else(String::new, |suits| {
            format!("; the same motion keeps the bounds up to {suits}")
        }),
        effort: Box::new(effort.clone()),
    })
}

/// The plant, and what is left of what with it, that is largest against its bound.
fn rings_most(shipped: &Shipped) -> Option<(&str, &Simulated)> {
    let plants = shipped.certificate.plants.iter();
    let left = plants.flat_map(|plant| {
        let after = plant.simulated.iter().filter(|row| row.after);
        after.map(|row| (plant.name.as_str(), row))
    });
    left.max_by(|(_, a), (_, b)| (a.value / a.limit).total_cmp(&(b.value / b.limit)))
}
