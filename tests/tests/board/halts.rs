//! Hold, resume and override on the emulated board: the path stays the planned one and all limits hold at every tick.

use stillpoint_firmware::State;
use stillpoint_firmware::bench::{AXES, TickRecord};
use stillpoint_shared::LIMIT_TOLERANCE;
use stillpoint_shared::protocol::Request;
use stillpoint_shared::status::{CommsPolicy, HoldReason, StartRequest};

use super::bench::{Bench, SLOWLY_PERCENT, paper, start_request};
use super::replay::planned_position;

const PERIOD_S: f32 = 250e-6;

/// Everything that has to hold in every tick from the start of the move on.
fn check(seen: &[TickRecord]) {
    let (limits, trajectory) = paper();
    for (index, record) in seen.iter().enumerate() {
        let sent = record.sent.expect("the drives are on");
        let planned = planned_position(trajectory, record.path_ticks);
        for (axis, [position, velocity, torque]) in sent.into_iter().enumerate() {
            let limits = &limits.axes()[axis];
            let (planned, largest) = planned[axis];
            let distance = (f64::from(position) - planned).abs();
            assert!(distance <= 1e-6 * largest, "{distance} rad off the path");
            let available = limits.available_torque_nm(velocity) * (1.0 + 3.0 * LIMIT_TOLERANCE);
            assert!(torque.abs() <= available, "{torque} of {available} N·m");
            let Some(before) = index.checked_sub(1).and_then(|index| seen[index].sent) else {
                continue;
            };
            let step = (torque - before[axis][2]).abs();
            let most = limits.torque_rate_nm_per_s * PERIOD_S * (1.0 + 2.0 * LIMIT_TOLERANCE);
            assert!(step <= most, "torque steps by {step} of {most} N·m");
        }
    }
    for pair in seen.windows(2) {
        let forward = pair[1].path_ticks.checked_sub(pair[0].path_ticks);
        assert!(forward.is_some_and(|ticks| ticks <= 2_500), "{pair:?}");
    }
}

/// Silence of the host in ticks after which the board holds by itself: so the hold comes in the middle of the move at full
/// speed, however slow this computer is.
const SILENCE_TICKS: u32 = 80;

#[test]
fn a_move_is_held_resumed_and_slowed_within_its_limits() {
    let start = StartRequest {
        comms: CommsPolicy::Hold,
        comms_timeout_ticks: SILENCE_TICKS,
        ..start_request()
    };
    let mut bench = Bench::running(100, &start);
    let held = bench.until_state(State::Held);
    assert!(held.path_ticks < paper().1.duration_ticks());
    assert_eq!(bench.status().held_by, Some(HoldReason::CommsLost));
    bench.wait_ticks(200);

    // Orders come at rest only, so that it does not matter when.
    let mut percents = [30].into_iter().chain(std::iter::repeat(100));
    while bench.seen.last().unwrap().state == State::Held {
        let percent = percents.next().unwrap();
        let request = Request::Override { percent };
        bench.session.order(&request).unwrap();
        bench.session.order(&Request::Resume).unwrap();
        bench.until_state(State::Running);
        bench.until_halt();
    }

    let begin = bench.seen.iter().position(|r| r.state == State::Running);
    let seen = &bench.seen[begin.unwrap()..];
    check(seen);

    // It stood while it was held.
    let held = seen
        .windows(2)
        .filter(|pair| pair.iter().all(|record| record.state == State::Held));
    let places = |record: &TickRecord| record.sent.unwrap().map(|axis| axis[0]);
    assert!(held.clone().count() > 100);
    assert!(
        held.clone()
            .all(|pair| places(&pair[0]) == places(&pair[1]))
    );
    // It came from full speed, 2,500 time ticks per tick, and went on at 30 %.
    let steps: Vec<_> = seen
        .windows(2)
        .map(|pair| pair[1].path_ticks - pair[0].path_ticks)
        .collect();
    let of_speed = |speed: u32| {
        let near = speed - 1..=speed + 1;
        steps.iter().filter(|step| near.contains(*step)).count()
    };
    assert!(of_speed(2_500) > 70 && of_speed(750) > 5, "{steps:?}");
    // The end is the planned one, exactly.
    let coefficients = paper().1.coefficients();
    let end = &coefficients[coefficients.len() - 3 * AXES..];
    let last = seen.last().unwrap().sent.unwrap();
    for (axis, sent) in last.iter().enumerate() {
        assert_eq!(sent[0].to_bits(), end[axis].to_bits());
    }
}

/// Orders in the middle of the move. When they come depends on this computer; what has to hold does not.
#[test]
fn an_override_changes_the_speed_and_nothing_else() {
    let mut bench = Bench::running(SLOWLY_PERCENT, &start_request());
    for (share, percent) in [(0.05, 30), (0.3, 10), (0.5, 100)] {
        bench.until_share(share);
        bench.session.order(&Request::Override { percent }).unwrap();
    }
    bench.until_state(State::Done);
    let begin = bench.seen.iter().position(|r| r.state == State::Running);
    check(&bench.seen[begin.unwrap()..]);
}

#[test]
fn a_move_is_held_by_an_order() {
    let mut bench = Bench::under_way();
    bench.session.order(&Request::Hold).unwrap();
    bench.until_state(State::Held);
    assert_eq!(bench.status().held_by, Some(HoldReason::Command));
    let percent = 100;
    let request = Request::Override { percent };
    bench.session.order(&request).unwrap();
    bench.session.order(&Request::Resume).unwrap();
    bench.until_state(State::Done);
    let begin = bench.seen.iter().position(|r| r.state == State::Running);
    check(&bench.seen[begin.unwrap()..]);
}
