//! How well the machine is known: `[machine.uncertainty]`, and how still a move has to end within it.

use super::error::{Fault, Problem};
use super::kind::MachineKind;
use super::nearest::nearest;
use super::section::Section;
use crate::machine::OutputKind;

/// Strain that may be left if the file says nothing.
const STRAIN: f64 = 50e-6;

/// Parameters that may be off, and what may be left then.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Key of each parameter and the share by which it may be off, either way.
    pub parameters: Vec<(String, f64)>,
    /// Residual from which on a plan has lost its stillness: strain, or the elastic displacement of a machine without gauges.
    pub residual: f64,
}

impl Uncertainty {
    /// Reads `[machine.uncertainty]`: shares by parameter, and `residual_…`, what may be left.
    pub(super) fn read(section: &Section<'_>, machine: &MachineKind) -> Result<Self, Box<Fault>> {
        let residual_key = residual_key(machine);
        let known = machine.parameter_keys();
        let (mut parameters, mut residual) = (Vec::new(), None);
        for key in section.keys() {
            let value: f64 = section.value(&key)?;
            let wrong = |rule: &str| {
                Err(Fault::new(
                    section.bytes(&key),
                    Problem::Value {
                        key: key.clone(),
                        value,
                        rule: rule.into(),
                    },
                ))
            };
            if key == residual_key {
                if !(value.is_finite() && value > 0.0) {
                    return wrong("must be a positive number");
                }
                residual = Some(value);
            } else if !known.contains(&key.as_str()) {
                let mut known = known.clone();
                known.push(residual_key);
                return Err(Fault::new(
                    section.bytes(&key),
                    Problem::UnknownParameter {
                        nearest: nearest(&key, &known),
                        known,
                        key,
                    },
                ));
            } else if !(value > 0.0 && value < 1.0) {
                return wrong(
                    "must lie between 0 and 1: the share by which the parameter may be off, 0.1 for ±10 %",
                );
            } else if machine.parameter(&key) == Some(0.0) {
                return wrong("is a share of a parameter that is 0, and changes nothing");
            } else {
                parameters.push((key, value));
            }
        }
        let default = (residual_key == "residual_strain").then_some(STRAIN);
        let Some(residual) = residual.or(default) else {
            return Err(Fault::new(
                section.bytes(""),
                Problem::MissingKey {
                    key: residual_key.into(),
                    table: "[machine.uncertainty]".into(),
                },
            ));
        };
        Ok(Self {
            parameters,
            residual,
        })
    }
}

/// Key of what may be left: strain where there are gauges.
fn residual_key(machine: &MachineKind) -> &'static str {
    let outputs = machine.plant().outputs();
    let mut displacements = outputs
        .iter()
        .filter(|output| output.kind == OutputKind::ElasticDisplacement);
    if outputs
        .iter()
        .any(|output| output.kind == OutputKind::Strain)
    {
        "residual_strain"
    } else if displacements.any(|output| output.unit == "rad") {
        "residual_displacement_rad"
    } else {
        "residual_displacement_m"
    }
}
