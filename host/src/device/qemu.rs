//! Starts the emulated board: QEMU with the image that `cargo image-qemu` built.
//!
//! QEMU connects to ports of this process rather than the other way round, so there is no port that
//! somebody else could take in between. The board has started when [`Qemu::start`] returns.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{env, thread};

use thiserror::Error;

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

/// Most bytes of the log that are kept; later ones are dropped.
const MAX_LOG_BYTES: usize = 1 << 20;

/// How fast the emulated time passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pace {
    /// As fast as real time, or more slowly if the host is slow.
    #[default]
    RealTime,
    /// As fast as the host can: idle time takes none. Timeouts on the board then come early.
    Fast,
}

/// What to start.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The image; else that of the variable `STILLPOINT_QEMU_IMAGE`, else the one that Cargo built.
    pub image: Option<PathBuf>,
    /// How fast the emulated time passes.
    pub pace: Pace,
    /// Whether to connect the test bench, too, which then sees every tick and has to read.
    pub bench: bool,
}

/// An emulated board. It ends when this is dropped.
#[derive(Debug)]
pub struct Qemu {
    process: Child,
    image: PathBuf,
    port: TcpStream,
    bench: Option<TcpStream>,
    log: Arc<Mutex<Vec<u8>>>,
}

/// Why the emulated board does not run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum QemuError {
    /// There is no image.
    #[error(
        "there is no image for the emulated board at {}: build it with `cargo image-qemu` in Stillpoint's folder, \
         or name it in the variable {IMAGE_VARIABLE}", path.display()
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
    #[error("{PROGRAM} did not connect within {} s: is the machine very busy? Try again", CONNECT_TIMEOUT.as_secs())]
    Silent,
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
        let mut command = Command::new(PROGRAM);
        command.args(["-machine", MACHINE, "-nodefaults", "-display", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        let sleep = match options.pace {
            Pace::RealTime => "on",
            Pace::Fast => "off",
        };
        command.args(["-icount", &format!("shift={SHIFT},sleep={sleep}")]);
        for (name, listener) in [("port", &port), ("bench", &bench)] {
            let number = listener.local_addr()?.port();
            let bus = format!(
                "socket,id={name},host={},port={number},nodelay=on",
                Ipv4Addr::LOCALHOST
            );
            if name == "port" || options.bench {
                command.args(["-chardev", &bus]);
            }
        }
        // USART1, USART2, USART3, UART4.
        let bench_end = if options.bench {
            "chardev:bench"
        } else {
            "null"
        };
        for serial in ["null", "null", "chardev:port", bench_end] {
            command.args(["-serial", serial]);
        }
        command.arg("-kernel").arg(&image);
        let mut process = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| match error.kind() {
                io::ErrorKind::NotFound => QemuError::NotInstalled,
                _ => QemuError::Io(error),
            })?;
        let log = Arc::new(Mutex::new(Vec::new()));
        if let Some(output) = process.stdout.take() {
            let log = Arc::clone(&log);
            thread::spawn(move || keep(output, &log));
        }
        let connected = accept(&port, &mut process).and_then(|port| {
            let bench = options.bench.then(|| accept(&bench, &mut process));
            Ok((port, bench.transpose()?))
        });
        match connected {
            Ok((port, bench)) => Ok(Self {
                process,
                image,
                port,
                bench,
                log,
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

    /// The serial port of the protocol.
    pub fn port(&self) -> &TcpStream {
        &self.port
    }

    /// The test bench, if it was asked for: see `stillpoint_firmware::bench`.
    pub fn bench(&self) -> Option<&TcpStream> {
        self.bench.as_ref()
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

impl Read for Qemu {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.port.read(buffer)
    }
}

impl Write for Qemu {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.port.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
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
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
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
fn keep(mut output: ChildStdout, log: &Mutex<Vec<u8>>) {
    let mut buffer = [0; 4096];
    while let Ok(count @ 1..) = output.read(&mut buffer) {
        let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
        let room = MAX_LOG_BYTES.saturating_sub(log.len());
        log.extend_from_slice(&buffer[..count.min(room)]);
    }
}

/// The image named in the environment, else Cargo's: beside this program, which lies in or below a
/// folder of the same target folder, or below the current folder.
fn image() -> PathBuf {
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
