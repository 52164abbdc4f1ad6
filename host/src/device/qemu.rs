//! The emulated board: QEMU with the image that `cargo image-qemu` builds.
//!
//! QEMU connects to ports of this process rather than the other way round, so there is no port that
//! somebody else could take in between. The board has started when [`Qemu::start`] returns. Its
//! drives are simulated; a test bench disturbs them, turns their axes by hand and sees every tick
//! ([`stillpoint_firmware::bench`]).

use super::transport::{Transport, TransportError};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{env, thread};
use stillpoint_firmware::bench::{Action, MAX_ACTION_BYTES, Record};

/// Names the image, if it is not where Cargo puts it.
pub const IMAGE_VARIABLE: &str = "STILLPOINT_QEMU_IMAGE";

const PROGRAM: &str = "qemu-system-arm";
/// An STM32F405; in every version of QEMU from 5.1 on.
const MACHINE: &str = "netduinoplus2";
/// Where Cargo puts the image, below its target folder.
const IMAGE: &str = "thumbv7em-none-eabihf/firmware/qemu";

/// Emulated instructions last 2³ ns each: 125 million per second, about what the real board does at
/// 168 MHz with its flash's wait states.
const SHIFT: u32 = 3;
/// Duration of an emulated instruction in s.
pub const INSTRUCTION_S: f64 = (1 << SHIFT) as f64 * 1e-9;

const CONNECT_TIMEOUT: Duration = Duration::from_secs(20);

/// Longest time to wait for the board to take bytes.
const PATIENCE: Duration = Duration::from_secs(5);

/// Most bytes of the log that are kept; later ones are dropped.
const MAX_LOG_BYTES: usize = 1 << 20;

/// How fast the emulated time passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pace {
    /// As fast as real time, or more slowly if the host is slow.
    #[default]
    RealTime,
    /// As fast as the host can: idle time takes none, so timeouts on the board come early. Instruction counts are exact
    /// and the same in every run.
    Fast,
}

/// What to start.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The image; else that of the variable `STILLPOINT_QEMU_IMAGE`, else the one that Cargo built.
    pub image: Option<PathBuf>,
    /// How fast the emulated time passes.
    pub pace: Pace,
    /// Whether to keep what the test bench sees, for [`Qemu::records`]: about 60 bytes per tick with the drives on.
    pub records: bool,
}

/// An emulated board. It ends when this is dropped.
#[derive(Debug)]
pub struct Qemu {
    process: Child,
    image: PathBuf,
    port: TcpStream,
    bench: TcpStream,
    records: Receiver<Record>,
    log: Arc<Mutex<Vec<u8>>>,
    started: Instant,
}

/// Why the emulated board does not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum QemuError {
    /// There is no image.
    #[error(
        "there is no image for the emulated board at {}: build it with `cargo image-qemu` in \
         Stillpoint's folder, or name it in the variable {IMAGE_VARIABLE}", path.display()
    )]
    NoImage {
        /// Where it should be.
        path: PathBuf,
    },
    /// QEMU is not installed.
    #[error(
        "{PROGRAM} is not installed: install QEMU for Arm (on Debian: apt-get install {PROGRAM})"
    )]
    NotInstalled,
    /// QEMU ended at once.
    #[error("{PROGRAM} ended at once; it said: {said}")]
    Ended {
        /// What it said.
        said: String,
    },
    /// QEMU does not connect.
    #[error("{PROGRAM} did not connect within {} s: is this computer very busy? Try again", CONNECT_TIMEOUT.as_secs())]
    Silent,
    /// The image does not start.
    #[error(
        "the image does not start: is it one for the emulated board? Build it again with `cargo image-qemu`"
    )]
    NoStart,
    /// Something else.
    #[error("the emulated board could not be started: {0}")]
    Io(#[from] io::Error),
}

impl Qemu {
    /// Starts the board.
    ///
    /// # Errors
    /// Says what to install or build if something is missing.
    pub fn start(options: &Options) -> Result<Self, QemuError> {
        let image = options.image.clone().unwrap_or_else(image);
        if !image.is_file() {
            return Err(QemuError::NoImage { path: image });
        }
        let port = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let bench = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let command = command(&image, options.pace, &port, &bench);
        let mut process = command?.spawn().map_err(|error| match error.kind() {
            ErrorKind::NotFound => QemuError::NotInstalled,
            _ => QemuError::Io(error),
        })?;
        let log = Arc::new(Mutex::new(Vec::new()));
        if let Some(output) = process.stdout.take() {
            let log = Arc::clone(&log);
            thread::spawn(move || keep(output, &log));
        }
        let connected = accept(&port, &mut process).and_then(|port| {
            let bench = accept(&bench, &mut process)?;
            let (sender, records) = channel();
            let (reader, keep) = (bench.try_clone()?, options.records);
            thread::spawn(move || watch(reader, keep, &sender));
            // The first record says that the board has started; before, it does not listen.
            match records.recv_timeout(CONNECT_TIMEOUT) {
                Ok(Record::Up) => {}
                _ => return Err(QemuError::NoStart),
            }
            port.set_write_timeout(Some(PATIENCE))?;
            bench.set_write_timeout(Some(PATIENCE))?;
            Ok((port, bench, records))
        });
        match connected {
            Ok((port, bench, records)) => Ok(Self {
                process,
                image,
                port,
                bench,
                records,
                log,
                started: Instant::now(),
            }),
            Err(error) => {
                end(&mut process);
                Err(error)
            }
        }
    }

    /// The image that runs.
    pub fn image(&self) -> &Path {
        &self.image
    }

