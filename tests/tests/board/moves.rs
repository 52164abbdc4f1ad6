//! The paper's move from hello to `Done`.

use stillpoint_firmware::State;
use stillpoint_firmware::bench::AXES;
use stillpoint_shared::protocol::{Channels, Request, TelemetryConfig};

use super::bench::{Bench, PATIENCE, first_rad, paper, start_request};
use super::replay;

/// Every set-point that the image sends over the whole move is the one that the same executor sends on this computer,
/// and telemetry shows what was sent.
#[test]
fn the_papers_move_is_sent_as_on_this_computer_to_the_bit() {
    let mut bench = Bench::configured();
    let greeting = bench.session.identity().greeting.clone();
    assert_eq!(greeting.board, "qemu");
    assert_ne!(greeting.build_id, 0);
    let uploaded = bench.upload();
    let values = paper().1.coefficients().len();
    assert_eq!(uploaded.blocks as usize, values.div_ceil(128));
    assert_eq!((uploaded.sent, uploaded.reconnects), (uploaded.blocks, 0));

    bench.session.order(&Request::Arm).unwrap();
    let telemetry = TelemetryConfig {
        every_ticks: 4,
        channels: Channels::SETPOINT_POSITION | Channels::SETPOINT_TORQUE,
    };
    bench
        .session
        .order(&Request::SetTelemetry(telemetry))
        .unwrap();
    bench.start(&start_request());
    bench.until_state(State::Done);
    bench.until("rest", |record| record.state == State::Done);

    let armed = bench.seen.iter().position(|record| record.sent.is_some());
    let seen = bench.seen[armed.unwrap()..].to_vec();
    let duration_ticks = paper().1.duration_ticks();
    assert_eq!(
        replay::compare(&seen),
        duration_ticks.div_ceil(2_500) as usize
    );

    // The last set-point is the last node.
    let last = seen.last().unwrap().sent.unwrap();
    let end = &paper().1.coefficients()[paper().1.coefficients().len() - 3 * AXES..];
    for (axis, sent) in last.iter().enumerate() {
        assert_eq!(sent[0].to_bits(), end[axis].to_bits());
    }

    let mut running = 0;
    let last_tick = u64::from(seen.last().unwrap().tick);
    while let Some(sample) = bench.session.telemetry(PATIENCE).unwrap() {
        let sample = sample.telemetry;
        if sample.tick > last_tick {
            break;
        }
        let Some(record) = seen.iter().find(|r| u64::from(r.tick) == sample.tick) else {
            continue;
        };
        let sent = record.sent.unwrap();
        assert_eq!(sample.state, record.state);
        assert_eq!(
            sample.channel(Channels::SETPOINT_POSITION),
            sent.map(|axis| axis[0])
        );
        assert_eq!(
            sample.channel(Channels::SETPOINT_TORQUE),
            sent.map(|axis| axis[2])
        );
        running += u32::from(record.state == State::Running);
    }
    assert!(running >= duration_ticks / 10_000 - 2, "{running}");
}

#[test]
fn a_dry_run_moves_nothing_and_ends_in_done() {
    let mut bench = Bench::loaded();
    let mut start = start_request();
    start.dry_run = true;
    bench.start(&start);
    bench.until_state(State::Done);
    assert!(bench.seen.iter().all(|record| record.sent.is_none()));
    let status = bench.status();
    assert!(status.dry_run && status.fault.is_none());
    let first = first_rad(&paper().1);
    let measured = status.axes.iter().map(|axis| axis.measured_rad);
    assert!(measured.eq(first.into_iter().map(Some)));
}
