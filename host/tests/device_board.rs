//! `stillpoint device …` against a board that outlives the command: a simulated one that is served over TCP in real time.

use serde_json::Value;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};
use stillpoint::device::{Simulated, Transport};
use stillpoint_firmware::State;

/// What happens to the board or to its line.
#[derive(Clone, Copy)]
enum Event {
    /// It loses its power and gets it back.
    Restart,
    /// Somebody holds the move.
    Hold,
    /// The connection ends; another one may come.
    HangUp,
    /// The connection ends, and nobody listens any more.
    Leave,
    /// It is no longer heard.
    Mute,
}

/// A board of one axis that stands at so many rad.
struct Board {
    address: SocketAddr,
    events: Sender<Event>,
    /// Its state, seen without another session, which would end the one that is open.
    state: Arc<Mutex<State>>,
}

impl Board {
    fn at(position_rad: f32) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let (events, happens) = channel();
        let state = Arc::new(Mutex::new(State::Idle));
        let seen = Arc::clone(&state);
        thread::spawn(move || serve(&listener, position_rad, &happens, &seen));
        Self {
            address,
            events,
            state,
        }
    }

    fn port(&self) -> String {
        format!("tcp:{}", self.address)
    }

    fn arguments(&self, arguments: &[&str]) -> Vec<String> {
        let port = self.port();
        let words = [&["device"], arguments, &["--json", "--port", &port]].concat();
        words.into_iter().map(str::to_owned).collect()
    }

    /// Runs a command to its end.
    fn tell(&self, arguments: &[&str]) -> Output {
        command(&self.arguments(arguments))
            .output()
            .expect("it runs")
    }

    /// Runs a command that must succeed.
    fn ask(&self, arguments: &[&str]) -> Value {
        let output = self.tell(arguments);
        assert!(output.status.success(), "{output:?}");
        object(&output)
    }

    /// Runs a command that must fail, and gives what it says.
    fn refusal(&self, arguments: &[&str]) -> Value {
        failure(&self.tell(arguments))
    }

    fn state(&self) -> State {
        *self.state.lock().expect("nobody panics")
    }

    fn until(&self, state: State) {
        while self.state() != state {
            thread::sleep(Duration::from_millis(5));
        }
        a_moment();
    }

    fn begin(&self, arguments: &[&str]) -> Child {
        let mut command = command(&self.arguments(arguments));
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().expect("it starts")
    }

    /// Sends limits and loads the move.
    fn loaded(self) -> Self {
        self.ask(&["config", "--move", &move_file()]);
        self.ask(&["upload", trajectory()]);
        self
    }
}

/// Carries bytes between a simulated board and whoever connects, at the pace of real time.
fn serve(
    listener: &TcpListener,
    position_rad: f32,
    happens: &Receiver<Event>,
    seen: &Mutex<State>,
) {
    let mut board = Simulated::<1>::new(None, [position_rad]).expect("a board");
    listener.set_nonblocking(true).expect("no waiting");
    let began = Instant::now();
    let mut stream = None;
    let mut buffer = [0; 4096];
    loop {
        match happens.try_recv() {
            Ok(Event::Restart) => board.restart().expect("the same limits"),
            Ok(Event::Hold) => board.machine.executor.hold().expect("it runs"),
            Ok(Event::HangUp) => stream = None,
            Ok(Event::Leave) => return,
            Ok(Event::Mute) => board.mute(true),
            Err(_) => {}
        }
        if let Ok((next, _)) = listener.accept() {
            next.set_nonblocking(true).expect("no waiting");
            next.set_nodelay(true).expect("no waiting");
            stream = Some(next);
        }
        if let Some(line) = &mut stream {
            match line.read(&mut buffer) {
                Ok(0) => stream = None,
                Ok(count) => board
                    .send(&buffer[..count])
                    .expect("a board in this process"),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => stream = None,
            }
        }
        while board.now() < began.elapsed() {
            let ahead = began.elapsed() - board.now();
            let count = board
                .receive(&mut buffer, ahead)
                .expect("a board in this process");
            if let Some(line) = &mut stream
                && line.write_all(&buffer[..count]).is_err()
            {
                stream = None;
            }
        }
        *seen.lock().expect("nobody panics") = board.machine.executor.state();
        thread::sleep(Duration::from_millis(1));
    }
}

fn command(arguments: &[impl AsRef<std::ffi::OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stillpoint"));
    command.args(arguments).stdin(Stdio::null());
    command
}

fn object(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn failure(output: &Output) -> Value {
    assert!(!output.status.success(), "{output:?}");
    let failure = object(output);
    assert_eq!(failure["status"], "error");
    failure
}

fn says(failure: &Value, words: &[&str]) {
    let message = failure["message"].as_str().expect("words");
    for words in words {
        assert!(message.contains(words), "no `{words}` in: {message}");
    }
    assert!(!message.contains("\n  see "), "{message}");
}

fn move_file() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("moves/axis.toml");
    path.display().to_string()
}

/// The elastic axis' move, planned once.
fn trajectory() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("device-board");
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("axis.spt").display().to_string();
        let output = command(&["plan", &move_file(), "--out", &path]).output();
        assert!(output.expect("it runs").status.success());
        path
    })
}

