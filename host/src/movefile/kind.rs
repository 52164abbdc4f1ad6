//! The machines that a move file can name.

use super::error::{Fault, Problem};
use super::nearest::nearest;
use super::section::Section;
use crate::machine::{
    Assumption, Change, Machine, MachineError, Output, OutputKind, Plant, ThreeRrr, TwoMassAxis,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// A machine of any kind.
///
/// Whatever needs the machine's own type (the planner's derivatives) matches on it; everything else asks
/// [`MachineKind::plant`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MachineKind {
    /// `kind = "3rrr-flexible"`.
    ThreeRrr(ThreeRrr),
    /// `kind = "two-mass-axis"`.
    TwoMassAxis(TwoMassAxis),
}

/// A new machine: its variant above, a name here, an arm in each `match` below, its [`FromFile`].
const KINDS: [&str; 2] = ["3rrr-flexible", "two-mass-axis"];

/// The variant's machine, whatever its type.
macro_rules! any {
    ($kind:expr, $machine:ident => $body:expr) => {
        match $kind {
            MachineKind::ThreeRrr($machine) => $body,
            MachineKind::TwoMassAxis($machine) => $body,
        }
    };
}

/// The same, wrapped again.
macro_rules! map {
    ($kind:expr, $machine:ident => $body:expr) => {
        match $kind {
            MachineKind::ThreeRrr($machine) => MachineKind::ThreeRrr($body),
            MachineKind::TwoMassAxis($machine) => MachineKind::TwoMassAxis($body),
        }
    };
}

fn names_and_values<M: Machine>(machine: &M, pose: &[f64]) -> Vec<(&'static str, f64)> {
    let mut values = vec![0.0; M::REGULARITIES.len()];
    machine.regularities(&machine.rest(pose), &mut values);
    M::REGULARITIES.iter().copied().zip(values).collect()
}

impl MachineKind {
    /// The machine in plain numbers.
    #[must_use]
    pub fn plant(&self) -> &dyn Plant {
        any!(self, machine => machine)
    }

    /// Its kind, as in the move file.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::ThreeRrr(_) => KINDS[0],
            Self::TwoMassAxis(_) => KINDS[1],
        }
    }

    /// See [`Machine::check_pose`].
    ///
    /// # Errors
    /// [`MachineError::Unreachable`].
    pub fn check_pose(&self, pose: &[f64]) -> Result<(), MachineError> {
        any!(self, machine => machine.check_pose(pose))
    }

    /// Names and values of [`Machine::regularities`] of the undeformed machine at a pose.
    #[must_use]
    pub fn regularities(&self, pose: &[f64]) -> Vec<(&'static str, f64)> {
        any!(self, machine => names_and_values(machine, pose))
    }

    /// See [`Machine::assumptions`].
    #[must_use]
    pub fn assumptions(&self) -> Vec<Assumption> {
        any!(self, machine => machine.assumptions())
    }

    /// Keys of the parameters that [`MachineKind::changed`] can change.
    #[must_use]
    pub fn parameter_keys(&self) -> Vec<&'static str> {
        any!(self, machine => machine.clone().parameters().iter().map(|p| p.key).collect())
    }

    /// Value of a parameter, in the unit of its key.
    #[must_use]
    pub fn parameter(&self, key: &str) -> Option<f64> {
        any!(self, machine => {
            let mut copy = machine.clone();
            let found = copy.parameters().into_iter().find(|p| p.key == key);
            found.map(|p| *p.value)
        })
    }

    /// Key of the payload, see [`Machine::PAYLOAD`].
    #[must_use]
    pub fn payload(&self) -> &'static str {
        fn key<M: Machine>(_: &M) -> &'static str {
            M::PAYLOAD
        }
        any!(self, machine => key(machine))
    }

    /// Key of the stiffness, see [`Machine::STIFFNESS`].
    #[must_use]
    pub fn stiffness(&self) -> &'static str {
        fn key<M: Machine>(_: &M) -> &'static str {
            M::STIFFNESS
        }
        any!(self, machine => key(machine))
    }

    /// See [`Machine::changed`].
    ///
    /// # Errors
    /// [`MachineError::UnknownParameter`]; [`MachineError::Parameter`] where no machine has the new value.
    pub fn changed(&self, key: &str, change: Change) -> Result<Self, MachineError> {
        Ok(map!(self, machine => machine.changed(key, change)?))
    }

    /// See [`Machine::with_payload_factor`].
    #[must_use]
    pub fn with_payload_factor(&self, factor: f64) -> Self {
        map!(self, machine => machine.with_payload_factor(factor))
    }

    /// See [`Machine::with_elastic_damping`].
    #[must_use]
    pub fn with_elastic_damping(&self, ratio: f64) -> Self {
        map!(self, machine => machine.with_elastic_damping(ratio))
    }

    /// Reads the `[machine]` table.
    pub(super) fn read(mut section: Section<'_>) -> Result<Self, Box<Fault>> {
        let kind: String = section.value("kind")?;
        let bytes = section.bytes("kind");
        section.split_off(|key| key == "kind");
        match KINDS.iter().position(|k| *k == kind) {
            Some(0) => read(&section, ThreeRrr::validate).map(Self::ThreeRrr),
            Some(1) => read(&section, TwoMassAxis::validate).map(Self::TwoMassAxis),
            _ => Err(Fault::new(
                bytes,
                Problem::UnknownKind {
                    nearest: nearest(&kind, &KINDS),
                    known: KINDS.to_vec(),
                    kind,
                },
            )),
        }
    }

    /// Names of its own keys in `[limits]`.
    pub(super) fn limit_keys(&self) -> &'static [&'static str] {
        match self {
            Self::ThreeRrr(_) => ThreeRrr::limit_keys(),
            Self::TwoMassAxis(_) => TwoMassAxis::limit_keys(),
        }
    }

    /// Reads its own keys of `[limits]`: a limit for each output.
    pub(super) fn read_limits(
        &self,
        section: &Section<'_>,
    ) -> Result<Vec<Option<f64>>, Box<Fault>> {
        match self {
            Self::ThreeRrr(_) => section.read().map(|l| self.spread::<ThreeRrr>(&l)),
            Self::TwoMassAxis(_) => section.read().map(|l| self.spread::<TwoMassAxis>(&l)),
        }
    }

    fn spread<M: FromFile>(&self, limits: &M::Limits) -> Vec<Option<f64>> {
        let outputs = self.plant().outputs();
        outputs.iter().map(|o| M::limit(limits, o)).collect()
    }
}

