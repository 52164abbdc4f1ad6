//! Figures of the serial link, measured on the emulated board: how long a greeting and the upload of the paper's move
//! take, and how many bytes the move takes on the line against streams of its set-points in the same frames.
//!
//! ```text
//! cargo image-qemu
//! cargo run --release -p stillpoint --example board_figures
//! ```

use std::error::Error;
use std::time::{Duration, Instant};
use stillpoint::device::{Qemu, Session, Settings, Transport, TransportError, qemu};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::simulate::trajectory::board_limits;
use stillpoint_shared::protocol::{Envelope, Request, frame};
use stillpoint_shared::{Player, Trajectory};

const AXES: usize = 3;
const RUNS: usize = 5;

/// Counts the bytes on the line.
struct Counted {
    board: Qemu,
    to_board: usize,
    to_host: usize,
}

impl Transport for Counted {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.to_board += bytes.len();
        self.board.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let count = self.board.receive(buffer, timeout)?;
        self.to_host += count;
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.board.now()
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        self.board.reconnect()
    }
}

/// Bytes of all set-points (position, velocity, torque of each axis) at a rate, one frame each.
fn streamed(trajectory: &Trajectory, rate_hz: u32) -> Result<usize, Box<dyn Error>> {
    let player = Player::<AXES>::new(trajectory)?;
    let mut bytes = 0;
    for (sequence, ticks) in (0..=trajectory.duration_ticks())
        .step_by((10_000_000 / rate_hz) as usize)
        .enumerate()
    {
        let sample = player.sample(ticks).ok_or("no sample")?;
        let envelope = Envelope {
            session: 1,
            sequence: sequence as u16,
        };
        let body = (
            sample.position_rad,
            sample.velocity_rad_per_s,
            sample.torque_nm,
        );
        bytes += frame::encode(envelope, &body, &mut [0; 128])
            .map_err(|error| format!("{error:?}"))?
            .len();
    }
    Ok(bytes)
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml")?;
    let limits = board_limits(&file.limits, file.machine.plant()).map_err(|e| e.to_string())?;
    let trajectory = plan(&file, &Pounce, Box::new(|_, _| true))?.trajectory;
    let (mut hellos_ms, mut uploads_ms, mut moved) = (Vec::new(), Vec::new(), (0, 0));
    for _ in 0..RUNS {
        let mut board = Qemu::start(&qemu::Options::default())?;
        board.turn_to(&trajectory.coefficients()[..AXES])?;
        let line = Counted {
            board,
            to_board: 0,
            to_host: 0,
        };
        let began = Instant::now();
        let mut session = Session::open(line, Settings::default())?;
        hellos_ms.push(began.elapsed().as_secs_f64() * 1e3);
        let axes = limits.axes().iter().copied().collect();
        session.order(&Request::SetLimits(axes))?;
        let line = session.transport();
        let before = (line.to_board, line.to_host);
        uploads_ms.push(session.upload(&trajectory, |_| {})?.time.as_secs_f64() * 1e3);
        let line = session.transport();
        moved = (line.to_board - before.0, line.to_host - before.1);
    }
    let say = |what: &str, times_ms: &mut Vec<f64>| {
        times_ms.sort_by(f64::total_cmp);
        let (least, middle, most) = (times_ms[0], times_ms[RUNS / 2], times_ms[RUNS - 1]);
        println!("{what}: {least:.1} to {most:.1} ms, median {middle:.1} ms, {RUNS} runs");
    };
    say("hello", &mut hellos_ms);
    say("upload of the paper's move", &mut uploads_ms);
    println!(
        "bytes of the upload: {} to the board, {} back; the trajectory itself has {}",
        moved.0,
        moved.1,
        trajectory.encoded_bytes()
    );
    for rate_hz in [1_000, 4_000] {
        let bytes = streamed(&trajectory, rate_hz)?;
        println!(
            "bytes of its set-points at {rate_hz} Hz: {bytes}, {:.2} times the upload",
            bytes as f64 / moved.0 as f64
        );
    }
    Ok(())
}
