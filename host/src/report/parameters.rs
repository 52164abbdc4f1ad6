//! What a move was planned with, and how well it is known.

use super::data::{Origin, Parameter};
use crate::movefile::MoveFile;

/// Limits of the paper's move that the paper does not state in these terms: key and reason.
///
/// The machine knows which of its parameters are assumed; limits belong to the move.
pub const PAPER_LIMIT_ASSUMPTIONS: [(&str, &str); 2] = [
    (
        "torque_rate_nm_per_s",
        "assumed: the paper's \"0.001\" read as N·m/µs at the motor, times the ratio",
    ),
    (
        "torque_speed_knee_rpm",
        "assumed: the paper gives no number",
    ),
];

/// Every key of a move file with its origin. `assumed` adds keys to those that the machine says are assumed.
#[must_use]
pub fn parameters_of(file: &MoveFile, assumed: &[(&str, &str)]) -> Vec<Parameter> {
    let machine = file.machine.assumptions();
    let parameter = |entry: &crate::movefile::Entry| {
        let of_machine = machine
            .iter()
            .find(|a| entry.table == "machine" && a.key == entry.key)
            .map(|a| a.origin);
        let source = of_machine.or_else(|| {
            let other = assumed
                .iter()
                .find(|a| entry.table != "machine" && a.0 == entry.key);
            other.map(|a| a.1)
        });
        let (origin, source) = source.map_or((Origin::Stated, ""), split_origin);
        Parameter {
            group: format!("[{}]", entry.table),
            key: entry.key.clone(),
            value: entry.value.trim_matches('"').to_owned(),
            unit: unit_of(&entry.key).to_owned(),
            origin,
            source: source.to_owned(),
        }
    };
    file.entries.iter().map(parameter).collect()
}

/// Takes the first word of an origin as its kind, if it is one.
fn split_origin(origin: &str) -> (Origin, &str) {
    let after = |word| {
        origin
            .strip_prefix(word)
            .map(|rest: &str| rest.trim_start_matches(':').trim_start())
    };
    if let Some(rest) = after("derived") {
        (Origin::Derived, rest)
    } else {
        let rest = after("assumed").or_else(|| after("calibrated or assumed:"));
        (Origin::Assumed, rest.unwrap_or(origin))
    }
}

/// The unit in a key's name.
fn unit_of(key: &str) -> &'static str {
    const UNITS: [(&str, &str); 14] = [
        ("_nm_s_per_rad", "N·m·s/rad"),
        ("_nm_per_rad", "N·m/rad"),
        ("_nm_per_rpm", "N·m/rpm"),
        ("_nm_per_s", "N·m/s"),
        ("_kg_per_m3", "kg/m³"),
        ("_kg_m2", "kg·m²"),
        ("_rpm", "rpm"),
        ("_rad", "rad"),
        ("_kg", "kg"),
        ("_nm", "N·m"),
        ("_pa", "Pa"),
        ("_hz", "Hz"),
        ("_m", "m"),
        ("_s", "s"),
    ];
    let unit = |key: &str| UNITS.iter().find(|(end, _)| key.ends_with(end));
    // `elastic_displacement_m.x` has its unit in the table's name.
    let found = unit(key).or_else(|| unit(key.rsplit_once('.')?.0));
    found.map_or("", |(_, unit)| unit)
}

#[cfg(test)]
mod tests {
    use super::{Origin, PAPER_LIMIT_ASSUMPTIONS, parameters_of, unit_of};
    use crate::movefile::MoveFile;

    #[test]
    fn marks_what_is_assumed() {
        let file =
            MoveFile::parse(include_str!("../../moves/paper.toml"), "paper.toml").expect("paper");
        let all = parameters_of(&file, &PAPER_LIMIT_ASSUMPTIONS);
        let find = |key: &str| all.iter().find(|p| p.key == key).expect(key);
        assert_eq!(find("base_side_m").origin, Origin::Derived);
        assert_eq!(
            find("base_side_m").source,
            "the paper's start is the base centroid"
        );
        assert_eq!(find("link_thickness_m").origin, Origin::Stated);
        assert_eq!(find("platform_mass_kg").origin, Origin::Assumed);
        assert_eq!(find("torque_rate_nm_per_s").origin, Origin::Assumed);
        assert_eq!(
            (find("torque_nm").origin, find("torque_nm").unit.as_str()),
            (Origin::Stated, "N·m")
        );
        let assumed = all.iter().filter(|p| p.origin != Origin::Stated).count();
        assert_eq!(assumed, file.machine.assumptions().len() + 2);
    }

    #[test]
    fn reads_units_from_keys() {
        assert_eq!(unit_of("torque_speed_slope_nm_per_rpm"), "N·m/rpm");
        assert_eq!(unit_of("damping_nm_s_per_rad"), "N·m·s/rad");
        assert_eq!(unit_of("platform_inertia_kg_m2"), "kg·m²");
        assert_eq!(unit_of("elastic_displacement_m.x"), "m");
        assert_eq!(unit_of("from.phi_rad"), "rad");
        assert_eq!(unit_of("points"), "");
    }
}
