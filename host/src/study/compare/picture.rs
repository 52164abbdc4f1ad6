//! A comparison as picture and page.

use super::{Comparison, Family, Planner, SPREAD};
use crate::movefile::MoveFile;
use crate::report::{Contender, Mark, Note, Report, Table, Tradeoff, parameters_of};

/// Baselines whose curves are drawn, besides the two of ours.
const NAMED: usize = 3;

impl Comparison {
    /// The picture: duration against the most that is left over the payload ±20 %, and what is left over the payload.
    #[must_use]
    pub fn picture(&self) -> Tradeoff {
        let front: Vec<&str> = self.front().iter().map(|p| p.name.as_str()).collect();
        let named = spread_out(&front, NAMED);
        let planners = self.planners.iter();
        Tradeoff {
            title: format!("Move {}", self.name),
            residual: format!("{} ({})", self.residual.name, self.residual.unit),
            worst: "Duration, and the most that is left with a payload ±20 %".to_owned(),
            sweep: "What is left, payload by payload".to_owned(),
            marks: [
                (Mark::Disc, "Stillpoint"),
                (Mark::Square, "quintic"),
                (Mark::Triangle, "S-curve"),
            ]
            .map(|(mark, name)| (mark, name.to_owned()))
            .to_vec(),
            parameter: "payload over the planned one".to_owned(),
            contenders: planners.filter_map(|p| self.contender(p, &named)).collect(),
        }
    }

    fn contender(&self, planner: &Planner, named: &[&str]) -> Option<Contender> {
        let rated = planner.result.as_ref().ok()?;
        let shown = |residual: f64| residual * self.residual.factor;
        let curve = rated.simulated.payload.iter();
        Some(Contender {
            name: planner.name.clone(),
            mark: match planner.family {
                Family::Nominal | Family::Robust => Mark::Disc,
                Family::Quintic => Mark::Square,
                Family::SCurve => Mark::Triangle,
            },
            named: !planner.family.is_shaped() || named.contains(&planner.name.as_str()),
            duration_ms: rated.duration_s * 1e3,
            worst: shown(rated.simulated.worst_by_payload(SPREAD)),
            curve: curve
                .map(|(factor, left)| (*factor, shown(*left)))
                .collect(),
        })
    }

    /// The page: picture and table.
    #[must_use]
    pub fn html(&self, file: &MoveFile) -> String {
        let rows = self.planners.iter().map(|planner| {
            let cells = self.cells(planner);
            let cells = cells.unwrap_or_else(|why| vec![format!("no move: {why}")]);
            [vec![planner.name.clone()], cells].concat()
        });
        let note = |text: String| Note {
            topic: "Stopped".to_owned(),
            text,
            warning: true,
        };
        Report {
            title: format!("Planners on move {}", self.name),
            subtitle: "How long each takes, and what is left when the machine is not the planned one".to_owned(),
            machine: file.machine.name().to_owned(),
            tradeoff: Some(self.picture()),
            tables: vec![Table {
                id: "residuals".to_owned(),
                title: "What is left".to_owned(),
                text: format!(
                    "{} in {}: the most over each range of payloads and stiffnesses, played by the board's executor on the \
                     simulated drives of the move file, and with drives that follow exactly.",
                    self.residual.name, self.residual.unit
                ),
                headings: [vec![String::new()], self.headings()].concat(),
                rows: rows.collect(),
            }],
            notes: self.remarks().into_iter().map(note).collect(),
            parameters: parameters_of(file),
            ..Report::default()
        }
        .html()
    }
}

/// At most `count` of a list, the first and the last among them.
fn spread_out<'n>(names: &[&'n str], count: usize) -> Vec<&'n str> {
    if names.len() <= count {
        return names.to_vec();
    }
    let last = names.len() - 1;
    (0..count).map(|k| names[k * last / (count - 1)]).collect()
}