fn read<M: DeserializeOwned>(
    section: &Section<'_>,
    validate: fn(&M) -> Result<(), MachineError>,
) -> Result<M, Box<Fault>> {
    let machine: M = section.read()?;
    validate(&machine).map_err(|error| match error {
        MachineError::Parameter { key, value, rule } => Fault::new(
            section.bytes(key),
            Problem::Value {
                key: key.into(),
                value,
                rule: rule.into(),
            },
        ),
        other => Fault::new(
            section.bytes("kind"),
            Problem::Type {
                key: "kind".into(),
                message: other.to_string(),
            },
        ),
    })?;
    Ok(machine)
}

/// How a machine's own limits are written.
trait FromFile {
    /// Its own keys of the `[limits]` table, all optional.
    type Limits: DeserializeOwned;

    /// The limit on an output.
    fn limit(limits: &Self::Limits, output: &Output) -> Option<f64>;

    fn limit_keys() -> &'static [&'static str] {
        super::fields::fields_of::<Self::Limits>().unwrap_or_default()
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ThreeRrrLimits {
    stress_pa: Option<f64>,
    elastic_displacement_m: Option<Displacement>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Displacement {
    x: Option<f64>,
    y: Option<f64>,
}

impl FromFile for ThreeRrr {
    type Limits = ThreeRrrLimits;

    fn limit(limits: &ThreeRrrLimits, output: &Output) -> Option<f64> {
        let displacement = limits.elastic_displacement_m.as_ref();
        match (output.kind, output.key) {
            (OutputKind::Stress, _) => limits.stress_pa,
            (_, "elastic_displacement_x_m") => displacement.and_then(|d| d.x),
            (_, "elastic_displacement_y_m") => displacement.and_then(|d| d.y),
            _ => None,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwoMassAxisLimits {
    twist_rad: Option<f64>,
}

impl FromFile for TwoMassAxis {
    type Limits = TwoMassAxisLimits;

    fn limit(limits: &TwoMassAxisLimits, output: &Output) -> Option<f64> {
        (output.key == "twist_rad").then_some(limits.twist_rad)?
    }
}
