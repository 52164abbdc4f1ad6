//! The `[robust]` table: other plants that one commanded motion has to suit as well.

use super::error::{Fault, Problem};
use super::kind::MachineKind;
use super::nearest::nearest;
use super::section::Section;
use crate::machine::{Change, MachineError, OutputKind};
use serde::Deserialize;

/// Joint angles closer than this are the same.
const SAME_ANGLE_RAD: f64 = 1e-9;

/// Plants that follow the same commanded joint motion, and what each may ring with afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    /// The plants besides the nominal one.
    pub scenarios: Vec<Scenario>,
    /// Bounds on what each rings with after the move.
    pub residuals: Vec<(Residual, f64)>,
}

/// One plant besides the nominal one.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// What differs, for people.
    pub name: String,
    /// The machine.
    pub machine: MachineKind,
    /// Whether the limits hold for it too.
    pub limited: bool,
}

/// What is measured of a vibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Residual {
    /// Amplitude of every output of a kind and unit.
    Outputs(OutputKind, &'static str),
    /// Its energy, J.
    Energy,
}

impl Residual {
    /// All of them with their keys.
    const ALL: [(&'static str, Self); 4] = [
        ("residual_strain", Self::Outputs(OutputKind::Strain, "")),
        (
            "residual_displacement_m",
            Self::Outputs(OutputKind::ElasticDisplacement, "m"),
        ),
        (
            "residual_displacement_rad",
            Self::Outputs(OutputKind::ElasticDisplacement, "rad"),
        ),
        ("residual_energy_j", Self::Energy),
    ];

    /// Its key in the move file.
    #[must_use]
    pub fn key(&self) -> &'static str {
        let mut all = Self::ALL.iter();
        all.find(|(_, residual)| residual == self)
            .map_or("residual", |(key, _)| key)
    }

