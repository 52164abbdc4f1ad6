//! A certificate as people read it.

use super::certificate::{Certificate, Proof};
use super::plants::{PlantProofs, Simulated};
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

/// The value and its limit.
impl fmt::Display for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.what();
        // Strains have no unit.
        let unit = format!(" {}", self.unit);
        let unit = unit.trim_end();
        let (value, limit) = (digits(self.value), digits(self.limit));
        write!(f, "{name} is {value}{unit} of {limit}{unit}")
    }
}

impl Simulated {
    fn what(&self) -> String {
        let left = if self.after {
            " left after the move"
        } else {
            ""
        };
        format!("{}{left}", self.name)
    }
}

/// Headings of [`PlantProofs::cells`].
pub const PLANT_HEADINGS: [&str; 5] = ["limit of", "unit", "value", "limit", "by"];

impl PlantProofs {
    /// The table of a plant, in the order of [`PLANT_HEADINGS`], each row with whether its limit holds.
    #[must_use]
    pub fn cells(&self) -> Vec<([String; 5], bool)> {
        let row = |what: &str, unit: &str, values: [f64; 2], by: &str| {
            let [value, limit] = values.map(digits);
            let name = format!("{what} with {}", self.name);
            [name, unit.to_owned(), value, limit, by.to_owned()]
        };
        let simulated = self.simulated.iter().map(|simulated| {
            let values = [simulated.value, simulated.limit];
            let cells = row(&simulated.what(), &simulated.unit, values, "simulation");
            (cells, simulated.holds())
        });
        let proved = self.proofs.iter().map(|proof| {
            let values = [proof.bound, proof.limit];
            (
                row(&proof.name, &proof.unit, values, "proof"),
                proof.holds(),
            )
        });
        simulated.chain(proved).collect()
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
        let mut text = aligned(&rows);
        if !self.plants.is_empty() {
            let mut rows = vec![PLANT_HEADINGS.map(str::to_owned)];
            let plants = self.plants.iter().flat_map(PlantProofs::cells);
            rows.extend(plants.map(|(cells, _)| cells));
            text.push('\n');
            text += &aligned(&rows);
        }
        text
    }

    /// What is said of the other plants of a robust move, in a few sentences; nothing if there are none.
    #[must_use]
    pub fn plants_in_words(&self) -> Option<String> {
        let names: Vec<&str> = self.plants.iter().map(|p| p.name.as_str()).collect();
        if names.is_empty() {
            return None;
        }
        let mut text = format!(
            "With motors that follow the same joint motion, {}: ",
            names.join(", ")
        );
        let left = self.plants.iter().flat_map(|plant| {
            let rows = plant.simulated.iter().filter(|row| row.after);
            rows.map(|row| (&plant.name, row))
        });
        let share = |row: &Simulated| row.value / row.limit;
        let most = left.max_by(|a, b| share(a.1).total_cmp(&share(b.1)));
        match (self.plants.iter().find_map(PlantProofs::broken), most) {
            (Some(broken), _) => text += &format!("{broken}."),
            (None, Some((plant, row))) => {
                text += &format!("every bound holds. The most, by simulation: {row} with {plant}.");
            }
            (None, None) => text += "every bound holds.",
        }
        let departures = self.plants.iter().filter_map(|plant| plant.departure);
        if let Some(share) = departures.reduce(f64::max) {
            text += &format!(
                " Simulated, they depart from the polynomials that limits are proved for by {share:.0e} of a typical magnitude at most."
            );
        }
        Some(text)
    }
}

/// Rows with their columns under each other: words stand left, numbers right.
fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
    let width = |cell: &String| cell.chars().count();
    let widths: [usize; N] =
        std::array::from_fn(|k| rows.iter().map(|row| width(&row[k])).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (k, (cell, wide)) in row.iter().zip(widths).enumerate() {
            let gap = " ".repeat(wide - width(cell));
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
