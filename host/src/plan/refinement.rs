//! Refinement of a move's mesh, as far as the board has room.

use super::attempt::{Attempt, Solved};
use super::finer::Beside;
use super::{Effort, PlanError};
use crate::movefile::MoveFile;
use crate::ocp::{Guess, Judgement, Mesh, MeshRecord, judge};
use stillpoint_shared::trajectory::{MAX_BASES, MAX_COEFFICIENTS, MAX_INTERVALS, QUANTITIES};

/// Meshes after which refinement ends.
const MAX_MESHES: usize = 20;

/// What refinement of the mesh did.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// The relative error asked for.
    pub tolerance: f64,
    /// All meshes, the objective being the duration in seconds.
    pub meshes: Vec<MeshRecord>,
    /// Why it ended before the tolerance was met.
    pub shortfall: Option<Shortfall>,
}

/// Why refinement ended early.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shortfall {
    /// The next mesh does not fit the board.
    Capacity {
        /// What there would be too many of.
        what: &'static str,
        /// How many.
        needed: usize,
        /// How many the board takes.
        most: usize,
    },
    /// The solver found no answer on the next mesh.
    Unsolved {
        /// Its intervals.
        intervals: usize,
        /// Its points.
        points: usize,
    },
    /// The meshes are used up.
    Meshes,
}

impl Refinement {
    /// What came of it.
    #[must_use]
    pub fn in_words(&self) -> String {
        let (Some(last), count) = (self.meshes.last(), self.meshes.len()) else {
            return String::new();
        };
        let reached = format!(
            "{} intervals, {} points: the dynamics hold to {:.1e} ({:.1e} was asked for)",
            last.intervals, last.points, last.error, self.tolerance
        );
        match &self.shortfall {
            None => format!("Refined over {count} meshes to {reached}."),
            Some(Shortfall::Capacity { what, needed, most }) => format!(
                "The board's capacity ends the refinement at {reached}: the next mesh would have {needed} {what}, and the board takes {most}."
            ),
            Some(Shortfall::Unsolved { intervals, points }) => format!(
                "Refinement ends at {reached}: on the next mesh, of {intervals} intervals and {points} points, the solver found no answer."
            ),
            Some(Shortfall::Meshes) => {
                format!("Refinement ends after {count} meshes at {reached}.")
            }
        }
    }
}

/// Solves again on finer meshes until the tolerance is met; `solved` is the answer on the last one that has one.
pub(super) fn refine(
    attempt: &Attempt<'_>,
    solved: &mut Solved,
    tolerance: f64,
    effort: &mut Effort,
    beside: &mut Beside<'_, '_>,
) -> Result<Refinement, PlanError> {
    let axes = attempt.file.machine.plant().axis_count();
    let mut meshes: Vec<MeshRecord> = Vec::new();
    let mut before = 0;
    let shortfall = loop {
        let solution = &solved.solution;
        let duration_s = solution.duration_s;
        let last = meshes.last().map(|mesh| mesh.objective);
        let Judgement {
            error,
            change,
            finer,
        } = judge(&attempt.problem, solution, duration_s, last, tolerance);
        meshes.push(MeshRecord {
            intervals: solution.mesh.intervals().len(),
            points: solution.mesh.points(),
            objective: duration_s,
            error,
            change,
            iterations: effort.iterations - before,
        });
        before = effort.iterations;
        let Some(mesh) = finer else {
            break None;
        };
        if let Some(capacity) = too_large(&mesh, axes) {
            break Some(capacity);
        }
        if meshes.len() >= MAX_MESHES {
            break Some(Shortfall::Meshes);
        }
        let (intervals, points) = (mesh.intervals().len(), mesh.points());
        let guess = Guess::from_solution(solution.clone());
        let left = (attempt.file.solver.max_iterations).saturating_sub(effort.iterations);
        match attempt.solve(mesh, &guess, left, effort, beside) {
            Ok(finer) => *solved = finer,
            Err(diagnosis) if diagnosis.status == crate::nlp::Status::Stopped => {
                return Err(PlanError::unsolved(diagnosis, effort));
            }
            Err(_) => break Some(Shortfall::Unsolved { intervals, points }),
        }
    };
    Ok(Refinement {
        tolerance,
        meshes,
        shortfall,
    })
}

/// Whether the board has room for the mesh of a file.
pub(super) fn fits(file: &MoveFile) -> bool {
    let mesh = Mesh::uniform(file.mesh.intervals, file.mesh.points);
    too_large(&mesh, file.machine.plant().axis_count()).is_none()
}

/// What of the board's capacity a mesh exceeds.
fn too_large(mesh: &Mesh, axes: usize) -> Option<Shortfall> {
    let intervals = mesh.intervals();
    let nodes: usize = intervals.iter().map(|interval| interval.points + 1).sum();
    let mut points: Vec<usize> = intervals.iter().map(|interval| interval.points).collect();
    points.sort_unstable();
    points.dedup();
    let needs = [
        ("intervals", intervals.len(), MAX_INTERVALS),
        ("coefficients", nodes * axes * QUANTITIES, MAX_COEFFICIENTS),
        ("different numbers of points", points.len(), MAX_BASES),
    ];
    needs
        .into_iter()
        .find(|(_, needed, most)| needed > most)
        .map(|(what, needed, most)| Shortfall::Capacity { what, needed, most })
}