/// Presses Ctrl-C.
fn interrupt(child: &Child) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status();
    assert!(sent.expect("it runs").success());
}

/// Time for a command to go on with what it does.
fn a_moment() {
    thread::sleep(Duration::from_millis(700));
}

/// What is known to be refused is refused before the drives are switched on.
#[test]
fn a_start_that_cannot_be_leaves_the_drives_off() {
    let board = Board::at(0.0).loaded();
    let refusal = board.refusal(&[
        "start",
        "--arm",
        "--comms",
        "quick-stop",
        "--timeout-ms",
        "0",
    ]);
    assert_eq!(
        refusal["see"],
        "docs/troubleshooting.md#Refusal.NoCommsTimeout"
    );
    assert_eq!(board.state(), State::Ready);

    let other = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("other-move.toml");
    let text = std::fs::read_to_string(move_file()).expect("a move file");
    let changed = text.replace("angle_rad = 1.0", "angle_rad = 0.9");
    assert_ne!(changed, text);
    std::fs::write(&other, changed).expect("written");
    let (other, spt) = (
        other.display().to_string(),
        trajectory().replace("axis.spt", "other.spt"),
    );
    let planned = command(&["plan", &other, "--out", &spt]).output();
    assert!(planned.expect("it runs").status.success());
    let refusal = board.refusal(&["start", &spt, "--arm"]);
    assert_eq!(
        refusal["see"],
        "docs/troubleshooting.md#Refusal.OtherTrajectory"
    );
    assert_eq!(board.state(), State::Ready);
}

#[test]
fn a_move_that_would_not_begin_is_refused() {
    let board = Board::at(0.0).loaded();
    board.ask(&["override", "0"]);
    for order in [&["start", "--arm"][..], &["run", trajectory()]] {
        let refusal = board.refusal(order);
        says(
            &refusal,
            &["the override is 0 %", "`stillpoint device override 100`"],
        );
        assert_eq!(
            refusal["see"],
            "docs/troubleshooting.md#the-move-is-slower-than-planned"
        );
        assert_eq!(board.state(), State::Ready);
    }
    board.ask(&["override", "100"]);
    assert_eq!(board.ask(&["run", trajectory()])["state"], "Done");
}

/// An axis that creeps to the start for minutes.
#[test]
fn ctrl_c_while_the_drives_are_waited_for_switches_them_off() {
    let board = Board::at(0.09);
    board.ask(&["config", "--move", &move_file()]);
    let settings = trajectory().replace("axis.spt", "slow.toml");
    let slow = "approach_speed_rad_per_s = 1e-3\n[accept]\nstart_tolerance_rad = 0.1\n";
    std::fs::write(&settings, slow).expect("written");
    board.ask(&["config", "--settings", &settings]);
    board.ask(&["upload", trajectory()]);
    for order in [&["start", "--arm"][..], &["run", trajectory()]] {
        let child = board.begin(order);
        board.until(State::Armed);
        interrupt(&child);
        let output = child.wait_with_output().expect("it ends");
        says(
            &failure(&output),
            &["interrupted", "the drives are off again"],
        );
        assert_eq!(board.state(), State::Ready);
    }
}

#[test]
fn ctrl_c_during_the_move_stops_it() {
    let board = Board::at(0.0).loaded();
    board.ask(&["override", "1"]);
    let child = board.begin(&["run", trajectory()]);
    board.until(State::Running);
    interrupt(&child);
    let failure = failure(&child.wait_with_output().expect("it ends"));
    says(
        &failure,
        &["a quick stop was asked for", "the drives are off"],
    );
    assert_eq!(
        failure["see"],
        "docs/troubleshooting.md#FaultCause.QuickStop"
    );
    assert_eq!(board.state(), State::Fault);
}

#[test]
fn a_board_that_goes_away_during_the_move_is_told_apart() {
    let run = |comms, event| {
        let board = Board::at(0.0).loaded();
        board.ask(&["override", "1"]);
        let child = board.begin(&["run", trajectory(), "--comms", comms]);
        board.until(State::Running);
        board.events.send(event).expect("it is there");
        failure(&child.wait_with_output().expect("it ends"))
    };
    let lost = run("hold", Event::Leave);
    says(
        &lost,
        &[
            "closed by the other side",
            "up to 1000 ms more, then holds",
            "stay on",
        ],
    );
    let lost = run("continue", Event::Mute);
    says(
        &lost,
        &[
            "did not answer",
            "plays the move to its end, with the drives on",
        ],
    );
    let restarted = run("quick-stop", Event::Restart);
    says(
        &restarted,
        &["the board started anew", "the drives are off"],
    );
    assert_eq!(
        restarted["see"],
        "docs/troubleshooting.md#FaultCause.Restart"
    );
}

