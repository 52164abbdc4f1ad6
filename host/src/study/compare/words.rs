//! A comparison as table and as JSON.

use super::{Comparison, PAYLOAD_SPREAD, Planner, Rated, Residuals, SPREAD};
use serde_json::{Value, json};

/// Headings of the columns behind the name, a line each, and how many of them belong to a kind of drives.
const COLUMNS: [[&str; 2]; 9] = [
    ["", "duration, ms"],
    ["as", "planned"],
    ["payload", "±20 %"],
    ["payload", "±30 %"],
    ["stiffness", "±20 %"],
    ["as", "planned"],
    ["payload", "±20 %"],
    ["payload", "±30 %"],
    ["stiffness", "±20 %"],
];
/// Columns of the executor and the simulated drives begin here, those of drives that follow exactly there.
const GROUPS: [(usize, &str); 2] = [
    (1, "executor and simulated drives"),
    (5, "drives that follow exactly"),
];

impl Comparison {
    /// Headings of [`Comparison::cells`].
    #[must_use]
    pub fn headings(&self) -> Vec<String> {
        let of = |column: usize| {
            let group = GROUPS.iter().rev().find(|(first, _)| *first <= column);
            let [above, below] = COLUMNS[column];
            let name = format!("{above} {below}");
            group.map_or_else(
                || name.trim().to_owned(),
                |(_, group)| format!("{}, {group}", name.trim()),
            )
        };
        (0..COLUMNS.len()).map(of).collect()
    }

    /// Duration and residuals of a planner as people read them, or why it has none.
    pub fn cells(&self, planner: &Planner) -> Result<Vec<String>, String> {
        let rated = planner.result.as_ref().map_err(Clone::clone)?;
        let mut cells = vec![format!("{:.2}", rated.duration_s * 1e3)];
        for residuals in [&rated.simulated, &rated.exact] {
            cells.extend(figures(residuals).map(|residual| {
                let shown = residual * self.residual.factor;
                match shown.is_finite() {
                    true => format!("{shown:.*}", if shown < 99.95 { 1 } else { 0 }),
                    false => "stops".to_owned(),
                }
            }));
        }
        Ok(cells)
    }

    /// The table for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        const WIDTH: usize = 10;
        let names = self.planners.iter().map(|p| p.name.chars().count());
        let name_width = names.max().unwrap_or(0);
        let pad = |text: &str, width: usize| {
            format!(
                "{}{text}",
                " ".repeat(width.saturating_sub(text.chars().count()))
            )
        };
        let widths = COLUMNS.map(|[above, below]| above.len().max(below.len()).max(WIDTH));
        let mut lines = vec![String::new(); 3];
        lines[0] = " ".repeat(name_width + widths[0]);
        for (first, group) in GROUPS {
            let width: usize = widths[first..first + 4].iter().sum();
            let text = format!(
                "{} left, {}: {group}",
                self.residual.name, self.residual.unit
            );
            let text = if text.chars().count() > width {
                group.to_owned()
            } else {
                text
            };
            lines[0] += &pad(&text, width);
        }
        for (line, part) in [(1, 0), (2, 1)] {
            lines[line] = " ".repeat(name_width);
            for (heading, width) in COLUMNS.iter().zip(widths) {
                lines[line] += &pad(heading[part], width);
            }
        }
        lines.push("─".repeat(name_width + widths.iter().sum::<usize>()));
        for planner in &self.planners {
            let mut line = format!(
                "{}{}",
                planner.name,
                " ".repeat(name_width - planner.name.chars().count())
            );
            match self.cells(planner) {
                Ok(cells) => {
                    for (cell, width) in cells.iter().zip(widths) {
                        line += &pad(cell, width);
                    }
                }
                Err(why) => line += &format!("  no move: {why}"),
            }
            lines.push(line);
        }
        lines.extend(self.remarks());
        let whole = lines.iter().map(|line| format!("{}\n", line.trim_end()));
        whole.collect()
    }

    /// Why moves stop: a sentence for each planner, about the first of its machines.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let first = |planner: &Planner| {
            let rated = planner.result.as_ref().ok()?;
            let stopped = rated.stopped.first()?;
            Some(format!("{} stops with {stopped}", planner.name))
        };
        self.planners.iter().filter_map(first).collect()
    }

    /// Everything, in SI units.
    #[must_use]
    pub fn json(&self) -> Value {
        let planners = self.planners.iter().map(|planner| match &planner.result {
            Ok(Rated {
                duration_s,
                simulated,
                exact,
                stopped,
            }) => json!({
                "name": planner.name,
                "status": "planned",
                "duration_s": duration_s,
                "simulated_drives": residuals(simulated),
                "exact_drives": residuals(exact),
                "stopped": stopped.iter().map(ToString::to_string).collect::<Vec<String>>(),
            }),
            Err(why) => json!({"name": planner.name, "status": "failed", "message": why}),
        });
        json!({
            "move": self.name,
            "residual": self.residual.name,
            "planners": planners.collect::<Vec<Value>>(),
        })
    }
}

/// As planned, payload ±20 and ±30 %, stiffness ±20 %.
fn figures(residuals: &Residuals) -> [f64; 4] {
    [
        residuals.nominal(),
        residuals.worst_by_payload(SPREAD),
        residuals.worst_by_payload(PAYLOAD_SPREAD),
        residuals.worst_by_stiffness(),
    ]
}

fn residuals(residuals: &Residuals) -> Value {
    let [nominal, payload_20, payload_30, stiffness_20] = figures(residuals);
    json!({
        "as_planned": nominal,
        "worst_payload_20_percent": payload_20,
        "worst_payload_30_percent": payload_30,
        "worst_stiffness_20_percent": stiffness_20,
        "by_payload_factor": residuals.payload,
        "by_stiffness_factor": residuals.stiffness,
    })
}
