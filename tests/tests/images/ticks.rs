//! How many instructions a tick takes on the emulated board, which counts them exactly.

use std::time::Duration;

use stillpoint::device::{Qemu, Session, Settings, qemu};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::simulate::trajectory::board_limits;
use stillpoint_firmware::State;
use stillpoint_firmware::bench::{Record, TickRecord};
use stillpoint_shared::protocol::{Channels, Request, TelemetryConfig};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

/// Counts of the core clock per emulated instruction: an instruction lasts 8 ns, the timer counts at 168 MHz.
const COUNTS_PER_INSTRUCTION: f64 = 168e6 * qemu::INSTRUCTION_S;

fn instructions(counts: u16) -> f64 {
    f64::from(counts) / COUNTS_PER_INSTRUCTION
}

#[test]
fn budget() {
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
    let limits = board_limits(&file.limits, file.machine.plant()).unwrap();
    let trajectory = plan(&file, &Pounce, Box::new(|_, _| true))
        .unwrap()
        .trajectory;
    let header = trajectory.header();
    let start = StartRequest {
        trajectory_hash: header.content_hash,
        limits_hash: header.limits_hash,
        comms: CommsPolicy::Continue,
        comms_timeout_ticks: 0,
        dry_run: false,
    };
    let options = qemu::Options {
        records: true,
        ..qemu::Options::default()
    };
    let mut board = Qemu::start(&options).unwrap();
    board.turn_to(&trajectory.coefficients()[..3]).unwrap();
    let mut session = Session::open(board, Settings::default()).unwrap();
    let axes = limits.axes().iter().copied().collect();
    session.order(&Request::SetLimits(axes)).unwrap();
    session.upload(&trajectory, |_| {}).unwrap();
    for every_ticks in [0, 1] {
        session
            .order(&Request::SetTelemetry(TelemetryConfig {
                every_ticks,
                channels: Channels::ALL,
            }))
            .unwrap();
        session.order(&Request::Arm).unwrap();
        while session.order(&Request::Start(start)).is_err() {}
        for (wait_ms, request) in [
            (10, Request::Hold),
            (30, Request::Resume),
            (5, Request::Override { percent: 30 }),
            (30, Request::Override { percent: 100 }),
        ] {
            session.wait(Duration::from_millis(wait_ms)).unwrap();
            println!(
                "{request:?} {:?}",
                session.order(&request).map_err(|e| e.to_string())
            );
        }
        while session.status().unwrap().state != State::Done {}
        let mut ticks: Vec<TickRecord> = Vec::new();
        while let Ok(record) = session
            .transport()
            .records()
            .recv_timeout(Duration::from_millis(300))
        {
            if let Record::Tick(tick) = record {
                if tick.state == State::Done {
                    break;
                }
                ticks.push(tick);
            }
        }
        for state in [State::Armed, State::Running, State::Holding, State::Held] {
            let mut whole: Vec<f64> = ticks
                .iter()
                .filter(|t| t.state == state)
                .map(|t| instructions(t.whole_counts))
                .collect();
            let mut reach: Vec<f64> = ticks
                .iter()
                .filter(|t| t.state == state)
                .map(|t| instructions(t.to_setpoint_counts))
                .collect();
            whole.sort_by(f64::total_cmp);
            reach.sort_by(f64::total_cmp);
            if whole.is_empty() {
                continue;
            }
            let n = whole.len();
            println!(
                "telemetry {every_ticks} {state:?}: n {n} least {:.0} median {:.0} p90 {:.0} most {:.0}; to set-point {:.0} {:.0} {:.0}",
                whole[0],
                whole[n / 2],
                whole[n * 9 / 10],
                whole[n - 1],
                reach[0],
                reach[n / 2],
                reach[n - 1]
            );
        }
        session.order(&Request::Disarm).unwrap();
        session
            .transport_mut()
            .turn_to(&trajectory.coefficients()[..3])
            .unwrap();
        session.wait(Duration::from_millis(50)).unwrap();
    }
}
