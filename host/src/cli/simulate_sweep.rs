//! `stillpoint simulate F.spt --move MOVE.toml --sweep PARAMETER=FROM..TO:COUNT`

use super::{Failure, output};
use crate::movefile::MoveFile;
use crate::report::plain_table;
use crate::study::sensitivity::{Sensitivity, sensitivities};
use crate::study::sweep::{Outcome, Point, SweepRange, sweep};
use serde_json::{Map, Value, json};
use stillpoint_shared::Trajectory;

pub(super) fn run(
    file: &MoveFile,
    trajectory: &Trajectory,
    range: &SweepRange,
    json: bool,
) -> Result<(), Failure> {
    let points = sweep(file, trajectory, range)?;
    let sensitivities = sensitivities(file, trajectory);
    if json {
        return output::object(&json!({
            "parameter": range.parameter,
            "machines": points.iter().map(point).collect::<Vec<Value>>(),
            "sensitivities": match &sensitivities {
                Ok(all) => all.iter().map(sensitivity).collect(),
                Err(error) => json!({"error": error.to_string()}),
            },
        }));
    }
    let mut text = table(range, &points);
    match sensitivities {
        Ok(all) => {
            let (headings, rows) = Sensitivity::table(file, &all);
            text += &format!("\nWhat small changes do\n{}", plain_table(&headings, &rows));
        }
        Err(error) => text += &format!("\nWhat small changes do is not known: {error}\n"),
    }
    output::text(&text)
}

fn table(range: &SweepRange, points: &[Point]) -> String {
    let outcomes = || {
        points
            .iter()
            .filter_map(|point| point.outcome.as_ref().ok())
    };
    let groups: Vec<&str> = outcomes().next().map_or_else(Vec::new, |first| {
        first.usages.iter().map(|usage| usage.group).collect()
    });
    let mut headings = vec![
        "factor".to_owned(),
        range.parameter.clone(),
        "left".to_owned(),
    ];
    headings.extend(groups.iter().map(|group| format!("{group}, %")));
    headings.push("ticks limited".to_owned());
    let row = |point: &Point| {
        let mut cells = vec![
            format!("{:.4}", point.factor),
            format!("{:.5e}", point.value),
        ];
        match &point.outcome {
            Ok(outcome) => {
                cells.push(outcome.metrics.residual_in_words());
                let usages = outcome.usages.iter();
                cells.extend(usages.map(|usage| format!("{:.1}", usage.ratio * 100.0)));
                cells.push(outcome.limited_ticks.to_string());
            }
            Err(why) => cells.push(why.to_string()),
        }
        cells
    };
    let rows: Vec<Vec<String>> = points.iter().map(row).collect();
    format!(
        "What is left after the move, and the most that is used of each limit\n{}",
        plain_table(&headings, &rows)
    )
}

fn usages(outcome: &Outcome) -> Value {
    let usages = outcome.usages.iter();
    let entry = |usage: &crate::simulate::usage::Usage| {
        let place = json!({"used": usage.ratio, "limit": usage.limit, "time_s": usage.time_s});
        (usage.group.to_owned(), place)
    };
    Value::Object(usages.map(entry).collect())
}

fn point(point: &Point) -> Value {
    match &point.outcome {
        Ok(outcome) => json!({
            "factor": point.factor,
            "value": point.value,
            "residual": outcome.metrics.residual(),
            "metrics": outcome.metrics,
            "limits": usages(outcome),
            "limited_ticks": outcome.limited_ticks,
        }),
        Err(error) => {
            json!({"factor": point.factor, "value": point.value, "error": error.to_string()})
        }
    }
}

fn sensitivity(sensitivity: &Sensitivity) -> Value {
    let limits: Map<String, Value> = (sensitivity.usages.iter())
        .map(|(group, change)| ((*group).to_owned(), json!(change)))
        .collect();
    json!({
        "parameter": sensitivity.parameter,
        "step": sensitivity.step_size,
        "residual_change": sensitivity.residual,
        "limit_use_changes": limits,
    })
}