    /// Makes the test bench do something, at the next tick.
    ///
    /// # Errors
    /// [`TransportError::Closed`] where QEMU has ended.
    pub fn act(&mut self, action: Action) -> Result<(), TransportError> {
        let mut buffer = [0; MAX_ACTION_BYTES];
        let bytes = action.encode(&mut buffer);
        self.bench.write_all(bytes).map_err(failed)
    }

    /// Turns the axes by hand to these positions in rad, with the drives off.
    ///
    /// # Errors
    /// As [`Qemu::act`].
    pub fn turn_to(&mut self, position_rad: &[f32]) -> Result<(), TransportError> {
        for (axis, &position_rad) in (0..).zip(position_rad) {
            self.act(Action::Turn { axis, position_rad })?;
        }
        Ok(())
    }

    /// What the test bench sees, if it was asked to keep it.
    pub fn records(&self) -> &Receiver<Record> {
        &self.records
    }

    /// What the board has logged since the last call: defmt, to be decoded with the image.
    pub fn take_log(&self) -> Vec<u8> {
        std::mem::take(&mut *self.log.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        end(&mut self.process);
    }
}

impl Transport for Qemu {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.port.write_all(bytes).map_err(failed)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        // Zero would mean for ever.
        let timeout = timeout.max(Duration::from_millis(1));
        self.port.set_read_timeout(Some(timeout)).map_err(failed)?;
        match self.port.read(buffer) {
            Ok(0) if !buffer.is_empty() => Err(closed()),
            Ok(bytes) => Ok(bytes),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(0),
                _ => Err(failed(error)),
            },
        }
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// The connection lasts as long as QEMU does.
    fn reconnect(&mut self) -> Result<(), TransportError> {
        match self.process.try_wait().map_err(failed)? {
            None => Ok(()),
            Some(_) => Err(closed()),
        }
    }
}

fn closed() -> TransportError {
    let port = "qemu:".to_owned();
    TransportError::Closed { port }
}

fn failed(error: io::Error) -> TransportError {
    let port = "qemu:".to_owned();
    match error.kind() {
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe => {
            closed()
        }
        _ => TransportError::Failed { port, error },
    }
}

fn command(
    image: &Path,
    pace: Pace,
    port: &TcpListener,
    bench: &TcpListener,
) -> io::Result<Command> {
    let sleep = match pace {
        Pace::RealTime => "on",
        Pace::Fast => "off",
    };
    let mut command = Command::new(PROGRAM);
    command.args(["-machine", MACHINE, "-nodefaults", "-display", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native"]);
    command.args(["-icount", &format!("shift={SHIFT},sleep={sleep}")]);
    for (name, listener) in [("port", port), ("bench", bench)] {
        let number = listener.local_addr()?.port();
        let host = Ipv4Addr::LOCALHOST;
        let socket = format!("socket,id={name},host={host},port={number},nodelay=on");
        command.args(["-chardev", &socket]);
    }
    // USART1, USART2, USART3, UART4.
    for serial in ["null", "null", "chardev:port", "chardev:bench"] {
        command.args(["-serial", serial]);
    }
    command.arg("-kernel").arg(image);
    command.stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    Ok(command)
}

/// Ends the process if it still runs; there is nobody to tell if that fails.
fn end(process: &mut Child) {
    let _ = process.kill();
    let _ = process.wait();
}

fn accept(listener: &TcpListener, process: &mut Child) -> Result<TcpStream, QemuError> {
    listener.set_nonblocking(true)?;
    let begin = Instant::now();
    while begin.elapsed() < CONNECT_TIMEOUT {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error.into()),
        }
        if process.try_wait()?.is_some() {
            let mut said = String::new();
            if let Some(mut errors) = process.stderr.take() {
                errors.read_to_string(&mut said)?;
            }
            let said = said.trim().to_owned();
            return Err(QemuError::Ended { said });
        }
        thread::sleep(Duration::from_millis(1));
    }
    Err(QemuError::Silent)
}

/// Keeps what the board logs, so that it never waits for a reader.
fn keep(mut output: impl Read, log: &Mutex<Vec<u8>>) {
    let mut buffer = [0; 4096];
    while let Ok(count @ 1..) = output.read(&mut buffer) {
        let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
        let room = MAX_LOG_BYTES.saturating_sub(log.len());
        log.extend_from_slice(&buffer[..count.min(room)]);
    }
}

/// Reads what the test bench sees, so that the board never waits, and passes it on: all or the first record.
fn watch(mut bench: impl Read, keep: bool, sender: &Sender<Record>) {
    let (mut buffer, mut unread) = ([0; 4096], Vec::new());
    let mut passed = 0usize;
    while let Ok(count @ 1..) = bench.read(&mut buffer) {
        if passed > 0 && !keep {
            continue;
        }
        unread.extend_from_slice(&buffer[..count]);
        let mut rest = unread.as_slice();
        while let Ok((record, after)) = postcard::take_from_bytes(rest) {
            rest = after;
            passed += 1;
            if sender.send(record).is_err() {
                return;
            }
        }
        unread = rest.to_vec();
    }
}

/// The image named in the environment, else Cargo's: beside this program, which lies in or below a
/// folder of the same target folder, or below the current folder.
pub fn image() -> PathBuf {
    if let Some(path) = env::var_os(IMAGE_VARIABLE) {
        return path.into();
    }
    let target = env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let program = env::current_exe().unwrap_or_default();
    let beside = program.ancestors().skip(2).take(2).map(Path::to_owned);
    let candidates = target
        .into_iter()
        .chain(beside)
        .chain([PathBuf::from("target")]);
    let mut images = candidates.map(|folder| folder.join(IMAGE));
    let last_resort = PathBuf::from("target").join(IMAGE);
    images.find(|image| image.is_file()).unwrap_or(last_resort)
}
