//! The moves at hand, and everything that can be wrong with one.

use super::{LimitsAt, MachineKind, MoveFile, MoveFileError, PAPER_MOVE, Problem};
use crate::machine::OutputKind;
use proptest::prelude::*;

const PAPER: &str = include_str!("../../moves/paper.toml");
const AXIS: &str = include_str!("../../moves/axis.toml");

/// What is said about the paper's move with one line replaced.
fn said(base: &str, old: &str, new: &str) -> String {
    assert!(base.contains(old), "{old}");
    MoveFile::parse(&base.replacen(old, new, 1), "moves/m.toml")
        .expect_err(new)
        .to_string()
}

/// Asserts that a change is refused at a line, with all of these words.
fn refused(base: &str, old: &str, new: &str, words: &[&str]) {
    let message = said(base, old, new);
    for word in words {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
    assert!(message.starts_with("moves/m.toml:"), "{message}");
}

#[test]
fn reads_the_papers_move() {
    let file = MoveFile::parse(PAPER, "host/moves/paper.toml").expect("paper");
    assert_eq!(file.name, "paper");
    assert_eq!(file.machine.name(), "3rrr-flexible");
    assert_eq!(file.from[0], 0.1875);
    assert_eq!(file.to, [0.2175, 0.10825317547305484, 0.0]);
    assert_eq!((file.mesh.intervals, file.mesh.points), (6, 10));
    assert_eq!(
        (file.solver.tolerance, file.solver.max_iterations),
        (1e-6, 2000)
    );
    let outputs = file.machine.plant().outputs();
    assert_eq!(file.limits.outputs.len(), outputs.len());
    for (output, limit) in outputs.iter().zip(&file.limits.outputs) {
        let expected = match (output.kind, output.key) {
            (OutputKind::Stress, _) => Some(355e6),
            (_, "elastic_displacement_x_m") => Some(1.5e-3),
            (_, "elastic_displacement_y_m") => Some(0.2e-3),
            _ => None,
        };
        assert_eq!(*limit, expected, "{}", output.key);
    }
    let shown = |key: &str| file.entries.iter().find(|e| e.key == key).expect("entry");
    assert_eq!(shown("youngs_modulus_pa").value, "210e9");
    assert_eq!(shown("to.x_m").table, "move");
}

#[test]
fn reads_whether_to_refine() {
    for (keys, refine) in [
        ("", None),
        ("refine = false", None),
        ("refine = true", Some(1e-4)),
        ("refine = true\ntolerance = 1e-5", Some(1e-5)),
    ] {
        let text = AXIS.replace("points = 8", &format!("points = 8\n{keys}"));
        let file = MoveFile::parse(&text, "axis.toml").expect("axis");
        assert_eq!(file.mesh.refine, refine, "{keys}");
    }
}

#[test]
fn reads_the_axis() {
    let file = MoveFile::parse(AXIS, "axis.toml").expect("axis");
    let MachineKind::TwoMassAxis(axis) = &file.machine else {
        panic!("not an axis");
    };
    assert_eq!(axis.load_inertia_kg_m2, 0.03);
    assert_eq!(file.limits.outputs, [Some(0.05)]);
    assert_eq!((file.from, file.to), (vec![0.0], vec![1.0]));
    assert_eq!(file.solver, super::Solver::default());
}

#[test]
fn whole_numbers_are_numbers_and_own_limits_are_optional() {
    let text = AXIS
        .replace("20.0\n", "20\n")
        .replace("twist_rad = 0.05\n", "");
    let file = MoveFile::parse(&text, "axis").expect("axis");
    assert_eq!(
        (file.limits.torque_nm, file.limits.outputs),
        (20.0, vec![None])
    );
    let text = PAPER.replace(", y = 0.2e-3", "");
    let limits = MoveFile::parse(&text, "paper").expect("paper").limits;
    assert_eq!(limits.outputs[..3], [Some(1.5e-3), None, None]);
}

#[test]
fn points_at_syntax_errors_and_unknown_keys() {
    let message = said(PAPER, "link_length_m = 0.125", "link_lenght_m = 0.125");
    let expected = "moves/m.toml:5:1: unknown key `link_lenght_m` in [machine]\n  |\n\
                    5 | link_lenght_m = 0.125\n  | ^^^^^^^^^^^^^\n  \
                    = did you mean `link_length_m`? Known keys: base_side_m, ";
    assert!(message.starts_with(expected), "{message}");
    refused(
        PAPER,
        "= 0.125",
        "= = 0.125",
        &[":5:17: ", "\n  |                 ^"],
    );
    refused(PAPER, "[mesh]", "[mesh", &[":34:", "]"]);
    refused(
        PAPER,
        "[mesh]",
        "[mehs]",
        &["unknown key `mehs` in the file", "did you mean `mesh`"],
    );
    refused(
        PAPER,
        "points = 10",
        "points = 10\npoints = 9",
        &[":37:1", "duplicate"],
    );
    refused(
        PAPER,
        "x = 1.5e-3",
        "z = 1.5e-3",
        &[":28:", "`z`", "`x`", "`y`"],
    );
    refused(
        PAPER,
        "stress_pa",
        "twist_rad",
        &["unknown key `twist_rad` in [limits]", "stress_pa"],
    );
    refused(
        PAPER,
        "phi_rad = 0.0 }\nto",
        "psi_rad = 0.0 }\nto",
        &["unknown key `psi_rad` in `from`"],
    );
    refused(
        AXIS,
        "angle_rad = 1.0",
        "angle_deg = 1.0",
        &["unknown key `angle_deg` in `to`", "angle_rad"],
    );
    refused(
        AXIS,
        "points = 8",
        "points = 8\n[drive]\ngian = 1",
        &["[drive]", "`gian`"],
    );
}

#[test]
fn names_what_is_missing() {
    refused(
        PAPER,
        "[mesh]\nintervals = 6\npoints = 10",
        "",
        &["the table [mesh] is missing"],
    );
    refused(
        PAPER,
        "density_kg_per_m3 = 7850.0\n",
        "",
        &[":2:2", "[machine] lacks the key `density_kg_per_m3`"],
    );
    refused(
        PAPER,
        "kind = \"3rrr-flexible\"\n",
        "",
        &["[machine] lacks the key `kind`"],
    );
    refused(
        PAPER,
        "torque_nm = 150.0\n",
        "",
        &["[limits] lacks the key `torque_nm`"],
    );
    refused(
        PAPER,
        ", phi_rad = 0.0 }\nto",
        " }\nto",
        &["`from` lacks the key `phi_rad`"],
    );
    refused(
        AXIS,
        "to = { angle_rad = 1.0 }",
        "",
        &["[move] lacks the key `to`"],
    );
    refused(AXIS, "points = 8", "", &["[mesh] lacks the key `points`"]);
    let refined = |keys: &str| format!("points = 8\n{keys}");
    for (keys, words) in [
        ("tolerance = 1e-4", "needs refine = true beside it"),
        (
            "refine = false\ntolerance = 1e-4",
            "needs refine = true beside it",
        ),
        (
            "refine = true\ntolerance = 1e-9",
            "must lie between 1e-8 and 0.1",
        ),
        (
            "refine = true\ntolerance = nan",
            "must lie between 1e-8 and 0.1",
        ),
    ] {
        refused(AXIS, "points = 8", &refined(keys), &["tolerance", words]);
    }
    let empty = MoveFile::parse("", "m.toml")
        .expect_err("empty")
        .to_string();
    assert!(
        empty.starts_with("m.toml:1:1: the table [machine] is missing"),
        "{empty}"
    );
}

#[test]
fn refuses_other_kinds_and_types() {
    refused(
        PAPER,
        "3rrr-flexible",
        "3rrr-flexibel",
        &[
            "\"3rrr-flexibel\"",
            "did you mean `3rrr-flexible`",
            "two-mass-axis",
        ],
    );
    refused(
        PAPER,
        "\"minus\"",
        "\"left\"",
        &[":18:9", "`elbow`", "`left`", "`minus`"],
    );
    refused(
        PAPER,
        "= 0.125",
        "= \"long\"",
        &[":5:17", "`link_length_m`", "expected a number"],
    );
    refused(
        PAPER,
        "points = 10",
        "points = 10.5",
        &["`points`", "expected a whole number"],
    );
    refused(
        AXIS,
        "{ angle_rad = 1.0 }",
        "1.0",
        &["`to`", "expected a table"],
    );
    refused(
        AXIS,
        "[mesh]\nintervals = 10\npoints = 8",
        "[[mesh]]",
        &["`mesh`", "expected a table"],
    );
    refused(
        AXIS,
        "# An",
        "solver = 3\n#",
        &["`solver`", "expected a table"],
    );
}

#[test]
fn refuses_impossible_numbers() {
    refused(
        PAPER,
        "link_length_m = 0.125",
        "link_length_m = 0",
        &[":5:17", "link_length_m = 0: must be"],
    );
    refused(
        PAPER,
        "platform_mass_kg = 2.55",
        "platform_mass_kg = -2.55",
        &["platform_mass_kg = -2.55"],
    );
    refused(
        PAPER,
        "gauge_position = 0.5",
        "gauge_position = nan",
        &["gauge_position = NaN"],
    );
    refused(
        PAPER,
        "youngs_modulus_pa = 210e9",
        "youngs_modulus_pa = inf",
        &["= inf: must be"],
    );
    refused(
        PAPER,
        "torque_nm = 150.0",
        "torque_nm = 0.0",
        &["torque_nm = 0: a limit of zero"],
    );
    refused(
        PAPER,
        "6000.0",
        "-6000.0",
        &["motor_speed_rpm = -6000: limits hold in both"],
    );
    refused(
        PAPER,
        "slope_nm_per_rpm = 0.12",
        "slope_nm_per_rpm = nan",
        &["slope_nm_per_rpm = NaN"],
    );
    refused(
        PAPER,
        "y = 0.2e-3",
        "y = 0",
        &["elastic_displacement_m.y = 0: a limit of zero"],
    );
    refused(PAPER, "2.0e4", "1e999", &["torque_rate_nm_per_s"]);
    refused(
        PAPER,
        "intervals = 6",
        "intervals = 0",
        &["intervals = 0: must lie between 1 and"],
    );
    refused(
        PAPER,
        "intervals = 6",
        "intervals = 9000000000",
        &["intervals = 9000000000: must"],
    );
    refused(
        PAPER,
        "points = 10",
        "points = 1",
        &["points = 1: must lie between 2 and 32"],
    );
    refused(
        PAPER,
        "points = 10",
        "points = 33",
        &["points = 33: must lie between 2 and 32"],
    );
    for tolerance in ["0.0", "-1e-6", "1e-11", "nan", "inf", "0.1"] {
        let line = format!("tolerance = {tolerance}");
        refused(PAPER, "tolerance = 1e-6", &line, &["tolerance = ", "1e-10"]);
    }
    refused(
        PAPER,
        "max_iterations = 2000",
        "max_iterations = 0",
        &["max_iterations = 0"],
    );
    refused(
        AXIS,
        "angle_rad = 1.0",
        "angle_rad = inf",
        &["angle_rad = inf: must be a finite number"],
    );
}

#[test]
fn refuses_moves_that_cannot_be() {
    let far = "to = { x_m = 0.5, y_m = 0.10825317547305484, phi_rad = 0.0 }";
    let to = "to = { x_m = 0.2175, y_m = 0.10825317547305484, phi_rad = 0.0 }";
    refused(
        PAPER,
        to,
        far,
        &["cannot stand at `to`", "chain 1", "0.2205", "m apart"],
    );
    let huge = far.replace("0.5", "1e308");
    refused(PAPER, to, &huge, &["cannot stand at `to`", "chain 1"]);
    refused(PAPER, "x_m = 0.2175", "x_m = 0.1875", &["the same pose"]);
    refused(
        AXIS,
        "angle_rad = 1.0",
        "angle_rad = 1e-300",
        &["the same pose"],
    );
    refused(
        AXIS,
        "load_inertia_kg_m2 = 0.03",
        "load_inertia_kg_m2 = 1e308",
        &["singular at `from`"],
    );
    refused(
        PAPER,
        "to = { x_m = 0.2175, y_m = 0.10825317547305484, phi_rad = 0.0 }",
        "to = { x_m = 0.1875, y_m = 0.10825317547305484, phi_rad = 0.9 }",
        &[
            "singular pose lies between",
            "-1.873 at `from` and 0.977 at `to`",
        ],
    );
    refused(
        AXIS,
        "stiffness_nm_per_rad = 200.0",
        "stiffness_nm_per_rad = 1e-12",
        &["cannot end still at `from`", "can drift"],
    );
}

#[test]
fn limits_hold_everywhere_unless_the_solver_table_says_otherwise() {
    let parsed = |solver: &str| {
        let text = format!("{AXIS}\n[solver]\n{solver}\n");
        MoveFile::parse(&text, "move.toml").map(|file| file.solver.limits)
    };
    assert_eq!(parsed("").ok(), Some(LimitsAt::Everywhere));
    assert_eq!(
        parsed("limits = \"everywhere\"").ok(),
        Some(LimitsAt::Everywhere)
    );
    assert_eq!(parsed("limits = \"nodes\"").ok(), Some(LimitsAt::Nodes));
    let said = parsed("limits = \"somewhere\"")
        .expect_err("no such place")
        .to_string();
    for part in ["limits", "somewhere", "everywhere", "nodes", "move.toml"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn refuses_robust_moves_that_cannot_be() {
    let robust = "[robust]\nparameter = \"platform_mass_kg\"\nfactors = [0.8, 1.2]\nresidual_strain = 15e-6\n";
    let paper = format!("{PAPER}\n{robust}");
    let file = MoveFile::parse(&paper, "paper.toml").expect("a robust move");
    let scenarios = file.robust.as_ref().expect("there").scenarios.clone();
    assert_eq!(scenarios[1].name, "platform_mass_kg × 1.2");
    assert_eq!(scenarios[1].machine, file.machine.with_payload_factor(1.2));
    assert!(scenarios.iter().all(|scenario| !scenario.limited));
    let cases: [(&str, &str, &[&str]); 19] = [
        (
            "\"platform_mass_kg\"",
            "\"reducer_ratio\"",
            &["where the motors stand"],
        ),
        (
            "\"platform_mass_kg\"",
            "\"platform_joint_mass_kg\"",
            &["factors = 0.8", "zero", "`values`"],
        ),
        (
            "[0.8, 1.2]",
            "[0.8, 1.2, 0.8]",
            &["0.8: stands there twice"],
        ),
        (
            "[0.8, 1.2]",
            "[0.8, 1.0]",
            &["factors = 1", "the nominal plant"],
        ),
        (
            "factors = [0.8, 1.2]",
            "values = [2.0, 2.55]",
            &["values = 2.55", "the nominal plant"],
        ),
        (
            "[0.8, 1.2]",
            "[0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6]",
            &["13 plants", "12"],
        ),
        (
            "\"platform_mass_kg\"",
            "\"platform_mas_kg\"",
            &[
                "no parameter",
                "did you mean `platform_mass_kg`",
                "youngs_modulus_pa",
            ],
        ),
        (
            "\"platform_mass_kg\"",
            "\"link_length_m\"",
            &["where the motors stand"],
        ),
        ("[0.8, 1.2]", "[]", &["`factors`", "empty"]),
        (
            "[0.8, 1.2]",
            "[0.8, 0.0]",
            &["factors = 0: a factor must be a positive number"],
        ),
        ("[0.8, 1.2]", "[0.8, -1.2]", &["factors = -1.2"]),
        ("[0.8, 1.2]", "[0.8, nan]", &["factors = NaN"]),
        (
            "factors = [0.8, 1.2]",
            "values = [-1.0]",
            &["platform_mass_kg = -1"],
        ),
        (
            "factors = [0.8, 1.2]",
            "factors = [0.8, 1e9]",
            &["factors = 1000000000", "a hundred times"],
        ),
        ("factors = [0.8, 1.2]", "", &["factors = [0.8, 1.2]"]),
        (
            "factors = [0.8, 1.2]",
            "factors = [0.8]\nvalues = [2.0]",
            &["not both"],
        ),
        (
            "residual_strain = 15e-6",
            "",
            &[
                "residual_strain",
                "residual_displacement_m",
                "residual_energy_j",
            ],
        ),
        (
            "residual_strain = 15e-6",
            "residual_strain = 0.0",
            &["residual_strain = 0"],
        ),
        (
            "residual_strain = 15e-6",
            "residual_strain = 15e-6\nlimits = [0.9]",
            &["`limits`", "some of the `factors`"],
        ),
    ];
    for (old, new, words) in cases {
        refused(&paper, old, new, words);
    }
    let axis = format!("{AXIS}\n{robust}").replace("platform_mass_kg", "load_inertia_kg_m2");
    refused(
        &axis,
        "residual_strain",
        "residual_strain",
        &["no such output", "residual_displacement_rad"],
    );
    let limits = "residual_strain = 15e-6\nlimits = \"some\"";
    refused(
        &paper,
        "residual_strain = 15e-6",
        limits,
        &["\"nominal\", \"all\" or a list"],
    );
}

#[test]
fn says_why_a_file_cannot_be_read() {
    let message = MoveFile::read("no/such/move.toml")
        .expect_err("missing")
        .to_string();
    assert!(
        message.starts_with("no/such/move.toml: cannot read the move file"),
        "{message}"
    );
    assert!(MoveFile::read(".").is_err());
}

#[test]
fn nothing_in_the_file_reaches_the_terminal_as_a_command() {
    let message = said(PAPER, "elbow", "\"\\u001b[2J\" = 1\nelbow");
    assert!(!message.contains('\u{1b}'), "{message:?}");
}

#[test]
fn deep_nesting_is_an_error() {
    let deep = format!("a = {}", "[".repeat(200_000));
    assert!(MoveFile::parse(&deep, "m").is_err());
}

/// One of the moves with something overwritten, cut out or put in.
fn mutated() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        "[ -~\n]{0,6}",
        Just("nan".to_owned()),
        Just("-inf".to_owned()),
        Just("1e308".to_owned()),
        Just("5e-324".to_owned()),
        Just("-9223372036854775808".to_owned()),
        Just("{".to_owned()),
        any::<String>(),
    ];
    let edit = (any::<prop::sample::Index>(), 0_usize..12, piece);
    let base = prop_oneof![Just(PAPER), Just(AXIS)];
    (base, prop::collection::vec(edit, 1..4)).prop_map(|(base, edits)| {
        let mut text: Vec<char> = base.chars().collect();
        for (at, cut, piece) in edits {
            let at = at.index(text.len());
            let end = (at + cut).min(text.len());
            text.splice(at..end, piece.chars());
        }
        text.into_iter().collect()
    })
}

/// Numbers that pass for one key but not for the machine as a whole.
fn with_number(base: &str, line: usize, number: f64) -> String {
    let mut lines: Vec<String> = base.lines().map(str::to_owned).collect();
    let count = lines.len();
    let line = &mut lines[line % count];
    if let Some((key, _)) = line.clone().split_once(" = ") {
        *line = format!("{key} = {number:?}");
    }
    lines.join("\n")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn never_panics_on_mutated_files(text in mutated()) {
        if let Err(error) = MoveFile::parse(&text, "m.toml") {
            let MoveFileError::Invalid { place, problem } = &error else {
                return Err(TestCaseError::fail("not a place"));
            };
            prop_assert!(place.line <= text.lines().count() + 1);
            prop_assert!(!matches!(&**problem, Problem::Syntax(s) if s.is_empty()));
            prop_assert!(error.to_string().lines().count() >= 4);
        }
    }

    #[test]
    fn never_panics_on_any_text(text in any::<String>()) {
        let _ = MoveFile::parse(&text, &text);
    }

    #[test]
    fn never_panics_on_any_number(paper in any::<bool>(), line in 0_usize..60, number in any::<f64>()) {
        let _ = MoveFile::parse(&with_number(if paper { PAPER } else { AXIS }, line, number), "m");
    }
}

#[test]
fn an_uncertainty_is_a_share_of_a_parameter() {
    let paper = |table: &str| {
        let text = format!("{PAPER_MOVE}\n[machine.uncertainty]\n{table}\n");
        MoveFile::parse(&text, "paper.toml")
    };
    let file = paper("platform_mass_kg = 0.1").expect("a move");
    let known = file.uncertainty.expect("declared");
    assert_eq!(known.parameters, [("platform_mass_kg".to_owned(), 0.1)]);
    assert_eq!(known.residual, 50e-6);
    let file = paper("youngs_modulus_pa = 0.05\nresidual_strain = 20e-6").expect("a move");
    assert_eq!(file.uncertainty.expect("declared").residual, 20e-6);
    for (table, words) in [
        ("platform_mas_kg = 0.1", "did you mean `platform_mass_kg`?"),
        ("residual_displacement_rad = 0.1", "residual_strain"),
        ("platform_mass_kg = 0", "between 0 and 1"),
        ("platform_mass_kg = 1.5", "between 0 and 1"),
        ("platform_mass_kg = nan", "between 0 and 1"),
        ("platform_mass_kg = \"much\"", "expected a number"),
        ("platform_joint_mass_kg = 0.1", "changes nothing"),
        ("residual_strain = 0.0", "positive"),
    ] {
        let message = paper(table).expect_err(table).to_string();
        assert!(message.contains(words), "{table}: {message}");
        assert!(message.contains("paper.toml:"), "{message}");
    }
    // Without gauges nobody can guess what may be left.
    let axis = include_str!("../../moves/axis.toml").to_owned();
    let without = axis + "\n[machine.uncertainty]\nload_inertia_kg_m2 = 0.1\n";
    let message = MoveFile::parse(&without, "axis.toml")
        .expect_err("no figure")
        .to_string();
    assert!(message.contains("residual_displacement_rad"), "{message}");
}
