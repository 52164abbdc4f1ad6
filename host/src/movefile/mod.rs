//! The move file: a machine, its limits, where it goes, and how to plan that, in TOML.
//!
//! | table | keys |
//! |---|---|
//! | `[machine]` | `kind` and the machine's parameters |
//! | `[machine.uncertainty]` | shares by which parameters may be off, and `residual_…`, what may be left after the move then; may be left out |
//! | `[limits]` | torque, torque rate and speed of every axis; the machine's own limits, which may be left out |
//! | `[move]` | `from` and `to`: poses, with the machine's names |
//! | `[mesh]` | `intervals`, `points`; `refine` (true or false) and its `tolerance` may be left out |
//! | `[solver]` | `limits` (`"everywhere"` or `"nodes"`), `tolerance`, `max_iterations`; may be left out |
//! | `[robust]` | other plants that the same motion has to suit; may be left out (docs/robust.md) |
//! | `[drive]` | the simulated drives; may be left out |
//!
//! SI units, in the names of the keys. A [`MoveFile`] that exists is valid: every number is possible, the machine can
//! stand at both ends. What is wrong with a text is said with file, line, column and the line itself.

mod ends;
mod error;
mod fields;
mod kind;
mod limits;
mod nearest;
mod place;
mod robust;
mod section;
mod settings;
mod uncertainty;

pub use error::{MoveFileError, Problem};
pub use kind::MachineKind;
pub use limits::Limits;
pub use place::Place;
pub use robust::{Residual, Robust, Scenario};
pub use settings::{LimitsAt, Mesh, Solver};
pub use uncertainty::Uncertainty;

use crate::simulate::DriveSettings;
use error::Fault;
use section::Section;
use std::io::Read;
use std::path::Path;

/// Files larger than this are not move files.
const LARGEST_BYTES: u64 = 1 << 20;
/// The paper's move, which comes with the program.
pub const PAPER_MOVE: &str = include_str!("../../moves/paper.toml");

const TABLES: [&str; 7] = [
    "machine", "limits", "move", "mesh", "solver", "robust", "drive",
];

/// A move, ready to be planned.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveFile {
    /// Name of the move: the file's without its ending.
    pub name: String,
    /// The machine.
    pub machine: MachineKind,
    /// How well it is known.
    pub uncertainty: Option<Uncertainty>,
    /// What it must not exceed.
    pub limits: Limits,
    /// Pose at the start, in the order of the machine's pose names.
    pub from: Vec<f64>,
    /// Pose at the end.
    pub to: Vec<f64>,
    /// Mesh to start with.
    pub mesh: Mesh,
    /// Solver settings.
    pub solver: Solver,
    /// Other plants that the same motion has to suit.
    pub robust: Option<Robust>,
    /// Simulated drives.
    pub drive: DriveSettings,
    /// What the file says, as written, for whoever shows it.
    pub entries: Vec<Entry>,
}

/// One key of a move file as written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The table it stands in.
    pub table: &'static str,
    /// The key, with its unit; dotted where it stands in a table of that table.
    pub key: String,
    /// The value.
    pub value: String,
}

impl MoveFile {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`MoveFileError`] says what is wrong, and where.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MoveFileError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let unreadable = |reason: String| MoveFileError::Unreadable {
            file: place::printable(&file),
            reason,
        };
        let mut bytes = Vec::new();
        std::fs::File::open(path)
            .and_then(|f| f.take(LARGEST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(|e| unreadable(format!("cannot read the move file: {e}")))?;
        if bytes.len() as u64 > LARGEST_BYTES {
            return Err(unreadable("larger than 1 MiB: not a move file".into()));
        }
        let text = String::from_utf8(bytes).map_err(|e| {
            let at = e.utf8_error().valid_up_to();
            unreadable(format!("not UTF-8 text (byte {at}): not a move file"))
        })?;
        Self::parse(&text, &file)
    }

    /// Checks a text; `file` is the name shown in errors.
    ///
    /// # Errors
    /// [`MoveFileError`] says what is wrong, and where.
    pub fn parse(text: &str, file: &str) -> Result<Self, MoveFileError> {
        let stem = Path::new(file).file_stem().unwrap_or_default();
        Self::from_text(text, stem.to_string_lossy().into_owned()).map_err(|fault| {
            MoveFileError::Invalid {
                place: Place::new(file, text, fault.bytes),
                problem: Box::new(fault.problem),
            }
        })
    }

    fn from_text(text: &str, name: String) -> Result<Self, Box<Fault>> {
        let root = Section::root(text)?;
        root.only(&TABLES)?;
        let table = |table: &'static str| {
            let end = text.len()..text.len();
            root.table(table)?
                .ok_or_else(|| Fault::new(end, Problem::MissingTable { table }))
        };
        let mut machine = table("machine")?;
        let uncertainty = machine.table("uncertainty")?;
        machine.split_off(|key| key == "uncertainty");
        let machine = MachineKind::read(machine)?;
        let uncertainty = uncertainty.map(|section| Uncertainty::read(&section, &machine));
        let uncertainty = uncertainty.transpose()?;
        let limits = read_limits(table("limits")?, &machine)?;
        let ends = table("move")?;
        let (from, to) = ends::read_ends(&ends, &machine)?;
        let both: [(&str, &[f64]); 2] = [("from", &from), ("to", &to)];
        ends::check_limits_at_ends(&ends, &machine, &limits, both)?;
        let robust = root.table("robust")?;
        let robust = robust.map(|section| Robust::read(&section, &machine, both));
        let robust = robust.transpose()?;
        Ok(Self {
            name,
            machine,
            uncertainty,
            limits,
            from,
            to,
            mesh: Mesh::read(&table("mesh")?)?,
            solver: optional(&root, "solver", Solver::read)?,
            robust,
            drive: optional(&root, "drive", settings::read_drive)?,
            entries: entries(&root, text)?,
        })
    }
}

/// The common limits and the machine's own share a table.
fn read_limits(mut section: Section<'_>, machine: &MachineKind) -> Result<Limits, Box<Fault>> {
    let common = fields::fields_of::<limits::AxisLimits>().unwrap_or_default();
    section.only(&[common, machine.limit_keys()].concat())?;
    limits::check_limits(&section)?;
    let own = section.split_off(|key| machine.limit_keys().contains(&key));
    let outputs = machine.read_limits(&own)?;
    let axis: limits::AxisLimits = section.read()?;
    Ok(axis.with_outputs(outputs))
}

fn optional<'t, T: Default>(
    root: &Section<'t>,
    table: &'static str,
    read: impl Fn(&Section<'t>) -> Result<T, Box<Fault>>,
) -> Result<T, Box<Fault>> {
    root.table(table)?
        .map_or_else(|| Ok(T::default()), |section| read(&section))
}

fn entries(root: &Section<'_>, text: &str) -> Result<Vec<Entry>, Box<Fault>> {
    let mut all = Vec::new();
    for table in TABLES {
        let Some(section) = root.table(table)? else {
            continue;
        };
        all.extend(section.entries(text).into_iter().map(|(key, value)| Entry {
            table,
            key,
            value,
        }));
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