    fn exists(&self, machine: &MachineKind) -> bool {
        match *self {
            Self::Energy => true,
            Self::Outputs(kind, unit) => {
                let outputs = machine.plant().outputs();
                outputs.iter().any(|o| o.kind == kind && o.unit == unit)
            }
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobustTable {
    parameter: String,
    factors: Option<Vec<f64>>,
    values: Option<Vec<f64>>,
    residual_strain: Option<f64>,
    residual_displacement_m: Option<f64>,
    residual_displacement_rad: Option<f64>,
    residual_energy_j: Option<f64>,
    limits: Option<LimitedPlants>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"nominal\", \"all\" or a list of some of the factors or values"
)]
enum LimitedPlants {
    Named(Named),
    Chosen(Vec<f64>),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Named {
    Nominal,
    All,
}

impl Robust {
    /// Reads the table; the machine stands at both ends.
    pub(super) fn read(
        section: &Section<'_>,
        machine: &MachineKind,
        ends: [(&'static str, &[f64]); 2],
    ) -> Result<Self, Box<Fault>> {
        let table: RobustTable = section.read()?;
        let residuals = residuals(section, &table, machine)?;
        let wrong = |key: &str, message: &str| {
            Fault::new(
                section.bytes(key),
                Problem::Type {
                    key: key.into(),
                    message: message.into(),
                },
            )
        };
        let (key, numbers) = match (&table.factors, &table.values) {
            (Some(factors), None) => ("factors", factors),
            (None, Some(values)) => ("values", values),
            (Some(_), Some(_)) => {
                return Err(wrong(
                    "values",
                    "give either `factors` or `values`, not both",
                ));
            }
            (None, None) => {
                return Err(wrong(
                    "parameter",
                    "say how it changes: `factors = [0.8, 1.2]`, or `values` in its unit",
                ));
            }
        };
        if numbers.is_empty() {
            return Err(wrong(
                key,
                "the list is empty: name at least one, or leave [robust] out",
            ));
        }
        let limited = |number: &f64| match &table.limits {
            None | Some(LimitedPlants::Named(Named::Nominal)) => false,
            Some(LimitedPlants::Named(Named::All)) => true,
            Some(LimitedPlants::Chosen(chosen)) => chosen.contains(number),
        };
        if let Some(LimitedPlants::Chosen(chosen)) = &table.limits
            && (chosen.is_empty() || !chosen.iter().all(|number| numbers.contains(number)))
        {
            return Err(wrong(
                "limits",
                &format!("must be \"nominal\", \"all\" or some of the `{key}`"),
            ));
        }
        let scenarios = numbers.iter().map(|&number| {
            let (change, name) = if key == "factors" {
                positive_factor(section, number)?;
                (
                    Change::Factor(number),
                    format!("{} × {number}", table.parameter),
                )
            } else {
                (
                    Change::Value(number),
                    format!("{} = {number}", table.parameter),
                )
            };
            Ok(Scenario {
                name,
                machine: other_plant(section, machine, &table.parameter, (key, change), ends)?,
                limited: limited(&number),
            })
        });
        Ok(Self {
            scenarios: scenarios.collect::<Result<_, Box<Fault>>>()?,
            residuals,
        })
    }
}

fn positive_factor(section: &Section<'_>, factor: f64) -> Result<(), Box<Fault>> {
    if factor.is_finite() && factor > 0.0 {
        return Ok(());
    }
    Err(Fault::new(
        section.bytes("factors"),
        Problem::Value {
            key: "factors".into(),
            value: factor,
            rule: "a factor must be a positive number; 1 is the nominal plant".into(),
        },
    ))
}

/// The machine with the parameter changed, if it stands at both ends with its joints where the nominal one has them.
fn other_plant(
    section: &Section<'_>,
    machine: &MachineKind,
    parameter: &str,
    (key, change): (&'static str, Change),
    ends: [(&'static str, &[f64]); 2],
) -> Result<MachineKind, Box<Fault>> {
    let other = machine
        .changed(parameter, change)
        .map_err(|error| match error {
            MachineError::UnknownParameter { key, known } => Fault::new(
                section.bytes("parameter"),
                Problem::UnknownParameter {
                    nearest: nearest(&key, &known),
                    known,
                    key,
                },
            ),
            MachineError::Parameter {
                key: changed,
                value,
                rule,
            } => Fault::new(
                section.bytes(key),
                Problem::Value {
                    key: changed.into(),
                    value,
                    rule: rule.into(),
                },
            ),
            other => Fault::new(
                section.bytes(key),
                Problem::Type {
                    key: key.into(),
                    message: other.to_string(),
                },
            ),
        })?;
    let angles = |machine: &MachineKind, pose: &[f64]| {
        let plant = machine.plant();
        plant.joint_angles(&plant.rest(pose))
    };
    for (_, pose) in ends {
        let (here, there) = (angles(machine, pose), angles(&other, pose));
        let same = |(a, b): (&f64, &f64)| (a - b).abs() < SAME_ANGLE_RAD;
        if !here.iter().zip(&there).all(same) {
            return Err(Fault::new(
                section.bytes("parameter"),
                Problem::Type {
                    key: "parameter".into(),
                    message: format!(
                        "`{parameter}` changes where the joints stand at the ends, so no commanded motion suits both plants; a \
                         robust plan is for masses, inertias, stiffness and damping"
                    ),
                },
            ));
        }
    }
    Ok(other)
}

fn residuals(
    section: &Section<'_>,
    table: &RobustTable,
    machine: &MachineKind,
) -> Result<Vec<(Residual, f64)>, Box<Fault>> {
    let given = [
        table.residual_strain,
        table.residual_displacement_m,
        table.residual_displacement_rad,
        table.residual_energy_j,
    ];
    let mut residuals = Vec::new();
    let known: Vec<&str> = (Residual::ALL.iter())
        .filter(|(_, residual)| residual.exists(machine))
        .map(|(key, _)| *key)
        .collect();
    for ((key, residual), bound) in Residual::ALL.into_iter().zip(given) {
        let Some(bound) = bound else { continue };
        if !residual.exists(machine) {
            return Err(Fault::new(
                section.bytes(key),
                Problem::Type {
                    key: key.into(),
                    message: format!(
                        "the machine has no such output; it has {}",
                        known.join(", ")
                    ),
                },
            ));
        }
        if !(bound.is_finite() && bound > 0.0) {
            return Err(Fault::new(
                section.bytes(key),
                Problem::Value {
                    key: key.into(),
                    value: bound,
                    rule: "must be a positive number: no motion leaves two plants perfectly still"
                        .into(),
                },
            ));
        }
        residuals.push((residual, bound));
    }
    if residuals.is_empty() {
        return Err(Fault::new(
            section.bytes(""),
            Problem::Type {
                key: "robust".into(),
                message: format!("say what may be left after the move: {}", known.join(", ")),
            },
        ));
    }
    Ok(residuals)
}
