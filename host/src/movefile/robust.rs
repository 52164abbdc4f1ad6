//! The `[robust]` table: other plants that one commanded motion has to suit as well.

use super::error::{Fault, Problem};
use super::kind::MachineKind;
use super::nearest::nearest;
use super::section::Section;
use crate::machine::{Change, MachineError, OutputKind};
use serde::Deserialize;

/// Joint angles closer than this are the same.
const SAME_ANGLE_RAD: f64 = 1e-9;

/// How many times greater or less than the nominal plant's a parameter may be.
const MOST_APART: f64 = 100.0;

/// Most plants besides the nominal one: what is stored of them has to fit into a file.
const MOST_PLANTS: usize = 12;

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
    /// Key of the parameter that differs, and how.
    parameter: String,
    change: Change,
}

impl Scenario {
    /// A plant that differs from the nominal one in a parameter.
    ///
    /// # Errors
    /// [`MachineError`] where the machine has no such parameter, or no machine has its value.
    pub fn new(
        nominal: &MachineKind,
        parameter: &str,
        change: Change,
        limited: bool,
    ) -> Result<Self, MachineError> {
        Ok(Self {
            name: match change {
                Change::Factor(factor) => format!("{parameter} × {factor}"),
                Change::Value(value) => format!("{parameter} = {value}"),
            },
            machine: nominal.changed(parameter, change)?,
            limited,
            parameter: parameter.to_owned(),
            change,
        })
    }

    /// The plant on the way from the nominal one to this one, a share of the way from there.
    ///
    /// # Errors
    /// [`MachineError`], hardly: between two machines there are machines.
    pub fn part_of_the_way(&self, nominal: &MachineKind, share: f64) -> Result<Self, MachineError> {
        let change = match self.change {
            // Rounded, for people.
            Change::Factor(factor) => {
                Change::Factor(((1.0 + share * (factor - 1.0)) * 1e6).round() / 1e6)
            }
            Change::Value(value) => {
                let from = nominal.parameter(&self.parameter).unwrap_or(value);
                Change::Value(from + share * (value - from))
            }
        };
        Self::new(nominal, &self.parameter, change, self.limited)
    }
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
    /// The same with every plant a share of the way from the nominal one.
    ///
    /// # Errors
    /// [`MachineError`], hardly: between two machines there are machines.
    pub fn part_of_the_way(&self, nominal: &MachineKind, share: f64) -> Result<Self, MachineError> {
        let scenarios = self.scenarios.iter();
        let nearer = scenarios.map(|scenario| scenario.part_of_the_way(nominal, share));
        Ok(Self {
            scenarios: nearer.collect::<Result<_, _>>()?,
            residuals: self.residuals.clone(),
        })
    }

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
        check_numbers(section, key, numbers, machine.parameter(&table.parameter))?;
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
            let change = if key == "factors" {
                Change::Factor(number)
            } else {
                Change::Value(number)
            };
            let scenario = Scenario::new(machine, &table.parameter, change, limited(&number));
            let scenario = scenario.map_err(|error| impossible(section, key, error))?;
            same_joints(
                section,
                &table.parameter,
                (machine, &scenario.machine),
                ends,
            )?;
            Ok(scenario)
        });
        Ok(Self {
            scenarios: scenarios.collect::<Result<_, Box<Fault>>>()?,
            residuals,
        })
    }
}

/// Whether numbers make plants of their own; `nominal` is the parameter's value.
fn check_numbers(
    section: &Section<'_>,
    key: &'static str,
    numbers: &[f64],
    nominal: Option<f64>,
) -> Result<(), Box<Fault>> {
    let wrong = |value: f64, rule: &str| {
        Err(Fault::new(
            section.bytes(key),
            Problem::Value {
                key: key.into(),
                value,
                rule: rule.into(),
            },
        ))
    };
    for (index, &number) in numbers.iter().enumerate() {
        let factor = key == "factors";
        if factor && !(number.is_finite() && number > 0.0) {
            return wrong(
                number,
                "a factor must be a positive number; 1 is the nominal plant",
            );
        }
        let share = match nominal {
            Some(nominal) if !factor && nominal != 0.0 => number / nominal,
            _ if factor => number,
            _ => 1.0,
        };
        if share > MOST_APART || (share > 0.0 && share < 1.0 / MOST_APART) {
            return wrong(
                number,
                "must be a hundredth to a hundred times the nominal plant's: one motion cannot suit plants that differ more",
            );
        }
        if factor && nominal == Some(0.0) {
            return wrong(
                number,
                "the parameter is zero, and stays so times any factor: give `values`",
            );
        }
        if number
            == if factor {
                1.0
            } else {
                nominal.unwrap_or(f64::NAN)
            }
        {
            return wrong(
                number,
                "that is the nominal plant, which is planned for anyway: leave it out",
            );
        }
        if numbers[..index].contains(&number) {
            return wrong(number, "stands there twice");
        }
    }
    if numbers.len() > MOST_PLANTS {
        return Err(Fault::new(
            section.bytes(key),
            Problem::Type {
                key: key.into(),
                message: format!(
                    "{} plants are more than the {MOST_PLANTS} that can be planned for: the outermost and a few between them will do",
                    numbers.len()
                ),
            },
        ));
    }
    Ok(())
}

/// Why there is no such plant.
fn impossible(section: &Section<'_>, key: &'static str, error: MachineError) -> Box<Fault> {
    match error {
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
    }
}

/// Whether two plants stand at both ends with their joints and motors at the same angles.
fn same_joints(
    section: &Section<'_>,
    parameter: &str,
    (machine, other): (&MachineKind, &MachineKind),
    ends: [(&'static str, &[f64]); 2],
) -> Result<(), Box<Fault>> {
    let angles = |machine: &MachineKind, pose: &[f64]| {
        let plant = machine.plant();
        plant.joint_angles(&plant.rest(pose))
    };
    let ratios = [machine, other].map(|machine| machine.plant().reducer_ratio());
    let mut stand = ratios[0] == ratios[1];
    for (_, pose) in ends {
        let (here, there) = (angles(machine, pose), angles(other, pose));
        let mut pairs = here.iter().zip(&there);
        stand &= pairs.all(|(a, b)| (a - b).abs() < SAME_ANGLE_RAD);
    }
    if stand {
        return Ok(());
    }
    Err(Fault::new(
        section.bytes("parameter"),
        Problem::Type {
            key: "parameter".into(),
            message: format!(
                "`{parameter}` changes where the motors stand at the ends, so no commanded motion suits both plants; a robust \
                 plan is for masses, inertias, stiffness and damping"
            ),
        },
    ))
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
