//! A study as people read it: table, figures and notes.

use super::run::{Run, limit_row};
use super::sensitivity::Sensitivity;
use crate::certify::{Certificate, HEADINGS, PLANT_HEADINGS, PlantProofs};
use crate::movefile::{MoveFile, PAPER_MOVE};
use crate::report::{
    Figure, Note, Proofs, Report, SummaryRow, Table, figures_of, number_like_the_paper,
    parameters_of, text_table,
};
use crate::sptfile::Remark;
use stillpoint_shared::{Trajectory, time};

/// What the paper reports of its optimal move: numbers read from its text and figures, "less than" taken as equal.
#[must_use]
pub fn paper_row() -> SummaryRow {
    SummaryRow {
        name: "paper".to_owned(),
        duration_s: Some(0.0508),
        peak_strain: Some(4e-4),
        residual_strain: Some(2e-5),
        elastic_displacement_m: Some(1.5e-3),
        ..SummaryRow::default()
    }
}

/// Everything a report shows.
#[derive(Debug)]
pub struct Document<'a> {
    /// The move.
    pub file: &'a MoveFile,
    /// What was played.
    pub trajectory: &'a Trajectory,
    /// What the planner remarked, as the file holds it.
    pub planned: &'a [Remark],
    /// What is proved of the trajectory, if anything.
    pub certificate: Option<&'a Certificate>,
    /// Runs that are drawn.
    pub drawn: &'a [Run],
    /// All rows of the table.
    pub rows: Vec<SummaryRow>,
    /// What small changes of the machine do, if it was found out.
    pub sensitivities: Vec<Sensitivity>,
    /// What a reader has to know besides.
    pub remarks: Vec<String>,
}

fn proofs(certificate: &Certificate) -> Proofs {
    let rows = certificate.cells().into_iter().zip(&certificate.proofs);
    Proofs {
        verdict: certificate.verdict(),
        certified: certificate.is_certified(),
        headings: HEADINGS.map(str::to_owned).to_vec(),
        rows: rows
            .map(|(cells, proof)| (cells.to_vec(), proof.holds()))
            .collect(),
    }
}

fn plants(certificate: &Certificate) -> Option<Proofs> {
    let rows = certificate.plants.iter().flat_map(PlantProofs::cells);
    Some(Proofs {
        verdict: certificate.plants_in_words()?,
        certified: certificate.plants.iter().all(|p| p.broken().is_none()),
        headings: PLANT_HEADINGS.map(str::to_owned).to_vec(),
        rows: rows.map(|(cells, holds)| (cells.to_vec(), holds)).collect(),
    })
}

impl Document<'_> {
    /// The table for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        text_table(&self.rows, Some(&limit_row(self.file)))
    }

    /// The figures.
    #[must_use]
    pub fn figures(&self) -> Vec<Figure> {
        let records: Vec<_> = self.drawn.iter().map(Run::record).collect();
        let ends = [self.file.from.as_slice(), self.file.to.as_slice()];
        let mut figures = figures_of(self.file.machine.plant(), &self.file.limits, ends, &records);
        if self.is_papers() {
            number_like_the_paper(&mut figures);
        }
        figures
    }

    /// Whether the move is the paper's: its figures get the paper's numbers.
    fn is_papers(&self) -> bool {
        let paper = MoveFile::parse(PAPER_MOVE, "paper.toml");
        let ends = |file: &MoveFile| (file.from.clone(), file.to.clone());
        paper.is_ok_and(|paper| {
            paper.machine == self.file.machine && ends(&paper) == ends(self.file)
        })
    }

    /// The HTML report.
    #[must_use]
    pub fn html(&self) -> String {
        let duration_ms = time::seconds(self.trajectory.duration_ticks()) * 1e3;
        Report {
            title: format!("Move {}", self.file.name),
            subtitle: format!("{duration_ms:.2} ms from rest to rest"),
            machine: self.file.machine.name().to_owned(),
            rows: self.rows.clone(),
            limit_row: Some(limit_row(self.file)),
            proofs: self.certificate.map(proofs),
            plants: self.certificate.and_then(plants),
            figures: self.figures(),
            notes: self.notes(),
            parameters: parameters_of(self.file),
            tables: self.sensitivity_table().into_iter().collect(),
            ..Report::default()
        }
        .html()
    }

    fn sensitivity_table(&self) -> Option<Table> {
        if self.sensitivities.is_empty() {
            return None;
        }
        let (headings, rows) = Sensitivity::table(self.file, &self.sensitivities);
        Some(Table {
            id: "sensitivity".to_owned(),
            title: "What small changes of the machine do".to_owned(),
            text: "Which parameter must be known how well: change of what is left after the move, and of the use of each limit in \
                   points of a per cent, when one parameter is changed and nothing is planned anew. Differences of simulations; of \
                   what is left the greater one of both ways, as it has a kink at zero."
                .to_owned(),
            headings,
            rows,
        })
    }

    fn notes(&self) -> Vec<Note> {
        let note = |topic: &str, text: String, warning| Note {
            topic: topic.to_owned(),
            text,
            warning,
        };
        let mut notes = Vec::new();
        notes.extend((self.planned.iter()).map(|r| note(&r.topic, r.text.clone(), r.doubtful)));
        notes.extend(
            self.remarks
                .iter()
                .map(|text| note("Remark", text.clone(), true)),
        );
        for run in self.drawn {
            let ticks = run.recording.limited_ticks();
            if ticks > 0 {
                notes.push(note(
                    "Limiter",
                    format!(
                        "The executor's limiter acted in {ticks} ticks of “{}”.",
                        run.name
                    ),
                    true,
                ));
            }
        }
        notes
    }
}
