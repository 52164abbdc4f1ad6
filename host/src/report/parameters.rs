//! What a move was planned with, and how well it is known.

use super::data::{Origin, Parameter};
use crate::movefile::{Entry, MoveFile, PAPER_MOVE};

/// Limits of the paper's move that the paper does not state in these terms: key and reason.
///
/// The machine knows which of its parameters are assumed; limits belong to the move.
const PAPER_LIMIT_ASSUMPTIONS: [(&str, &str); 2] = [
    (
        "torque_rate_nm_per_s",
        "assumed: the paper's \"0.001\" read as N·m/µs at the motor, times the ratio",
    ),
    (
        "torque_speed_knee_rpm",
        "assumed: the paper gives no number",
    ),
];

/// Every key of a move file with its origin.
///
/// What is assumed of the paper's machine and limits is assumed where key and value are the paper's: another value is
/// its user's own.
#[must_use]
pub fn parameters_of(file: &MoveFile) -> Vec<Parameter> {
    let machine = file.machine.assumptions();
    // The file comes with the program: without it nothing would be marked.
    let paper = MoveFile::parse(PAPER_MOVE, "paper.toml")
        .map_or_else(|_| Vec::new(), |paper| paper.entries);
    let parameter = |entry: &Entry| {
        let papers = paper
            .iter()
            .any(|p| (p.table, &p.key, &p.value) == (entry.table, &entry.key, &entry.value));
        let source = match entry.table {
            _ if !papers => None,
            "machine" => machine
                .iter()
                .find(|a| a.key == entry.key)
                .map(|a| a.origin),
            _ => {
                let mut assumed = PAPER_LIMIT_ASSUMPTIONS.iter();
                assumed.find(|a| a.0 == entry.key).map(|a| a.1)
            }
        };
        let (origin, source) = source.map_or((Origin::Stated, ""), split_origin);
        Parameter {
            group: format!("[{}]", entry.table),
            key: entry.key.clone(),
            value: entry.value.clone(),
            unit: unit_of(&entry.key).to_owned(),
            origin,
            source: source.to_owned(),
        }
    };
    let written = file.entries.iter().map(parameter);
    written.chain(drive_defaults(file)).collect()
}

/// The settings of the simulated drives that the file leaves to their defaults.
fn drive_defaults(file: &MoveFile) -> impl Iterator<Item = Parameter> {
    let drive = &file.drive;
    let resolution = drive.encoder_resolution_rad;
    let values = [
        (
            "position_bandwidth_hz",
            drive.position_bandwidth_hz.to_string(),
        ),
        (
            "velocity_bandwidth_hz",
            drive.velocity_bandwidth_hz.to_string(),
        ),
        ("loop_rate_hz", drive.loop_rate_hz.to_string()),
        (
            "encoder_resolution_rad",
            resolution.map_or("exact".to_owned(), |r| r.to_string()),
        ),
        ("delay_s", drive.delay_s.to_string()),
        ("payload_factor", drive.payload_factor.to_string()),
        (
            "elastic_damping_ratio",
            drive.elastic_damping_ratio.to_string(),
        ),
        (
            "joint_friction_nm_s_per_rad",
            drive.joint_friction_nm_s_per_rad.to_string(),
        ),
    ];
    let missing = values.into_iter().filter(|(key, _)| {
        let mut written = file.entries.iter();
        !written.any(|entry| entry.table == "drive" && entry.key == *key)
    });
    missing.map(|(key, value)| Parameter {
        group: "[drive]".to_owned(),
        key: key.to_owned(),
        value,
        unit: unit_of(key).to_owned(),
        origin: Origin::Assumed,
        source: "default of the simulated drives".to_owned(),
    })
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
    use super::{Origin, parameters_of, unit_of};
    use crate::movefile::{MoveFile, PAPER_MOVE};

    #[test]
    fn marks_what_is_assumed() {
        let file = MoveFile::parse(PAPER_MOVE, "paper.toml").expect("paper");
        let all = parameters_of(&file);
        let find = |key: &str| all.iter().find(|p| p.key == key).expect(key);
        assert_eq!(find("base_side_m").origin, Origin::Derived);
        assert_eq!(
            find("base_side_m").source,
            "the paper's start is the base centroid"
        );
        assert_eq!(find("link_thickness_m").origin, Origin::Stated);
        assert_eq!(find("platform_mass_kg").origin, Origin::Assumed);
        assert_eq!(find("torque_rate_nm_per_s").origin, Origin::Assumed);
        assert_eq!(find("loop_rate_hz").origin, Origin::Assumed);
        assert_eq!(
            (find("torque_nm").origin, find("torque_nm").unit.as_str()),
            (Origin::Stated, "N·m")
        );
        let assumed = all.iter().filter(|p| p.origin != Origin::Stated).count();
        let of_drives = 8;
        assert_eq!(assumed, file.machine.assumptions().len() + 2 + of_drives);
    }

    /// Somebody who measured a platform of 1.2 kg has not calibrated it to the paper.
    #[test]
    fn another_value_is_its_users_own() {
        let text = PAPER_MOVE
            .replace("platform_mass_kg = 2.55", "platform_mass_kg = 1.2")
            .replace("[mesh]", "[drive]\ndelay_s = 1e-4\n\n[mesh]");
        let file = MoveFile::parse(&text, "own.toml").expect("a move");
        let all = parameters_of(&file);
        let origins = |key: &str| -> Vec<Origin> {
            all.iter()
                .filter(|p| p.key == key)
                .map(|p| p.origin)
                .collect()
        };
        assert_eq!(origins("platform_mass_kg"), [Origin::Stated]);
        assert_eq!(origins("link_length_m"), [Origin::Assumed]);
        assert_eq!(origins("delay_s"), [Origin::Stated]);
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
