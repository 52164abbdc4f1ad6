//! What a report is made of: plain data, whoever computed it.

use super::SummaryRow;

/// Everything that a report shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Title, such as the move's name.
    pub title: String,
    /// A sentence or two below it.
    pub subtitle: String,
    /// Kind of machine.
    pub machine: String,
    /// The comparison. The first row is the one that the report is about.
    pub rows: Vec<SummaryRow>,
    /// What the machine allows, shown below the comparison; values beyond it are marked.
    pub limit_row: Option<SummaryRow>,
    /// What was proved of the trajectory, if anything was.
    pub proofs: Option<Proofs>,
    /// What holds for other plants that the same motion has to suit.
    pub plants: Option<Proofs>,
    /// A comparison of planners, if one was made.
    pub tradeoff: Option<super::Tradeoff>,
    /// More tables, in order.
    pub tables: Vec<Table>,
    /// Figures, in order.
    pub figures: Vec<Figure>,
    /// How the plan came about and what to know about it.
    pub notes: Vec<Note>,
    /// What was planned with.
    pub parameters: Vec<Parameter>,
}

/// A certificate as a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Proofs {
    /// What it comes to.
    pub verdict: String,
    /// Whether every limit is proved.
    pub certified: bool,
    /// Headings of the columns; the first two are of words, the others of numbers.
    pub headings: Vec<String>,
    /// A row of cells for each limit, and whether it holds.
    pub rows: Vec<(Vec<String>, bool)>,
}

/// A table of words and numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Short name, for links: letters, digits, `-`.
    pub id: String,
    /// Title.
    pub title: String,
    /// What to know about it.
    pub text: String,
    /// Headings of the columns; the first is of words, the others of numbers.
    pub headings: Vec<String>,
    /// Cells; a row of fewer cells than headings ends with one of words that fills it.
    pub rows: Vec<Vec<String>>,
}

/// A remark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What it is about.
    pub topic: String,
    /// What there is to say.
    pub text: String,
    /// Whether the reader should worry.
    pub warning: bool,
}

/// A quantity that was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Table in the move file.
    pub group: String,
    /// Key in the move file.
    pub key: String,
    /// Value as written.
    pub value: String,
    /// Its unit.
    pub unit: String,
    /// How well it is known.
    pub origin: Origin,
    /// Where it comes from, in words; may be empty.
    pub source: String,
}

/// How well a parameter is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// Given by whoever describes the machine or the move.
    Stated,
    /// Follows from stated values.
    Derived,
    /// Nobody measured it: chosen or fitted. Results depend on it.
    Assumed,
}

/// Curves over time, with limits.
///
/// Series with the same [`Series::run`] belong together. Runs of one curve each share a plot; otherwise each run has a
/// plot of its own, side by side on the same scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Short name, for files and links: letters, digits, `-`.
    pub id: String,
    /// Title.
    pub title: String,
    /// What is on the horizontal axis, with its unit.
    pub x_label: String,
    /// What is on the vertical axis, without unit.
    pub y_label: String,
    /// Unit in which values are shown.
    pub y_unit: String,
    /// Shown value per SI value.
    pub y_factor: f64,
    /// Part of the time that is shown; all of it if `None`.
    pub window_s: Option<(f64, f64)>,
    /// Curves, values in SI.
    pub series: Vec<Series>,
    /// Limits, values in SI.
    pub limits: Vec<LimitLine>,
    /// Moments worth a line.
    pub moments: Vec<Moment>,
    /// What to see.
    pub caption: String,
}

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What was run: a plan, a competitor.
    pub run: String,
    /// Which of its curves.
    pub label: String,
    /// Times.
    pub time_s: Vec<f64>,
    /// Values in SI; missing ones are NaN.
    pub values: Vec<f64>,
}

/// A limit that holds in both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitLine {
    /// What is limited; shown with the value.
    pub label: String,
    /// Largest magnitude, SI.
    pub value: f64,
}

/// A moment marked in a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// What happens.
    pub label: String,
    /// When.
    pub time_s: f64,
}
