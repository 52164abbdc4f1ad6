//! Telemetry: which ticks, what of them, what is dropped.

use stillpoint_firmware::State;
use stillpoint_shared::protocol::{Channels, Message, Request, Response, TelemetryConfig};
use stillpoint_shared::status::{CommsPolicy, LimitFlags};

use crate::common::{AXES, START_RAD, trajectory};
use crate::rig::Rig;

fn telemetry(every_ticks: u16, channels: Channels) -> Request<'static> {
    Request::SetTelemetry(TelemetryConfig {
        every_ticks,
        channels,
    })
}

#[test]
fn every_nth_tick_is_sampled_from_the_next_one_on() {
    let mut rig = Rig::new();
    assert_eq!(rig.telemetry(), []);
    rig.done(&telemetry(
        3,
        Channels::SETPOINT_POSITION | Channels::LIMITS,
    ));
    let first = rig.machine.executor.ticks() + 1;
    let mut seen = Vec::new();
    for _ in 0..10 {
        rig.tick(2);
        seen.extend(rig.telemetry());
    }
    let ticks: Vec<_> = seen.iter().map(|(_, sample)| sample.tick - first).collect();
    assert_eq!(ticks, [0, 3, 6, 9, 12, 15, 18]);
    for pair in seen.windows(2) {
        assert_eq!(pair[1].0, pair[0].0.wrapping_add(1), "sequence");
    }
    let (_, sample) = &seen[0];
    assert_eq!(sample.state, State::Idle);
    let start_rad = START_RAD.map(|rad| rad as f32);
    assert_eq!(sample.channel(Channels::SETPOINT_POSITION), start_rad);
    assert_eq!(sample.channel(Channels::MEASURED_POSITION), []);
    assert_eq!(sample.limited, [LimitFlags::NONE; AXES]);
}

/// All channels of a move, against the executor's own report.
#[test]
fn a_move_is_seen_as_it_is_played() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.run(CommsPolicy::Continue);
    rig.done(&Request::Override { percent: 50 });
    rig.done(&telemetry(1, Channels::ALL));
    let mut moving = 0;
    for _ in 0..200 {
        rig.machine.tick(&mut rig.drives, &crate::common::FINE);
        let seen = rig.telemetry();
        let report = rig.machine.executor.report();
        let [(_, sample)] = &seen[..] else {
            panic!("{seen:?}");
        };
        assert_eq!((sample.tick, sample.state), (report.tick, report.state));
        assert_eq!(sample.path_ticks, report.path_ticks);
        let feedback = report.feedback.unwrap();
        let each = |value: fn(usize, &stillpoint_firmware::TickReport<AXES>) -> f32| {
            (0..AXES)
                .map(|axis| value(axis, &report))
                .collect::<Vec<_>>()
        };
        let channel = |channel| sample.channel(channel).to_vec();
        assert_eq!(
            channel(Channels::SETPOINT_POSITION),
            each(|axis, report| report.setpoints[axis].position_rad)
        );
        assert_eq!(
            channel(Channels::SETPOINT_VELOCITY),
            each(|axis, report| report.setpoints[axis].velocity_rad_per_s)
        );
        assert_eq!(
            channel(Channels::SETPOINT_TORQUE),
            each(|axis, report| report.setpoints[axis].torque_nm)
        );
        assert_eq!(
            channel(Channels::MEASURED_POSITION),
            feedback.map(|feedback| feedback.position_rad)
        );
        assert_eq!(
            channel(Channels::MEASURED_VELOCITY),
            feedback.map(|feedback| feedback.velocity_rad_per_s)
        );
        assert!((0.0..=1.0).contains(&sample.path_speed));
        moving += u32::from(sample.path_speed == 0.5);
    }
    assert!(moving > 50, "{moving}");
}

#[test]
fn what_does_not_fit_is_dropped_and_counted_and_delays_no_response() {
    let mut rig = Rig::new();
    rig.done(&telemetry(1, Channels::ALL));
    // Nobody reads: the outbox fills, then the queue, then samples are dropped.
    let mut made = 0;
    for _ in 0..500 {
        rig.tick(1);
        made += 1;
        rig.poll();
    }
    // A request is answered all the same, at once.
    rig.sequence = rig.sequence.wrapping_add(1);
    let frame = crate::rig::framed(rig.envelope(), &Request::Status);
    rig.receive(&frame);
    rig.poll();
    let messages = rig.messages();
    let (last, sent) = messages.split_last().unwrap();
    let Message::Response(Response::Status(status)) = &last.1 else {
        panic!("{last:?}");
    };
    assert!(status.link.dropped > 400);
    let waiting = rig.telemetry();
    assert_eq!(
        sent.len() + waiting.len() + status.link.dropped as usize,
        made
    );
    assert_eq!(waiting.len(), 8);
    let kept = sent.iter().filter_map(|(_, message)| match message {
        Message::Telemetry(sample) => Some(sample.tick),
        _ => None,
    });
    let ticks: Vec<_> = kept
        .chain(waiting.iter().map(|(_, sample)| sample.tick))
        .collect();
    assert!(
        ticks.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "{ticks:?}"
    );
    // The next sample tells.
    rig.tick(1);
    let next = &rig.telemetry()[0].1;
    assert_eq!(next.dropped, status.link.dropped);
}

#[test]
fn a_new_session_begins_without_telemetry() {
    let mut rig = Rig::new();
    rig.done(&telemetry(1, Channels::NONE));
    rig.tick(1);
    assert_eq!(rig.telemetry().len(), 1);
    rig.hello(55);
    rig.tick(5);
    assert_eq!(rig.telemetry(), []);
    rig.done(&telemetry(1, Channels::NONE));
    rig.done(&telemetry(0, Channels::ALL));
    rig.tick(5);
    assert_eq!(rig.telemetry(), []);
}