/// A connection that ends for a moment; the board goes on, and so does the command.
#[test]
fn a_run_goes_on_over_a_new_connection() {
    let board = Board::at(0.0).loaded();
    board.ask(&["override", "10"]);
    let child = board.begin(&["run", trajectory()]);
    board.until(State::Running);
    board.events.send(Event::HangUp).expect("it is there");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(object(&output)["state"], "Done", "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(said.matches("connecting anew").count(), 1, "{said}");
}

/// A hold that somebody ordered is not taken back by a new connection.
#[test]
fn a_new_connection_resumes_nothing() {
    let board = Board::at(0.0).loaded();
    board.ask(&["override", "1"]);
    let child = board.begin(&["run", trajectory(), "--timeout-ms", "1000"]);
    board.until(State::Running);
    board.events.send(Event::Hold).expect("it is there");
    board.until(State::Held);
    board.events.send(Event::HangUp).expect("it is there");
    a_moment();
    assert_eq!(board.state(), State::Held);
    interrupt(&child);
    let failure = failure(&child.wait_with_output().expect("it ends"));
    says(&failure, &["a quick stop was asked for"]);
}

#[test]
fn a_monitor_goes_on_over_a_new_connection_and_gives_up_at_last() {
    let board = Board::at(0.0);
    let child = board.begin(&["monitor", "--seconds", "5", "--rate", "50"]);
    a_moment();
    board.events.send(Event::HangUp).expect("it is there");
    a_moment();
    board.events.send(Event::Restart).expect("it is there");
    board.events.send(Event::HangUp).expect("it is there");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(said.matches("connected again").count(), 2, "{said}");
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(lines.lines().count() > 150, "{}", lines.lines().count());

    let child = board.begin(&["monitor"]);
    a_moment();
    board.events.send(Event::Leave).expect("it is there");
    let output = child.wait_with_output().expect("it ends");
    assert!(!output.status.success());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("connecting anew (10 of 10)"), "{said}");
    assert!(said.contains("nobody answers at 127.0.0.1"), "{said}");
}

/// Ctrl-C is looked at between two tries to be heard; then the quick stop has its own tries.
#[test]
fn ctrl_c_is_noticed_on_a_dead_line() {
    let board = Board::at(0.0).loaded();
    board.ask(&["override", "1"]);
    let child = board.begin(&["run", trajectory(), "--comms", "continue"]);
    board.until(State::Running);
    board.events.send(Event::Mute).expect("it is there");
    // The question that is under way gets no answer; the board still hears.
    a_moment();
    interrupt(&child);
    let failure = failure(&child.wait_with_output().expect("it ends"));
    says(&failure, &["did not answer 5 times"]);
    assert_eq!(board.state(), State::Fault);
}

/// The signs of life come as often as a short timeout needs, or the move is refused.
#[test]
fn a_short_timeout_is_kept_or_refused() {
    let board = Board::at(0.0).loaded();
    let refusal = board.refusal(&["run", trajectory(), "--timeout-ms", "39"]);
    says(&refusal, &["--timeout-ms 39", "give 40 or more"]);
    assert_eq!(board.state(), State::Ready);
    let output = command(&[
        "device",
        "run",
        trajectory(),
        "--move",
        &move_file(),
        "--port",
        "sim:",
        "--json",
        "--timeout-ms",
        "60",
    ]);
    let output = { output }.output().expect("it runs");
    assert_eq!(object(&output)["state"], "Done", "{output:?}");
}

#[test]
fn a_start_says_what_the_board_does_without_it() {
    let board = Board::at(0.0).loaded();
    let output = board.tell(&["start", "--arm", "--timeout-ms", "900"]);
    assert_eq!(object(&output)["order"], "start");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("up to 900 ms more, then holds"), "{said}");
}

/// After a dry run, which has left the axes where they stand.
#[test]
fn an_armed_move_is_at_its_start() {
    let board = Board::at(0.0).loaded();
    let played = board.ask(&["run", trajectory(), "--dry-run"]);
    assert_eq!(played["path_s"], played["duration_s"]);
    board.ask(&["disarm"]);
    board.ask(&["arm"]);
    assert_eq!(board.ask(&["status"])["path_s"], 0.0);
}

/// Every failure has the same keys.
#[test]
fn a_failure_has_words_and_a_place_that_explains_them() {
    let output = command(&["device", "log", "--json"])
        .output()
        .expect("it runs");
    let failure = failure(&output);
    says(&failure, &["only an emulated board"]);
    assert_eq!(failure["see"], "docs/board.md#the-log");
    let output = command(&["device", "status", "--json"])
        .output()
        .expect("it runs");
    assert_eq!(object(&output)["see"], Value::Null);
    assert!(
        object(&output)
            .as_object()
            .is_some_and(|object| object.contains_key("see"))
    );
}

#[test]
fn a_file_that_is_no_serial_port_says_so() {
    let output = command(&["device", "hello", "--port", "/dev/null", "--json"]).output();
    let failure = failure(&output.expect("it runs"));
    says(
        &failure,
        &[
            "/dev/null is no serial port",
            "`stillpoint device ports`",
            "921600 bit/s",
        ],
    );
}
