//! What can be wrong with a move file, in sentences.

use super::place::{Place, printable};
use crate::machine::MachineError;
use std::fmt;
use std::ops::Range;

/// Why a file does not describe a move.
#[derive(Debug)]
#[non_exhaustive]
pub enum MoveFileError {
    /// The file cannot be read at all.
    Unreadable {
        /// Name of the file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Something in it is wrong.
    Invalid {
        /// Where.
        place: Place,
        /// What.
        problem: Box<Problem>,
    },
}

/// What is wrong at a place of a move file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Not TOML.
    #[error("{0}")]
    Syntax(String),
    /// A key that nobody reads.
    #[error("unknown key `{key}` in {table}")]
    UnknownKey {
        /// The key.
        key: String,
        /// The table, as written in the file.
        table: String,
        /// The known key it resembles.
        nearest: Option<&'static str>,
        /// All known keys.
        known: Vec<&'static str>,
    },
    /// A key that must be there.
    #[error("{table} lacks the key `{key}`")]
    MissingKey {
        /// The key.
        key: String,
        /// The table, as written in the file.
        table: String,
    },
    /// A table that must be there.
    #[error("the table [{table}] is missing")]
    MissingTable {
        /// The table.
        table: &'static str,
    },
    /// A machine that nobody built.
    #[error("unknown machine kind {kind:?}")]
    UnknownKind {
        /// The kind asked for.
        kind: String,
        /// The kind it resembles.
        nearest: Option<&'static str>,
        /// All kinds.
        known: Vec<&'static str>,
    },
    /// A parameter that the machine does not have.
    #[error("the machine has no parameter {key:?}")]
    UnknownParameter {
        /// The parameter asked for.
        key: String,
        /// The one it resembles.
        nearest: Option<&'static str>,
        /// All of them.
        known: Vec<&'static str>,
    },
    /// A value of the wrong type.
    #[error("`{key}`: {message}")]
    Type {
        /// The key, or the table.
        key: String,
        /// What was found and what was expected.
        message: String,
    },
    /// An impossible number.
    #[error("{key} = {value}: {rule}")]
    Value {
        /// The key.
        key: String,
        /// The value found.
        value: f64,
        /// What it must satisfy.
        rule: String,
    },
    /// The machine cannot stand at an end.
    #[error("the machine cannot stand at `{end}`: {source}")]
    Pose {
        /// `"from"` or `"to"`.
        end: &'static str,
        /// The chain and the distance missing.
        source: MachineError,
    },
    /// The machine is singular at an end.
    #[error(
        "the machine is singular at `{end}`: its motors do not determine its motion there (pose or parameters \
         beyond what arithmetic can follow)"
    )]
    Singular {
        /// `"from"` or `"to"`.
        end: &'static str,
    },
    /// The ends are on different sides of the singular poses.
    #[error(
        "a singular pose lies between `from` and `to`, whichever way the machine moves: {what} is {before:.3} at `from` and {after:.3} at \
         `to`. Choose a target on the same side, or bring the machine to its side by other means"
    )]
    SingularBetween {
        /// What is zero at singular poses.
        what: &'static str,
        /// Its value at `from`.
        before: f64,
        /// Its value at `to`.
        after: f64,
    },
    /// The machine cannot be brought to rest at an end.
    #[error(
        "a move cannot end still at `{end}`: there the machine {}, and no motor acts on that. Choose another pose, or give it the \
         stiffness that holds it",
        if *frequency_hz > 0.0 { format!("can swing at {frequency_hz:.4} Hz") } else { "can drift".to_owned() }
    )]
    NeverStill {
        /// `"from"` or `"to"`.
        end: &'static str,
        /// Of the motion that nothing stops; 0 if it does not even swing.
        frequency_hz: f64,
    },
    /// Both ends are the same.
    #[error("`from` and `to` are the same pose: there is nothing to move")]
    NoMove,
    /// A limit that even standing at an end breaks.
    #[error(
        "at rest at `{end}`, {output} is already {value} {unit}, beyond its limit of {limit} {unit}"
    )]
    LimitAtEnd {
        /// `"from"` or `"to"`.
        end: &'static str,
        /// Key of the output.
        output: &'static str,
        /// Its value there.
        value: f64,
        /// Its limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
    },
}

impl Problem {
    /// A line that helps, below the place.
    fn help(&self) -> Option<String> {
        let (nearest, known, what) = match self {
            Self::UnknownKey { nearest, known, .. } => (nearest, known, "keys"),
            Self::UnknownKind { nearest, known, .. } => (nearest, known, "kinds"),
            Self::UnknownParameter { nearest, known, .. } => (nearest, known, "parameters"),
            _ => return None,
        };
        let meant = nearest.map_or(String::new(), |n| format!("did you mean `{n}`? "));
        let known = known.join(", ");
        Some(format!("{meant}Known {what}: {known}"))
    }
}

impl fmt::Display for MoveFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { file, reason } => write!(f, "{file}: {reason}"),
            Self::Invalid { place, problem } => {
                // Keys and kinds are quoted from the file.
                write!(f, "{place}: {}", printable(&problem.to_string()))?;
                write!(f, "\n{}", place.excerpt())?;
                problem
                    .help()
                    .map_or(Ok(()), |help| write!(f, "\n  = {help}"))
            }
        }
    }
}

impl std::error::Error for MoveFileError {}

/// A problem and the bytes of the text that it is about.
#[derive(Debug)]
pub(super) struct Fault {
    /// Where in the text.
    pub(super) bytes: Range<usize>,
    /// What.
    pub(super) problem: Problem,
}

impl Fault {
    pub(super) fn new(bytes: Range<usize>, problem: Problem) -> Box<Self> {
        Box::new(Self { bytes, problem })
    }
}
