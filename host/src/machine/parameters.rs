//! Parameters by name: what a study or a robust plan changes without knowing the machine.

use super::Machine;

/// One number of a machine.
#[derive(Debug)]
pub struct Parameter<'a> {
    /// Key with unit, as in the move file's `[machine]` table.
    pub key: &'static str,
    /// Its value.
    pub value: &'a mut f64,
    /// Keys of the parameters that grow by the same factor, such as a payload's inertia with its mass.
    pub with: &'static [&'static str],
}

impl<'a> Parameter<'a> {
    /// One that changes alone.
    pub fn alone(key: &'static str, value: &'a mut f64) -> Self {
        Self {
            key,
            value,
            with: &[],
        }
    }
}

/// How a parameter is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Multiplied.
    Factor(f64),
    /// Replaced, in the parameter's unit.
    Value(f64),
}

/// A copy of a machine with one parameter changed, and by the same factor those that grow with it; not checked. `None` if
/// there is no such parameter.
pub(super) fn changed<M: Machine>(machine: &M, key: &str, change: Change) -> Option<M> {
    let mut copy = machine.clone();
    let mut parameters = copy.parameters();
    let index = parameters.iter().position(|p| p.key == key)?;
    let (before, with) = (*parameters[index].value, parameters[index].with);
    let (value, factor) = match change {
        Change::Factor(factor) => (before * factor, factor),
        Change::Value(value) => (value, value / before),
    };
    *parameters[index].value = value;
    for parameter in parameters.iter_mut().filter(|p| with.contains(&p.key)) {
        *parameter.value *= factor;
    }
    drop(parameters);
    Some(copy)
}

#[cfg(test)]
mod tests {
    use super::Change;
    use crate::machine::MachineError;
    use crate::movefile::{MachineKind, MoveFile, PAPER_MOVE};

    fn paper() -> MachineKind {
        MoveFile::parse(PAPER_MOVE, "paper.toml")
            .expect("paper")
            .machine
    }

    /// The locked frequencies, which see every mass and every stiffness.
    fn frequencies_hz(machine: &MachineKind) -> Vec<f64> {
        let plant = machine.plant();
        let rest = plant.rest(&[0.1875, 0.10825317547305484, 0.0]);
        let modes = crate::simulate::modes::locked(plant, &rest).expect("regular");
        modes.iter().map(|mode| mode.frequency_hz).collect()
    }

    #[test]
    fn a_factor_of_one_changes_nothing() {
        let axis = MoveFile::parse(include_str!("../../moves/axis.toml"), "axis.toml");
        for machine in [paper(), axis.expect("axis").machine] {
            for key in machine.parameter_keys() {
                let known = machine.changed(key, Change::Factor(1.0)).expect(key);
                assert_eq!(known, machine, "{key}");
            }
        }
    }

    #[test]
    fn a_payload_takes_its_inertia_along() {
        let machine = paper();
        let heavy = machine.changed("platform_mass_kg", Change::Factor(1.2));
        let heavy = heavy.expect("possible");
        assert_eq!(heavy, machine.with_payload_factor(1.2));
        assert_eq!(heavy.parameter("platform_mass_kg"), Some(2.55 * 1.2));
        assert_eq!(
            heavy.parameter("platform_inertia_kg_m2"),
            Some(1.1953125e-3 * 1.2)
        );
        let by_value = machine.changed("platform_mass_kg", Change::Value(2.55 * 1.2));
        let inertia = by_value
            .expect("possible")
            .parameter("platform_inertia_kg_m2");
        assert!((inertia.expect("there") / (1.1953125e-3 * 1.2) - 1.0).abs() < 1e-14);
    }

    /// ω² is proportional to the stiffness when no mass changes.
    #[test]
    fn stiffness_moves_frequencies_by_its_root() {
        let machine = paper();
        let stiffer = machine.changed("youngs_modulus_pa", Change::Factor(1.44));
        let (before, after) = (
            frequencies_hz(&machine),
            frequencies_hz(&stiffer.expect("possible")),
        );
        for (before, after) in before.iter().zip(&after) {
            assert!((after / before - 1.2).abs() < 1e-9, "{before} {after}");
        }
    }

    #[test]
    fn refuses_what_is_unknown_or_unphysical() {
        let machine = paper();
        let unknown = machine.changed("payload", Change::Factor(1.1));
        let message = unknown.expect_err("no such parameter").to_string();
        assert!(
            message.contains("`payload`") && message.contains("platform_mass_kg"),
            "{message}"
        );
        for change in [
            Change::Factor(0.0),
            Change::Factor(-1.0),
            Change::Value(f64::NAN),
        ] {
            let error = machine.changed("platform_mass_kg", change);
            assert!(
                matches!(error, Err(MachineError::Parameter { key, .. }) if key.starts_with("platform")),
                "{error:?}"
            );
        }
    }
}
