//! `stillpoint device …` as people use it, against the simulated board.

use serde_json::Value;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

fn stillpoint(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stillpoint"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the command runs")
}

fn device(arguments: &[&str]) -> Output {
    stillpoint(&[&["device"], arguments].concat())
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

/// What a command that must fail says.
fn refusal(arguments: &[&str]) -> String {
    let output = device(arguments);
    assert!(!output.status.success(), "{}", text(&output.stdout));
    assert_eq!(text(&output.stdout), "");
    text(&output.stderr)
}

fn move_file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("moves/{name}.toml"));
    path.display().to_string()
}

/// The elastic axis' move, planned once.
fn trajectory() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("device-cli");
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("axis.spt").display().to_string();
        let output = stillpoint(&["plan", &move_file("axis"), "--out", &path]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        path
    })
}

#[test]
fn hello_says_in_json_who_is_there() {
    let output = device(&["hello", "--port", "sim:", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let hello = object(&output);
    assert_eq!(hello["status"], "done");
    assert_eq!(hello["board"], "sim");
    assert_eq!(hello["state"], "Idle");
    assert_eq!(hello["tick_rate_hz"], 4000.0);
    assert_eq!(hello["loaded"], Value::Null);
    assert_eq!(hello["own_protocol"], hello["protocol"]);
}

#[test]
fn a_board_without_limits_says_that_it_has_none() {
    for order in ["hello", "status"] {
        let output = device(&[order, "--port", "sim:"]);
        let said = text(&output.stdout);
        assert!(said.contains("limits none yet"), "{said}");
        let output = device(&[order, "--port", "sim:", "--json"]);
        assert_eq!(object(&output)["limits_hash"], Value::Null, "{order}");
    }
}

#[test]
fn a_planned_move_runs_to_its_end() {
    let (file, path) = (move_file("axis"), trajectory());
    let output = device(&["run", path, "--move", &file, "--port", "sim:", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let run = object(&output);
    assert_eq!(run["state"], "Done");
    assert_eq!(run["path_s"], run["duration_s"]);
    assert_eq!(run["dry_run"], false);
    assert_eq!(run["upload"]["missing"], Value::Null);
    let end_rad = run["axes"][0]["measured_rad"].as_f64().expect("a number");
    let info = object(&stillpoint(&["info", path, "--json"]));
    assert_eq!(run["loaded"], info["content_hash"]);
    assert_eq!(run["duration_s"], info["duration_s"]);
    assert!((end_rad - 1.0).abs() < 1e-3, "{end_rad}");
}

#[test]
fn a_run_is_recorded_from_its_beginning_to_its_end() {
    let (file, path) = (move_file("axis"), trajectory());
    let csv = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("run.csv");
    let name = csv.display().to_string();
    let run = |more: &[&str]| {
        let usual = ["run", path, "--move", &file, "--port", "sim:", "--json"];
        device(&[&usual[..], more].concat())
    };
    let _ = std::fs::remove_file(&csv);
    let output = run(&["--csv", &name, "--rate", "1000"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let run_of = object(&output);
    let written = std::fs::read_to_string(&csv).expect("a record");
    let mut lines = written.lines();
    let heading: Vec<_> = lines.next().expect("a heading").split(',').collect();
    assert!(heading.contains(&"measured_position_1_rad"), "{heading:?}");
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert!(rows.iter().all(|row| row.len() == heading.len()));
    let column = |name: &str| {
        let place = heading.iter().position(|cell| *cell == name);
        let place = place.expect("a column");
        let cells = rows.iter().map(|row| row[place].parse::<f64>());
        cells
            .map(|cell| cell.expect("a number"))
            .collect::<Vec<_>>()
    };
    let (ticks, path_s) = (column("tick"), column("path_s"));
    assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]), "{ticks:?}");
    // From its first millisecond to its end, and each in between.
    let duration_s = run_of["duration_s"].as_f64().expect("a number");
    assert!(path_s[0] <= 1e-3, "{path_s:?}");
    assert_eq!(path_s.last(), Some(&duration_s));
    assert_eq!(rows[0][1], "Running");
    let during = path_s.iter().filter(|&&path_s| path_s < duration_s).count();
    assert!(during as f64 >= duration_s * 1e3 - 1.0, "{during}");
    assert_eq!(run_of["samples"]["rows"], rows.len());
    assert_eq!(run_of["samples"]["dropped"], 0);
    assert_eq!(run_of["samples"]["lost"], 0);
    let left = csv.with_extension("csv.part");
    assert!(!left.exists());

    // Nothing moves, nothing is left, and what stood there stays.
    let output = run(&["--csv", "/there-is-no-such-folder/run.csv"]);
    assert!(!output.status.success());
    assert!(text(&output.stderr).contains("cannot write /there-is-no-such-folder/run.csv"));
    assert!(!text(&output.stderr).contains("switching the drives on"));
    let output = run(&["--csv", &name, "--comms", "hold", "--timeout-ms", "0"]);
    assert!(!output.status.success());
    assert!(!left.exists());
    assert_eq!(std::fs::read_to_string(&csv).expect("the record"), written);

    let output = run(&["--csv", &name, "--channels", "measured_position"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = std::fs::read_to_string(&csv).expect("a record");
    let heading = "tick,state,path_s,path_speed,dropped,lost,measured_position_1_rad";
    assert_eq!(written.lines().next(), Some(heading));
}

/// The drives' fate after the command stands on stderr, whatever the form of the result.
#[test]
fn a_run_says_what_the_board_does_without_it() {
    let (file, path) = (move_file("axis"), trajectory());
    let run = |more: &[&str]| {
        let usual = ["run", path, "--move", &file, "--port", "sim:"];
        let output = device(&[&usual[..], more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let said = run(&[]);
    assert!(said.contains("then holds the move"), "{said}");
    assert!(said.contains("the drives stay on"), "{said}");
    let said = run(&["--comms", "quick-stop", "--timeout-ms", "700"]);
    assert!(
        said.contains("switches the drives off 700 ms after"),
        "{said}"
    );
    let said = run(&["--disarm"]);
    assert!(!said.contains("hold the end of the move"), "{said}");
}

#[test]
fn a_dry_run_moves_nothing() {
    let (file, path) = (move_file("axis"), trajectory());
    let output = device(&[
        "run",
        path,
        "--move",
        &file,
        "--port",
        "sim:",
        "--json",
        "--dry-run",
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let run = object(&output);
    assert_eq!(run["dry_run"], true);
    assert_eq!(run["axes"][0]["measured_rad"], 0.0);
}

#[test]
fn faults_on_the_line_are_overcome() {
    let (file, path) = (move_file("axis"), trajectory());
    for seed in 1..=5 {
        let faults =
            format!("drop=5%,duplicate=5%,reorder=5%,corrupt=5%,delay=5%,cut=5%,seed={seed}");
        let output = device(&[
            "run", path, "--move", &file, "--port", "sim:", "--json", "--comms", "continue",
            "--faults", &faults,
        ]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(object(&output)["state"], "Done");
        let said = text(&output.stderr);
        assert!(said.contains("faults on the line: of "), "{said}");
        assert!(!said.contains("of 0 frames"), "{said}");
    }
}

#[test]
fn refusals_come_in_the_boards_words_and_lead_to_their_entry() {
    let words = refusal(&["upload", trajectory(), "--port", "sim:"]);
    assert!(
        words.contains("does not know the machine's limits")
            && words.contains("device config --move MOVE.toml"),
        "{words}"
    );
    assert!(
        words.contains("docs/troubleshooting.md#Refusal.NotConfigured"),
        "{words}"
    );
    for (order, command) in [("start", "Start"), ("hold", "Hold"), ("resume", "Resume")] {
        let words = refusal(&[order, "--port", "sim:"]);
        let said = format!("{command} is not possible in state Idle, only in [");
        assert!(words.contains(&said), "{words}");
        assert!(words.contains("#Refusal.WrongState"), "{words}");
    }
    let words = refusal(&["override", "130", "--port", "sim:"]);
    assert!(words.contains("130 %"), "{words}");
    let words = refusal(&["load", "0123456789abcdef", "--port", "sim:"]);
    assert!(words.contains("0123456789abcdef is not stored"), "{words}");
    assert!(words.contains("#StoreError.NotStored"), "{words}");
    let words = refusal(&["load", "xyz", "--port", "sim:"]);
    assert!(words.contains("`xyz` is no hash"), "{words}");
}

#[test]
fn a_file_that_is_no_trajectory_leads_to_its_entry() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("no-trajectory.spt");
    let file = path.display().to_string();
    let whole = std::fs::read(trajectory()).expect("a trajectory");
    for (bytes, entry) in [
        (&whole[..100], "Truncated"),
        (&[], "Truncated"),
        (b"no trajectory at all", "Magic"),
    ] {
        std::fs::write(&path, bytes).expect("written");
        let see = format!("docs/troubleshooting.md#TrajectoryError.{entry}");
        for order in ["upload", "run", "start"] {
            let output = device(&[order, &file, "--port", "sim:", "--json"]);
            assert_eq!(object(&output)["see"], see, "{order}");
            let said = text(&output.stderr);
            assert!(said.ends_with(&format!("\n  see {see}\n")), "{said}");
        }
    }
}

#[test]
fn a_move_for_other_limits_is_rejected() {
    let text_of = std::fs::read_to_string(move_file("axis")).expect("a move file");
    let other = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("other-limits.toml");
    let changed = text_of.replace("torque_nm = 20.0", "torque_nm = 19.0");
    assert_ne!(changed, text_of);
    std::fs::write(&other, changed).expect("written");
    let other = other.display().to_string();
    let output = device(&[
        "run",
        trajectory(),
        "--move",
        &other,
        "--port",
        "sim:",
        "--json",
    ]);
    assert!(!output.status.success());
    let failure = object(&output);
    assert_eq!(failure["status"], "error");
    assert_eq!(
        failure["see"], "docs/troubleshooting.md#Rejection.LimitsHash",
        "{failure}"
    );
}

#[test]
fn limits_and_settings_are_sent_and_shown() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let file = move_file("paper");
    let settings = folder.join("settings.toml").display().to_string();
    std::fs::write(
        &settings,
        "ramp_s = 0.05\n[monitor]\nfeedback_age_ticks = 9\n",
    )
    .expect("written");
    let output = device(&[
        "config",
        "--move",
        &file,
        "--settings",
        &settings,
        "--port",
        "sim:",
        "--json",
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let config = object(&output);
    assert_eq!(config["limits"].as_array().map(Vec::len), Some(3));
    assert_eq!(config["limits"][2]["torque_rate_nm_per_s"], 20_000.0);
    assert_eq!(config["settings"]["monitor"]["feedback_age_ticks"], 9);
    assert_eq!(config["settings"]["period_ticks"], 2500);

    std::fs::write(&settings, "ramp = 0.05\n").expect("written");
    let words = refusal(&["config", "--settings", &settings, "--port", "sim:"]);
    assert!(
        words.contains("no setting `ramp`") && words.contains("ramp_s"),
        "{words}"
    );

    std::fs::write(&settings, "ramp_s = 5.0\n").expect("written");
    let words = refusal(&[
        "config",
        "--move",
        &file,
        "--settings",
        &settings,
        "--port",
        "sim:",
    ]);
    assert!(
        words.contains("ramp_s is 5: give a number from 0.001 to 1\n"),
        "{words}"
    );
}

/// The example of the docs is one that a board takes.
#[test]
fn drives_are_sent_as_in_the_docs_and_shown_in_the_same_form() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/board.md");
    let page = std::fs::read_to_string(page).expect("the docs");
    let (_, example) = page.split_once("```toml\n").expect("an example");
    let (example, _) = example.split_once("```").expect("its end");
    let drives = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("drives.toml");
    std::fs::write(&drives, example).expect("written");
    let path = drives.display().to_string();
    let output = device(&["config", "--drives", &path, "--port", "sim:"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let shown = text(&output.stdout);
    let parsed = |text: &str| text.parse::<toml::Table>().expect("TOML");
    assert_eq!(parsed(&shown), parsed(example));

    std::fs::write(&drives, example.replace("node = 3", "node = 2")).expect("written");
    let words = refusal(&["config", "--drives", &path, "--port", "sim:"]);
    assert!(words.contains("node id 2"), "{words}");
    assert!(
        words.contains("docs/troubleshooting.md#DriveConfigError.NodeTwice"),
        "{words}"
    );

    // One more key, in line 3, and one that is missing.
    let (head, rest) = example.split_once("\n").expect("lines");
    for (changed, wrong) in [
        (format!("{head}\nperiod_ms = 2\n{rest}"), "`period_ms`"),
        (example.replace("node = 2", "nodes = 2"), "`nodes`"),
        (format!("controller = 1\n{example}"), "`controller`"),
        (example.replace("home_counts = 0", ""), "`home_counts`"),
    ] {
        std::fs::write(&drives, &changed).expect("written");
        let words = refusal(&["config", "--drives", &path, "--port", "sim:"]);
        let line = changed
            .lines()
            .position(|line| line.contains(&wrong[1..wrong.len() - 1]));
        let place = line.map_or(String::new(), |line| format!("at line {}", line + 1));
        assert!(
            words.contains(&path)
                && words.contains(wrong)
                && words.contains(&place)
                && words.contains("docs/troubleshooting.md#drive-configuration"),
            "{words}"
        );
    }

    // A new board has none, and says where to find one.
    let output = device(&["config", "--port", "sim:"]);
    assert!(text(&output.stdout).contains("docs/board.md#drive-configuration"));
}

#[test]
fn ports_that_are_absent_busy_or_unknown_say_so() {
    let words = refusal(&["status"]);
    assert!(words.contains("give --port"), "{words}");
    let words = refusal(&["status", "--port", "/dev/there-is-no-such-port"]);
    assert!(
        words.contains("there is no port /dev/there-is-no-such-port")
            && words.contains("docs/troubleshooting.md#there-is-no-such-port"),
        "{words}"
    );
    let words = refusal(&["status", "--port", "udp:x:1"]);
    assert!(words.contains("tcp:host:port"), "{words}");
    // A port of this computer that was just free.
    let address = TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .expect("an address");
    let output = device(&["status", "--json", "--port", &format!("tcp:{address}")]);
    assert!(!output.status.success());
    let message = object(&output)["message"].to_string();
    assert!(message.contains("nobody answers at 127.0.0.1"), "{message}");
    assert_eq!(
        object(&output)["see"],
        "docs/troubleshooting.md#nobody-answers-at-the-address"
    );
}

#[test]
fn a_silent_port_says_so() {
    // Somebody listens, and never answers.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let output = device(&["hello", "--json", "--port", &format!("tcp:{address}")]);
    assert!(!output.status.success());
    let failure = object(&output);
    let message = failure["message"].to_string();
    assert!(
        message.contains("the board does not answer (5 greetings"),
        "{message}"
    );
    assert_eq!(
        failure["see"],
        "docs/troubleshooting.md#nothing-answers-on-the-port"
    );
}

#[test]
fn the_monitor_writes_what_comes() {
    let arguments = [
        "monitor",
        "--port",
        "sim:",
        "--seconds",
        "1",
        "--rate",
        "50",
    ];
    let output = device(&[&arguments[..], &["--csv"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let csv = text(&output.stdout);
    let columns = |line: &str| line.split(',').count();
    let heading = csv.lines().next().expect("a heading");
    assert!(heading.starts_with("tick,state,path_s,"), "{heading}");
    assert!(heading.contains(",measured_position_2_rad"), "{heading}");
    assert!(
        csv.lines().all(|line| columns(line) == columns(heading)),
        "{csv}"
    );
    let samples = csv.lines().count() - 1;
    assert!((45..=51).contains(&samples), "{samples}");

    let output = device(&[&arguments[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let lines = text(&output.stdout);
    let ticks: Vec<u64> = (lines.lines())
        .map(|line| serde_json::from_str::<Value>(line).expect("an object"))
        .map(|sample| sample["tick"].as_u64().expect("a number"))
        .collect();
    assert!(
        ticks.windows(2).all(|pair| pair[1] == pair[0] + 80),
        "{ticks:?}"
    );
}

#[test]
fn the_monitor_shows_the_channels_that_were_chosen() {
    let monitor = |more: &[&str]| {
        let usual = ["monitor", "--port", "sim:", "--seconds", "0.2"];
        device(&[&usual[..], more].concat())
    };
    let output = monitor(&["--csv", "--channels", "measured_position,limited"]);
    let csv = text(&output.stdout);
    let heading = "tick,state,path_s,path_speed,dropped,lost,measured_position_1_rad,measured_position_2_rad,\
                   measured_position_3_rad,limited_1,limited_2,limited_3";
    assert_eq!(csv.lines().next(), Some(heading));
    assert!(
        csv.lines().all(|line| line.split(',').count() == 12),
        "{csv}"
    );

    let output = monitor(&["--json", "--channels", "setpoint_torque"]);
    let lines = text(&output.stdout);
    let sample: Value = serde_json::from_str(lines.lines().next().expect("a line")).expect("JSON");
    assert_eq!(
        sample["setpoint_torque_nm"].as_array().map(Vec::len),
        Some(3)
    );
    assert_eq!(sample.get("measured_position_rad"), None);
    assert_eq!(sample.get("limited"), None);

    let words = text(&monitor(&["--channels", "torque"]).stderr);
    assert!(
        words.contains("'torque'") && words.contains("setpoint_torque, measured_position"),
        "{words}"
    );
    let words = text(&monitor(&["--rate", "0"]).stderr);
    assert!(words.contains("a positive number of samples"), "{words}");
}

#[test]
fn questions_are_answered_and_ports_are_listed() {
    for order in ["ports", "status", "fault", "list", "stop", "config"] {
        let output = device(&[order, "--port", "sim:", "--json"]);
        assert!(output.status.success(), "{order}: {}", text(&output.stderr));
        assert_eq!(object(&output)["status"], "done", "{order}");
        let output = device(&[order, "--port", "sim:"]);
        assert!(output.status.success(), "{order}: {}", text(&output.stderr));
        assert!(!output.stdout.is_empty(), "{order}");
    }
}
