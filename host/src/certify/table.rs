//! A certificate as people read it.

use super::certificate::{Certificate, Proof};
use std::fmt;

/// What is exceeded, or how much is left: one sentence.
impl fmt::Display for Proof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name, unit, limit, ..
        } = self;
        let (bound, reached) = (digits(self.bound), digits(self.reached));
        let (interval, at_ms) = (self.interval + 1, self.time_s * 1e3);
        let place = format!("in interval {interval}, at {at_ms:.4} ms");
        if self.is_violated() {
            write!(
                f,
                "{name} reaches {reached} {unit} of {limit} {unit} {place}"
            )
        } else if self.holds() {
            let share = -self.relative() * 100.0;
            write!(
                f,
                "{name} is at most {bound} {unit} of {limit} {unit}, {share:.4} % inside, {place}"
            )
        } else {
            write!(
                f,
                "{name} cannot be shown to stay below {bound} {unit} of {limit} {unit} {place}"
            )
        }
    }
}

/// Headings of [`Certificate::cells`].
pub const HEADINGS: [&str; 7] = [
    "limit of", "unit", "proved", "limit", "margin %", "played", "at ms",
];

impl Certificate {
    /// The table, a row for each proof, in the order of [`HEADINGS`].
    #[must_use]
    pub fn cells(&self) -> Vec<[String; 7]> {
        let row = |proof: &Proof| {
            [
                proof.name.clone(),
                proof.unit.clone(),
                digits(proof.bound),
                digits(proof.limit),
                format!("{:.4}", -proof.relative() * 100.0),
                proof.played.map_or("–".to_owned(), digits),
                format!("{:.3}", proof.time_s * 1e3),
            ]
        };
        self.proofs.iter().map(row).collect()
    }

    /// What the table comes to, in a sentence or two.
    #[must_use]
    pub fn verdict(&self) -> String {
        let Some(tightest) = self.tightest() else {
            return "Certified: there are no limits.".to_owned();
        };
        let limiter = if self.limiter_never_acts() {
            "The executor's limiter provably never acts."
        } else {
            "That the executor's limiter never acts is not proved."
        };
        if self.is_certified() {
            format!("Certified: every limit holds everywhere; the tightest: {tightest}. {limiter}")
        } else {
            format!("Not certified: {tightest}.")
        }
    }

    /// The table for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let mut rows = vec![HEADINGS.map(str::to_owned)];
        rows.extend(self.cells());
        let width = |cell: &String| cell.chars().count();
        let widths: [usize; 7] =
            std::array::from_fn(|k| rows.iter().map(|row| width(&row[k])).max().unwrap_or(0));
        let mut text = String::new();
        for row in &rows {
            let mut line = String::new();
            for (k, (cell, wide)) in row.iter().zip(widths).enumerate() {
                let gap = " ".repeat(wide - width(cell));
                // Words stand left, numbers right.
                line += &if k < 2 {
                    format!("{cell}{gap}  ")
                } else {
                    format!("{gap}{cell}  ")
                };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

/// Six significant digits. The least numbers there are come from rounding zero up.
fn digits(value: f64) -> String {
    if value.abs() < f64::MIN_POSITIVE {
        return "0".to_owned();
    }
    let before = value.abs().log10().floor();
    if (-1.0..6.0).contains(&before) {
        format!("{value:.*}", (5.0 - before) as usize)
    } else {
        format!("{value:.5e}")
    }
}
