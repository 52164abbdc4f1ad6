//! Robust moves that do not solve at once: from plants that differ less to those of the file, and what to say if that fails too.

use super::attempt::{Attempt, Solved};
use super::finer::Beside;
use super::robust::{robust_problem, with_every_plant};
use super::{Effort, ITERATIONS_PER_GUESS, PlanError, Shipped, from_first_guesses, move_problem};
use crate::certify::{Simulated, left_after};
use crate::movefile::{MoveFile, Robust};
use crate::nlp::Status;
use crate::ocp::{Guess, Solution};
use stillpoint_shared::Trajectory;

/// Shares of the way from the nominal plant to the others.
const STEPS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Halvings by which the spread that a motion suits is found.
const HALVINGS: usize = 8;

/// Solves for the nominal plant, then for plants that differ ever more from it, each time from the answer before.
pub(super) fn from_the_nominal_plant(
    attempt: &Attempt<'_>,
    robust: &Robust,
    effort: &mut Effort,
    beside: &mut Beside<'_, '_>,
) -> Result<Solved, PlanError> {
    let file = attempt.file;
    let mut alone = file.clone();
    alone.robust = None;
    let nominal = attempt.at(&alone, move_problem(&alone));
    let nominal = from_first_guesses(&alone, &nominal, effort, beside)?;
    let mesh = nominal.solution.mesh.clone();
    let mut solution = with_every_plant(file, robust, &nominal.solution);
    let mut reached: Option<MoveFile> = None;
    for share in STEPS {
        let Ok(nearer) = robust.part_of_the_way(&file.machine, share) else {
            break;
        };
        let mut part = file.clone();
        part.robust = Some(nearer.clone());
        let step = attempt.at(&part, robust_problem(&part, &nearer, None)?);
        let guess = Guess::from_solution(solution.clone());
        match step.solve(mesh.clone(), &guess, ITERATIONS_PER_GUESS, effort, beside) {
            Ok(solved) if share == 1.0 => return Ok(solved),
            Ok(solved) => solution = solved.solution,
            Err(diagnosis) if diagnosis.status == Status::Stopped => {
                return Err(PlanError::unsolved(diagnosis, effort));
            }
            Err(diagnosis) => {
                let instead = match &reached {
                    Some(part) => in_words(part, &solution, robust),
                    None => in_words(&alone, &nominal.solution, robust),
                };
                return Err(PlanError::TooFarApart {
                    unsolved: Box::new(PlanError::unsolved(diagnosis, effort)),
                    instead,
                });
            }
        }
        reached = Some(part);
    }
    unreachable!("the last step ends it")
}

/// What the plan of a file with fewer or nearer plants would do for those of `robust`.
fn in_words(file: &MoveFile, solution: &Solution, robust: &Robust) -> String {
    let planned = match &file.robust {
        None => "the nominal plant alone".to_owned(),
        Some(nearer) => names(nearer),
    };
    let Ok(shipped) = Shipped::of(file, solution) else {
        return format!("There is a plan for {planned}");
    };
    let left = rings_most(file, robust, &shipped.trajectory);
    let left = left.map_or_else(String::new, |(plant, row)| {
        format!(", and with {plant} {row}")
    });
    let suits = suited(file, robust, &shipped.trajectory);
    let suits = suits.map_or_else(
        || {
            format!(
                "; it keeps the bounds not even a {}th of the way to those",
                1 << HALVINGS
            )
        },
        |suits| format!("; it keeps the bounds up to {suits}"),
    );
    format!(
        "There is a plan for {planned}: it takes {:.3} ms{left}{suits}. Allow more to be left, or name plants nearer to the nominal one",
        solution.duration_s * 1e3
    )
}

fn names(robust: &Robust) -> String {
    let names: Vec<&str> = robust.scenarios.iter().map(|s| s.name.as_str()).collect();
    names.join(", ")
}

/// The plant, and what is left of what with it, that is largest against its bound.
fn rings_most(
    file: &MoveFile,
    robust: &Robust,
    trajectory: &Trajectory,
) -> Option<(String, Simulated)> {
    let rows = robust.scenarios.iter().flat_map(|scenario| {
        let rows = left_after(file, robust, scenario, trajectory).unwrap_or_default();
        rows.into_iter().map(|row| (scenario.name.clone(), row))
    });
    rows.max_by(|(_, a), (_, b)| (a.value / a.limit).total_cmp(&(b.value / b.limit)))
}

/// The plants, as far on the way from the nominal one to those of `robust` as a trajectory is still enough for, in words.
pub(super) fn suited(file: &MoveFile, robust: &Robust, trajectory: &Trajectory) -> Option<String> {
    let (mut suits, mut too_far) = (None, 1.0);
    let mut share = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (share + too_far);
        let nearer = robust.part_of_the_way(&file.machine, middle).ok()?;
        let most = rings_most(file, &nearer, trajectory);
        if most.is_some_and(|(_, row)| row.holds()) {
            share = middle;
            suits = Some(names(&nearer));
        } else {
            too_far = middle;
        }
    }
    suits
}
