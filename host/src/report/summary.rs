//! The comparison of runs: one row each, in SI, for people and for machines.

use serde::Serialize;

/// What one run comes to. The names are those of `summary.json`; what a machine or a source does not have is `null`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SummaryRow {
    /// What was run.
    pub name: String,
    /// Duration of the command.
    pub duration_s: Option<f64>,
    /// Largest magnitude of strain, during the move and after it.
    pub peak_strain: Option<f64>,
    /// Largest magnitude of strain after the move.
    pub residual_strain: Option<f64>,
    /// Largest magnitude of elastic displacement.
    pub elastic_displacement_m: Option<f64>,
    /// Whether any elastic displacement is beyond its own limit.
    #[serde(skip)]
    pub elastic_displacement_beyond: bool,
    /// Largest stress.
    pub stress_pa: Option<f64>,
    /// Largest magnitude of torque at a reducer output.
    pub torque_nm: Option<f64>,
    /// Largest magnitude of its rate.
    pub torque_rate_nm_per_s: Option<f64>,
    /// Largest motor speed.
    pub motor_speed_rpm: Option<f64>,
}

/// Writes rows as a JSON list; what is not finite is `null`.
#[must_use]
pub fn summary_json(rows: &[SummaryRow]) -> String {
    // Numbers and strings only: this cannot fail.
    let mut text = serde_json::to_string_pretty(rows).unwrap_or_default();
    text.push('\n');
    text
}

/// A column of the comparison as people read it.
pub(super) struct Column {
    /// Heading, a word or two per line.
    pub(super) heading: [&'static str; 2],
    /// Unit shown.
    pub(super) unit: &'static str,
    /// One cell per row.
    pub(super) cells: Vec<Cell>,
}

/// A value as people read it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// Digits, or a dash.
    pub(super) text: String,
    /// Whether it is beyond the limit by more than [`MARKED_BEYOND`].
    pub(super) beyond: bool,
}

/// Excess over a limit, relative, from which a value is marked.
pub const MARKED_BEYOND: f64 = 0.005;

/// Explains the mark.
pub(super) const BEYOND: &str = "beyond the machine's limit by more than 0.5 %";

type Get = fn(&SummaryRow) -> Option<f64>;

/// Heading, unit, shown value per SI value, field.
const COLUMNS: [([&str; 2], &str, f64, Get); 8] = [
    (["", "duration"], "ms", 1e3, |r| r.duration_s),
    (["peak", "strain"], "µε", 1e6, |r| r.peak_strain),
    (["residual", "strain"], "µε", 1e6, |r| r.residual_strain),
    (["elastic", "displ."], "mm", 1e3, |r| {
        r.elastic_displacement_m
    }),
    (["", "stress"], "MPa", 1e-6, |r| r.stress_pa),
    (["peak", "torque"], "N·m", 1.0, |r| r.torque_nm),
    (["torque", "rate"], "N·m/s", 1.0, |r| {
        r.torque_rate_nm_per_s
    }),
    (["motor", "speed"], "rpm", 1.0, |r| r.motor_speed_rpm),
];

/// The columns in which any row has a value; the limit row, if there is one, comes last.
pub(super) fn columns(rows: &[SummaryRow], limit: Option<&SummaryRow>) -> Vec<Column> {
    let mut columns = Vec::new();
    for (heading, unit, factor, get) in COLUMNS {
        // Durations are told apart by hundredths of a millisecond.
        let decimals = if unit == "ms" { 2 } else { 0 };
        let shown = |row| get(row).map(|x| x * factor).filter(|x| x.is_finite());
        let bound = limit.and_then(shown);
        let values: Vec<Option<f64>> = rows.iter().chain(limit).map(shown).collect();
        if rows.iter().all(|row| shown(row).is_none()) {
            continue;
        }
        let largest = values.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        // The largest displacement may be inside its limit while a smaller one is beyond its own.
        let displacement = heading[0] == "elastic";
        let cells = rows
            .iter()
            .chain(limit)
            .zip(values)
            .map(|(row, value)| Cell {
                text: value.map_or("–".into(), |x| digits(x, largest, decimals)),
                beyond: (displacement && row.elastic_displacement_beyond)
                    || matches!((value, bound), (Some(x), Some(b)) if x.abs() > b * (1.0 + MARKED_BEYOND)),
            })
            .collect();
        columns.push(Column {
            heading,
            unit,
            cells,
        });
    }
    columns
}

/// Four digits of the column's largest value, and the same decimals for all others.
fn digits(value: f64, largest: f64, least_decimals: usize) -> String {
    if largest >= 1e8 {
        return format!("{value:.3e}");
    }
    let before = if largest >= 1.0 {
        largest.log10().floor() as usize + 1
    } else {
        1
    };
    let decimals = 4_usize.saturating_sub(before).max(least_decimals);
    super::ticks::minus(&format!("{value:.decimals$}"))
}
