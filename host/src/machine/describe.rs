//! What a machine tells about itself: names, units, meaning.

/// One generalised coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinate {
    /// Name with unit, as in the move file.
    pub name: &'static str,
    /// Unit of the coordinate (its rate is per second).
    pub unit: &'static str,
    /// Magnitude that a typical move gives it: the planner's scale.
    pub magnitude: f64,
    /// Magnitude of its rate.
    pub rate_magnitude: f64,
    /// Zero at rest and free to vibrate.
    pub elastic: bool,
}

/// What an output measures; decides in which figure and which column it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OutputKind {
    /// Strain at a gauge, dimensionless.
    Strain,
    /// Deviation of the tool from the undeformed machine.
    ElasticDisplacement,
    /// Largest stress in a member, Pa.
    Stress,
}

/// How an output depends on the coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OutputForm {
    /// `gain` times one coordinate: a limit on it is a bound on that coordinate.
    Proportional {
        /// Index of the coordinate.
        coordinate: usize,
        /// Output per unit of the coordinate.
        gain: f64,
    },
    /// Any other function of the coordinates: a limit on it is a path constraint.
    General,
}

/// One watched quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Key with unit, for files.
    pub key: &'static str,
    /// Short label for people.
    pub label: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Meaning.
    pub kind: OutputKind,
    /// Dependence on the coordinates.
    pub form: OutputForm,
}

/// A parameter that nobody measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Assumption {
    /// Key in the move file.
    pub key: &'static str,
    /// Value and unit.
    pub value: String,
    /// Where it comes from.
    pub origin: &'static str,
}

/// Why a machine cannot be, or cannot be where it is asked to be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// A parameter has a value that no machine has.
    #[error("{key} = {value}: {rule}")]
    Parameter {
        /// Key in the move file's `[machine]` table.
        key: &'static str,
        /// The value found.
        value: f64,
        /// What it must satisfy.
        rule: &'static str,
    },
    /// A parameter that the machine does not have.
    #[error("the machine has no parameter `{key}`; it has {}", known.join(", "))]
    UnknownParameter {
        /// The key asked for.
        key: String,
        /// All keys.
        known: Vec<&'static str>,
    },
    /// The pose is out of reach.
    #[error(
        "chain {chain} cannot reach the pose: its base and platform joints are {distance_m:.6} m apart, \
         {missing_m:.6} m {direction} than its links allow ({nearest_m:.6} m)"
    )]
    Unreachable {
        /// Number of the chain, from 1.
        chain: usize,
        /// Distance between the chain's base joint and platform joint.
        distance_m: f64,
        /// The nearest distance that the links allow.
        nearest_m: f64,
        /// How much is missing.
        missing_m: f64,
        /// `"more"` or `"less"`.
        direction: &'static str,
    },
}

/// Checks that a parameter is finite and positive.
pub(super) fn positive(key: &'static str, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(MachineError::Parameter {
            key,
            value,
            rule: "must be a positive number",
        })
    }
}

/// Checks that a parameter is finite and not negative.
pub(super) fn not_negative(key: &'static str, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(MachineError::Parameter {
            key,
            value,
            rule: "must be zero or a positive number",
        })
    }
}
