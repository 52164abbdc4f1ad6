//! The command as people use it, mistakes included.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder");
    path
}

fn stillpoint(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stillpoint"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the command runs")
}

fn move_file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("moves/{name}.toml"));
    std::fs::read_to_string(path).expect("a move file")
}

/// Writes a changed copy of a move file and returns its name.
fn changed(folder: &Path, name: &str, changes: &[(&str, &str)]) -> &'static str {
    let mut text = move_file(name);
    for (from, to) in changes {
        assert!(text.contains(from), "{from} is not in {name}.toml");
        text = text.replace(from, to);
    }
    std::fs::write(folder.join("move.toml"), text).expect("written");
    "move.toml"
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The one JSON object on stdout.
fn object(output: &Output) -> Value {
    let value: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(value.is_object());
    value
}

#[test]
fn plan_says_in_json_all_that_it_knows() {
    let folder = folder("plan-json");
    let file = changed(&folder, "paper", &[]);
    let output = stillpoint(&folder, &["plan", file, "--out", "m.spt", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let plan = object(&output);
    assert_eq!(plan["status"], "solved");
    let duration = plan["duration_s"].as_f64().expect("a number");
    // MODEL's answer at the nodes only is 50.692 ms, with 30 samples in each interval 50.823 ms.
    assert!(
        (50.80e-3..50.692e-3 * 1.005).contains(&duration),
        "{duration}"
    );
    assert!(
        plan["solver"]
            .as_str()
            .is_some_and(|s| s.starts_with("pounce"))
    );
    for key in ["iterations", "variables", "constraints"] {
        assert!(plan[key].as_u64().is_some_and(|n| n > 0), "{key}");
    }
    for key in ["setup", "solve", "check", "total"] {
        assert!(
            plan["seconds"][key].as_f64().is_some_and(|s| s >= 0.0),
            "{key}"
        );
    }
    // The four figures, and the artefact played.
    let number = |value: &Value| value.as_f64().expect("a number");
    assert!(number(&plan["largest_violation"]) <= 0.0);
    assert_eq!(plan["finer_mesh"]["points"], 72);
    let change = number(&plan["finer_mesh"]["relative_change"]);
    assert!((-3e-3..0.0).contains(&change), "{change}");
    let hamiltonian = &plan["hamiltonian"];
    assert!(
        (number(&hamiltonian["mean"]) + 1.0).abs() < 1e-4,
        "{hamiltonian}"
    );
    assert!(
        number(&hamiltonian["rms_deviation"]) < 0.05,
        "{hamiltonian}"
    );
    assert_eq!(plan["played"]["limited_ticks"], 0);
    assert!(number(&plan["played"]["miss"]) < 1e-5, "{}", plan["played"]);
    assert!(
        number(&plan["played"]["residual"]) < 2e-6,
        "{}",
        plan["played"]
    );
    assert!(plan["end_miss"].as_f64().is_some_and(|miss| miss < 1e-6));
    let info = object(&stillpoint(&folder, &["info", "m.spt", "--json"]));
    // What the board is sent; the certificate stays with the host.
    assert!(
        info["bytes"].as_u64().is_some_and(|bytes| bytes <= 2600),
        "{info}"
    );
    assert_eq!(info["certificate"]["status"], "present");
}

/// What a user would plan instead is a trajectory like any other.
#[test]
fn a_shaped_move_is_planned_verified_and_run() {
    let folder = folder("plan-with");
    let file = changed(&folder, "axis", &[]);
    let with = |name: &str| stillpoint(&folder, &["plan", file, "--with", name, "--json"]);
    let output = with("s-curve+zvd");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let plan = object(&output);
    assert_eq!(plan["status"], "solved");
    assert_eq!(plan["with"], "s-curve+zvd");
    assert_eq!(plan["binding_limit"]["limit"], "twist_rad");
    assert_eq!(plan["certificate"]["status"], "certified");
    assert_eq!(plan["played"]["limited_ticks"], 0);
    for arguments in [
        &["verify", "move.spt", "--move", file][..],
        &[
            "device", "run", "move.spt", "--move", file, "--port", "sim:",
        ],
    ] {
        let output = stillpoint(&folder, arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }

    let unknown = object(&with("sextic"));
    let message = unknown["message"].as_str().expect("a message");
    assert!(
        message.contains("sextic") && message.contains("quintic+ei2"),
        "{message}"
    );
    let two = object(&with("quintic+zv2"));
    let message = two["message"].as_str().expect("a message");
    assert!(
        message.contains("2 modes") && message.contains("has 1"),
        "{message}"
    );
    let solver = stillpoint(
        &folder,
        &["plan", file, "--with", "quintic", "--solver", "pounce"],
    );
    assert!(text(&solver.stderr).contains("--solver"));
}

/// A plan that is not still enough within what its file holds possible is planned with a warning that names the cure.
#[test]
fn a_move_is_swept_and_doubted() {
    let folder = folder("sweep");
    let file = changed(
        &folder,
        "axis",
        &[(
            "[limits]",
            "[machine.uncertainty]\nload_inertia_kg_m2 = 0.05\nresidual_displacement_rad = 1e-3\n\n[limits]",
        )],
    );
    let output = stillpoint(&folder, &["plan", file, "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let warned = text(&output.stderr);
    assert!(
        warned.contains("load_inertia_kg_m2") && warned.contains("[robust]"),
        "{warned}"
    );
    let lost = &object(&output)["stillness_lost"][0];
    assert_eq!(lost["parameter"], "load_inertia_kg_m2");
    assert!(
        lost["residual"].as_f64().is_some_and(|left| left > 1e-3),
        "{lost}"
    );

    let sweep = |range: &str, more: &[&str]| {
        let arguments = ["simulate", "move.spt", "--move", file, "--sweep", range];
        stillpoint(&folder, &[&arguments[..], more].concat())
    };
    let output = sweep("load_inertia_kg_m2=0.95..1.05:3", &["--json"]);
    let swept = object(&output);
    assert_eq!(swept["machines"].as_array().map(Vec::len), Some(3));
    let left = |k: usize| swept["machines"][k]["residual"].as_f64().expect("a number");
    assert!(
        left(1) < 0.1 * left(0) && left(1) < 0.1 * left(2),
        "{swept}"
    );
    assert_eq!(swept["sensitivities"].as_array().map(Vec::len), Some(4));
    let table = text(&sweep("load_inertia_kg_m2=0.95..1.05:3", &[]).stdout);
    assert!(
        table.contains("twist_rad, %") && table.contains("joint_friction"),
        "{table}"
    );
    for (range, words) in [
        ("payload=0.9..1.1:3", "load_inertia_kg_m2"),
        ("x", "0.8..1.2:9"),
    ] {
        let output = sweep(range, &["--json"]);
        assert!(!output.status.success());
        let message = object(&output)["message"].as_str().map(str::to_owned);
        assert!(message.is_some_and(|m| m.contains(words)), "{range}");
    }
}

#[test]
fn planners_are_compared() {
    let folder = folder("compare");
    let file = changed(&folder, "axis", &[]);
    let arguments = [
        "compare",
        file,
        "--json",
        "--out",
        "c.html",
        "--figures",
        "figures",
    ];
    let output = stillpoint(&folder, &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let comparison = object(&output);
    let planners = comparison["planners"].as_array().expect("planners");
    assert!(
        planners.iter().all(|p| p["status"] == "planned"),
        "{comparison}"
    );
    assert_eq!(planners[0]["name"], "stillpoint, nominal");
    let page = std::fs::read_to_string(folder.join("c.html")).expect("a page");
    assert!(page.contains("stillpoint, robust") && page.contains("<svg"));
    let picture = std::fs::read_to_string(folder.join("figures/comparison.svg"));
    assert!(picture.is_ok_and(|svg| svg.contains("quintic+zvd")));
}

#[test]
fn a_planned_move_is_simulated_reported_shown_and_exported() {
    let folder = folder("all-commands");
    let file = changed(&folder, "axis", &[]);
    let run = |arguments: &[&str]| {
        let output = stillpoint(&folder, arguments);
        assert!(
            output.status.success(),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
        text(&output.stdout)
    };
    assert!(run(&["plan", file]).contains("written to move.spt"));
    let simulation: Value =
        serde_json::from_str(&run(&["simulate", "move.spt", "--move", file, "--json"]))
            .expect("JSON");
    let twist = &simulation["metrics"]["elastic_displacement"][0];
    assert_eq!(twist["key"], "twist_rad");
    assert!(
        twist["residual"].as_f64().expect("left") < 0.05 * twist["peak"].as_f64().expect("peak")
    );
    assert!(run(&["simulate", "move.spt", "--move", file]).contains("twist"));
    run(&[
        "report",
        "move.spt",
        "--move",
        file,
        "--out",
        "r.html",
        "--figures",
        "figures",
    ]);
    let html = std::fs::read_to_string(folder.join("r.html")).expect("the report");
    assert!(
        html.contains("<svg")
            && html.contains("twist")
            && !html.contains("href=\"http")
            && !html.contains("src=")
    );
    // The figures that say how good the plan is come with the file.
    for figure in ["misses its end", "finer mesh", "Hamiltonian", "limiter"] {
        assert!(html.contains(figure), "{figure}");
    }
    assert!(folder.join("figures/torque.svg").exists());
    let info: Value = serde_json::from_str(&run(&["info", "move.spt", "--json"])).expect("JSON");
    assert_eq!(info["axes"], 1);
    assert_eq!(info["intervals"].as_array().map(Vec::len), Some(10));
    assert!(run(&["info", "move.spt"]).contains("1 axes"));
    let csv = run(&["export", "move.spt", "--csv", "--rate", "1000"]);
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("time_s,position_rad_1,velocity_rad_per_s_1,torque_nm_1")
    );
    let last: Vec<f64> = lines
        .last()
        .expect("lines")
        .split(',')
        .map(|n| n.parse().expect("a number"))
        .collect();
    let duration = info["duration_s"].as_f64().expect("a duration");
    assert!(
        (last[0] - duration).abs() < 1e-7 && (last[1] - 1.0).abs() < 1e-6 && last[2].abs() < 1e-6
    );
}

/// Changes of the move file, and words that the message must contain.
type Mistake<'a> = (&'a [(&'a str, &'a str)], &'a [&'a str]);

/// Errors: a sentence on stderr that says where, nothing on stdout, no file, a failing exit code, and no panic.
#[test]
fn mistakes_get_a_sentence() {
    let folder = folder("mistakes");
    let cases: [Mistake; 9] = [
        (
            &[("link_length_m", "link_lenght_m")],
            &["link_lenght_m", "link_length_m", "move.toml:5"],
        ),
        (
            &[("link_length_m = 0.125", "link_length_m = 0.0")],
            &["link_length_m", "positive"],
        ),
        (
            &[("platform_mass_kg = 2.55", "platform_mass_kg = -1.0")],
            &["platform_mass_kg"],
        ),
        (
            &[("kind = \"3rrr-flexible\"", "kind = \"delta\"")],
            &["delta", "two-mass-axis"],
        ),
        (&[("x_m = 0.2175", "x_m = 0.9")], &["chain", "to"]),
        (&[("[mesh]", "[mesh")], &["move.toml"]),
        (&[("torque_nm = 150.0", "torque_nm = nan")], &["torque_nm"]),
        (&[("x_m = 0.2175", "x_m = 0.1875")], &["from", "to"]),
        (&[("points = 10", "points = 1")], &["points"]),
    ];
    for (changes, expected) in cases {
        let file = changed(&folder, "paper", changes);
        let output = stillpoint(&folder, &["plan", file]);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{changes:?}: {message}");
        assert!(
            output.stdout.is_empty() && !message.contains("panicked"),
            "{changes:?}: {message}"
        );
        for word in expected {
            assert!(
                message.contains(word),
                "{changes:?}: {word} is not in: {message}"
            );
        }
        let failed = object(&stillpoint(&folder, &["plan", file, "--json"]));
        assert_eq!(failed["status"], "error");
    }
    assert!(!folder.join("move.spt").exists());
    let output = stillpoint(&folder, &["plan", "absent.toml"]);
    assert!(text(&output.stderr).contains("absent.toml"));
}

#[test]
fn an_impossible_move_is_diagnosed() {
    let folder = folder("impossible");
    // 75 mm of elastic displacement would be needed to move at all within one micrometre.
    let changes = [
        ("y = 0.2e-3", "y = 1e-12"),
        ("max_iterations = 2000", "max_iterations = 60"),
    ];
    let file = changed(&folder, "paper", &changes);
    let output = stillpoint(&folder, &["plan", file, "--json"]);
    assert!(!output.status.success());
    let failed = object(&output);
    assert_ne!(failed["status"], "solved");
    let message = failed["message"].as_str().expect("a message");
    assert!(
        message.contains("ms") && message.contains("iterations"),
        "{message}"
    );
    // A limit is named in any case: those that are reached, or the one that is nearest.
    let reached = failed["saturated"].as_array().expect("a list");
    assert!(
        !reached.is_empty() || failed["nearest_limit"]["limit"].is_string(),
        "{failed}"
    );
}

/// Each names the limit that asks for more time than any plan may take.
#[test]
fn moves_that_take_too_long_name_what_they_wait_for() {
    let folder = folder("too-long");
    for (from, to, limit) in [
        ("torque_nm = 20.0", "torque_nm = 1e-9", "torque_nm"),
        (
            "motor_speed_rpm = 6000.0",
            "motor_speed_rpm = 1e-3",
            "motor_speed_rpm",
        ),
    ] {
        let file = changed(&folder, "axis", &[(from, to)]);
        let output = stillpoint(&folder, &["plan", file]);
        assert!(!output.status.success());
        let message = text(&output.stderr);
        assert!(
            message.contains(&format!("within `{limit}`")) && message.contains("1000 s"),
            "{message}"
        );
    }
}

#[test]
fn a_hopeless_limit_is_named() {
    let folder = folder("hopeless");
    let changes = [("twist_rad = 0.05", "twist_rad = 1e-9")];
    let file = changed(&folder, "axis", &changes);
    let output = stillpoint(&folder, &["plan", file, "--json"]);
    assert!(!output.status.success());
    let failed = object(&output);
    let message = failed["message"].as_str().expect("a message");
    assert!(
        message.contains("at its limit") || message.contains("nearest"),
        "{message}"
    );
}

#[test]
fn damaged_and_foreign_trajectories_are_refused() {
    let folder = folder("damaged");
    let file = changed(&folder, "axis", &[]);
    assert!(stillpoint(&folder, &["plan", file]).status.success());
    let good = std::fs::read(folder.join("move.spt")).expect("the trajectory");
    let mut flipped = good.clone();
    // In the trajectory, which comes first.
    flipped[good.len() / 4] ^= 0x10;
    let foreign = b"PK\x03\x04 a zip file".to_vec();
    let cases = [
        ("flipped", flipped),
        ("cut", good[..100].to_vec()),
        ("empty", vec![]),
        ("foreign", foreign),
    ];
    for (name, bytes) in cases {
        std::fs::write(folder.join("bad.spt"), bytes).expect("written");
        for arguments in [
            vec!["info", "bad.spt"],
            vec!["export", "bad.spt", "--csv", "--rate", "100"],
            vec!["simulate", "bad.spt", "--move", file],
        ] {
            let output = stillpoint(&folder, &arguments);
            let message = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{name}");
            assert!(
                message.contains("bad.spt") && !message.contains("panicked"),
                "{name}: {message}"
            );
        }
    }
    // A sound trajectory of another machine.
    let other = changed(&folder, "paper", &[]);
    let output = stillpoint(&folder, &["simulate", "move.spt", "--move", other]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("axes"));
}

#[test]
fn the_demo_writes_its_folder() {
    let folder = folder("demo");
    let output = stillpoint(&folder, &["demo"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("planning"));
    let summary =
        std::fs::read_to_string(folder.join("stillpoint-demo/summary.json")).expect("the summary");
    let rows: Value = serde_json::from_str(&summary).expect("JSON");
    let row = |name: &str| {
        let rows = rows.as_array().expect("rows");
        rows.iter()
            .find(|row| row["name"] == name)
            .unwrap_or_else(|| panic!("no row {name}"))
    };
    let number = |name: &str, key: &str| {
        row(name)[key]
            .as_f64()
            .unwrap_or_else(|| panic!("{name} {key}"))
    };
    assert!((50.8e-3..50.692e-3 * 1.005).contains(&number("stillpoint", "duration_s")));
    // The paper's own figure, played through the trajectory and the executor with the default drives.
    assert!(number("stillpoint", "residual_strain") < 20e-6);
    assert!(number("quintic, equal duration", "residual_strain") > 100e-6);
    for (name, milliseconds) in [
        ("shortest quintic", 99.5),
        ("shortest quintic with ZV", 77.3),
        ("shortest quintic with ZV on two modes", 83.5),
        ("shortest quintic with ZVD", 83.3),
    ] {
        assert!(
            (number(name, "duration_s") * 1e3 / milliseconds - 1.0).abs() < 0.015,
            "{name}"
        );
    }
    let html =
        std::fs::read_to_string(folder.join("stillpoint-demo/report.html")).expect("the report");
    for figure in ["4a", "4b", "4c", "4d", "4e", "4f", "Fig. 6"] {
        assert!(html.contains(figure), "{figure}");
    }
    assert!(html.contains("assumed"));
}

/// Every command with `--json` says one object, also when it fails and when the words are wrong.
#[test]
fn failures_are_json_too() {
    let folder = folder("failures");
    let file = changed(&folder, "axis", &[]);
    for arguments in [
        vec!["simulate", "absent.spt", "--move", file, "--json"],
        vec!["info", "absent.spt", "--json"],
        vec!["info", file, "--json"],
        vec!["plan", file, "--solver", "snopt", "--json"],
        vec!["plan", file, "--out", "absent/m.spt", "--json"],
    ] {
        let output = stillpoint(&folder, &arguments);
        assert!(!output.status.success(), "{arguments:?}");
        let failed = object(&output);
        assert_eq!(failed["status"], "error", "{arguments:?}");
        assert!(
            failed["message"].as_str().is_some_and(|m| !m.is_empty()),
            "{arguments:?}"
        );
    }
}

/// Joint angles of an axis count turns; a coarse mesh turns by more than half a turn between two points.
#[test]
fn many_turns_end_where_they_should() {
    let folder = folder("turns");
    for (angle, mesh) in [
        ("12.566", "intervals = 4"),
        ("1000.0", "intervals = 10"),
        ("-200.0", "intervals = 10"),
    ] {
        let to = format!("to = {{ angle_rad = {angle} }}");
        let file = changed(
            &folder,
            "axis",
            &[
                ("to = { angle_rad = 1.0 }", to.as_str()),
                ("intervals = 10", mesh),
                ("twist_rad = 0.05\n", ""),
            ],
        );
        let output = stillpoint(&folder, &["plan", file]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let csv =
            text(&stillpoint(&folder, &["export", "move.spt", "--csv", "--rate", "10"]).stdout);
        let last: f64 = csv
            .lines()
            .last()
            .and_then(|line| line.split(',').nth(1)?.parse().ok())
            .expect("a position");
        let wanted: f64 = angle.parse().expect("a number");
        assert!(
            (last / wanted - 1.0).abs() < 1e-6,
            "{last} instead of {wanted}"
        );
    }
}

/// A tiny move is planned, not declared done: its duration follows from the rate limit, Δ = J T³/32 for a rigid machine.
#[test]
fn tiny_moves_move() {
    let folder = folder("tiny");
    let file = changed(
        &folder,
        "axis",
        &[("to = { angle_rad = 1.0 }", "to = { angle_rad = 1e-6 }")],
    );
    let plan = object(&stillpoint(&folder, &["plan", file, "--json"]));
    assert_eq!(plan["status"], "solved", "{plan}");
    let rigid_s = (32.0 * 1e-6 * 0.05 / 2000.0_f64).cbrt();
    assert!(
        plan["duration_s"].as_f64().expect("a duration") > 0.9 * rigid_s,
        "{plan}"
    );
    assert!(
        plan["end_miss_relative"].as_f64().expect("a share") < 0.05,
        "{plan}"
    );
}

#[test]
fn the_iteration_limit_is_kept() {
    let folder = folder("limit");
    let changes = [
        ("intervals = 6", "intervals = 1"),
        ("points = 10", "points = 2"),
        ("= 2000", "= 40"),
    ];
    let file = changed(&folder, "paper", &changes);
    let output = stillpoint(&folder, &["plan", file, "--json", "--log"]);
    let logged = text(&output.stderr);
    let logged: Vec<u64> = logged
        .lines()
        .filter_map(|line| line.split_whitespace().next()?.parse().ok())
        .collect();
    let failed = object(&output);
    assert_eq!(failed["iterations"], 40, "{failed}");
    // Every round logs where it starts, then every iteration once.
    let rounds = failed["rounds"].as_u64().expect("a number");
    assert_eq!(logged.len() as u64, 40 + rounds, "{logged:?}");
    assert_eq!(logged.last(), Some(&40));
    assert!(logged.is_sorted(), "{logged:?}");
}

#[cfg(unix)]
#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let folder = folder("pipe");
    let file = changed(&folder, "axis", &[]);
    assert!(stillpoint(&folder, &["plan", file]).status.success());
    let command = format!(
        "{} export move.spt --csv --rate 1e6 | head -1",
        env!("CARGO_BIN_EXE_stillpoint")
    );
    let output = Command::new("sh")
        .args(["-c", &command])
        .current_dir(&folder)
        .output()
        .expect("a shell");
    assert!(
        text(&output.stdout).starts_with("time_s") && output.stderr.is_empty(),
        "{}",
        text(&output.stderr)
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_solve_and_says_how_far_it_came() {
    use std::io::{BufRead, BufReader};
    let folder = folder("ctrl-c");
    let file = changed(
        &folder,
        "paper",
        &[
            ("intervals = 6", "intervals = 60"),
            ("tolerance = 1e-6", "tolerance = 1e-10"),
        ],
    );
    let mut child = Command::new(env!("CARGO_BIN_EXE_stillpoint"))
        .args(["plan", file, "--json", "--log"])
        .current_dir(&folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command runs");
    let mut log = BufReader::new(child.stderr.take().expect("stderr")).lines();
    // The heading, then the first iteration.
    let _ = (log.next(), log.next());
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
    let rest: Vec<String> = log.map_while(Result::ok).collect();
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1));
    let stopped = object(&output);
    assert_eq!(stopped["status"], "stopped");
    assert!(
        rest.iter()
            .any(|line| line.contains("stopped on request after")),
        "{rest:?}"
    );
    assert!(!folder.join("move.spt").exists());
}

#[test]
fn bench_solves_a_problem_and_knows_the_others() {
    let folder = folder("bench");
    let output = stillpoint(&folder, &["bench", "brachistochrone", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let result = object(&output);
    assert_eq!(result["status"], "solved");
    let row = &result["benchmarks"][0];
    assert_eq!(row["name"], "brachistochrone");
    assert!(row["error"].as_f64().is_some_and(|error| error < 1e-9));
    assert_eq!(row["meshes"][0]["points"], 40);

    let output = stillpoint(&folder, &["bench", "triple-integrator", "--mesh", "8x3"]);
    let table = text(&output.stdout);
    let points = table
        .lines()
        .nth(1)
        .and_then(|line| line.split_whitespace().nth(5));
    assert_eq!(points, Some("24"), "{table}");

    for (arguments, word) in [
        (["bench", "robot-leg"].as_slice(), "robot-arm"),
        (&["bench", "--mesh", "50"], "50x4"),
        (&["bench", "--tolerance", "0"], "1e-9"),
    ] {
        let output = stillpoint(&folder, arguments);
        assert!(!output.status.success());
        assert!(
            text(&output.stderr).contains(word),
            "{}",
            text(&output.stderr)
        );
    }
}
