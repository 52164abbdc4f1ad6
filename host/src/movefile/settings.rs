//! Where the plan is computed and how exactly.

use super::error::{Fault, Problem};
use super::section::Section;
use crate::simulate::DriveSettings;
use clap::ValueEnum;
use serde::Deserialize;
use std::ops::RangeInclusive;

/// The mesh that the planner starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Number of intervals.
    pub intervals: usize,
    /// Collocation points in each.
    pub points: usize,
    /// Relative error down to which the mesh is refined, if it is.
    pub refine: Option<f64>,
}

/// Relative error that refinement aims at if none is given.
const REFINE_TOLERANCE: f64 = 1e-4;

/// Where the planner imposes the limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum LimitsAt {
    /// At the collocation points and between them
    #[default]
    Everywhere,
    /// At the collocation points only, as the paper does: between them they are exceeded, and a board refuses that
    Nodes,
}

/// How exactly and how long the solver works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    /// Where the limits are imposed.
    pub limits: LimitsAt,
    /// Relative tolerance on constraints and optimality.
    pub tolerance: f64,
    /// Iterations after which it gives up.
    pub max_iterations: usize,
    /// Share of its distance from singular poses, at the end that is nearer to one, that a move keeps all along. No key of the
    /// file: the planner raises it where nothing else helps.
    pub clearance: f64,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            limits: LimitsAt::default(),
            tolerance: 1e-6,
            max_iterations: 2000,
            clearance: 0.1,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshTable {
    intervals: i64,
    points: i64,
    refine: Option<bool>,
    tolerance: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SolverTable {
    limits: Option<LimitsAt>,
    tolerance: Option<f64>,
    max_iterations: Option<i64>,
}

impl Mesh {
    pub(super) fn read(section: &Section<'_>) -> Result<Self, Box<Fault>> {
        let table: MeshTable = section.read()?;
        let refine = table.refine.unwrap_or(false);
        let tolerance = table.tolerance.unwrap_or(REFINE_TOLERANCE);
        let rule = if table.tolerance.is_some() && !refine {
            Some("needs refine = true beside it")
        } else if !(1e-8..=1e-1).contains(&tolerance) {
            Some("must lie between 1e-8 and 0.1")
        } else {
            None
        };
        if let Some(rule) = rule {
            return Err(Fault::new(
                section.bytes("tolerance"),
                Problem::Value {
                    key: "tolerance".into(),
                    value: tolerance,
                    rule: rule.into(),
                },
            ));
        }
        Ok(Self {
            refine: refine.then_some(tolerance),
            // A planner's problem grows with both; beyond these it fits no machine this runs on.
            intervals: whole(section, "intervals", table.intervals, 1..=1000)?,
            // The basis on more points loses its digits in f32.
            points: whole(section, "points", table.points, 2..=32)?,
        })
    }
}

/// With 1e-11 neither the paper's move nor the axis is solved.
const LEAST_TOLERANCE: f64 = 1e-10;

impl Solver {
    pub(super) fn read(section: &Section<'_>) -> Result<Self, Box<Fault>> {
        let table: SolverTable = section.read()?;
        let default = Self::default();
        let tolerance = table.tolerance.unwrap_or(default.tolerance);
        // Written so that NaN fails too.
        if !(LEAST_TOLERANCE..=1e-2).contains(&tolerance) {
            return Err(Fault::new(
                section.bytes("tolerance"),
                Problem::Value {
                    key: "tolerance".into(),
                    value: tolerance,
                    rule: "must lie between 1e-10, about what f64 can reach in programs of this size, and 1e-2"
                        .into(),
                },
            ));
        }
        let max_iterations = match table.max_iterations {
            Some(count) => whole(section, "max_iterations", count, 1..=1_000_000)?,
            None => default.max_iterations,
        };
        Ok(Self {
            limits: table.limits.unwrap_or(default.limits),
            tolerance,
            max_iterations,
            clearance: default.clearance,
        })
    }
}

/// Reads the `[drive]` table.
pub(super) fn read_drive(section: &Section<'_>) -> Result<DriveSettings, Box<Fault>> {
    let settings: DriveSettings = section.read()?;
    settings.validate().map_err(|error| {
        Fault::new(
            section.bytes(error.key),
            Problem::Value {
                key: error.key.into(),
                value: error.value,
                rule: error.rule.into(),
            },
        )
    })?;
    Ok(settings)
}

fn whole(
    section: &Section<'_>,
    key: &str,
    value: i64,
    range: RangeInclusive<i64>,
) -> Result<usize, Box<Fault>> {
    usize::try_from(value)
        .ok()
        .filter(|_| range.contains(&value))
        .ok_or_else(|| {
            Fault::new(
                section.bytes(key),
                Problem::Value {
                    key: key.into(),
                    value: value as f64,
                    rule: format!("must lie between {} and {}", range.start(), range.end()),
                },
            )
        })
}
