//! Reports: what was planned and played, for people.
//!
//! [`Report`] is plain data and knows neither planner nor simulator. It becomes one HTML file ([`Report::html`]), its
//! comparison also a table for the terminal ([`text_table`]) and `summary.json` ([`summary_json`]), a single figure an
//! SVG file ([`Figure::svg`]). Values are SI throughout; only what is shown is scaled.
//!
//! What is plotted is decided by the data: [`figures_of`] asks the machine which coordinates and outputs it has.

mod data;
mod escape;
mod figures;
mod html;
mod layout;
mod parameters;
mod plot;
mod simplify;
mod summary;
mod svg;
mod text_table;
mod ticks;
mod tradeoff;

pub use data::{Figure, LimitLine, Moment, Note, Origin, Parameter, Proofs, Report, Series, Table};
pub use figures::{Record, figures_of, number_like_the_paper};
pub use parameters::parameters_of;
pub use summary::{MARKED_BEYOND, SummaryRow, summary_json};
pub use text_table::text_table;
pub use tradeoff::{Contender, Mark, Tradeoff};

#[cfg(test)]
mod tests;
