//! Hold, resume and override on the emulated board: the path stays the planned one and all limits hold at every tick.

use stillpoint_firmware::State;
use stillpoint_firmware::bench::{AXES, TickRecord};
use stillpoint_shared::LIMIT_TOLERANCE;
use stillpoint_shared::protocol::Request;
use stillpoint_shared::status::HoldReason;

use super::bench::{Bench, paper, start_request};
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

#[test]
fn a_move_is_held_resumed_and_slowed_within_its_limits() {
    let mut bench = Bench::running(100, &start_request());
    // In the middle, or what this computer makes of it: the board does not wait.
    bench.until_share(0.2);
    bench.session.order(&Request::Hold).unwrap();
    let held = bench.until("hold", |record| {
        matches!(record.state, State::Held | State::Done)
    });
    assert_eq!(
        held.state,
        State::Held,
        "this computer was too slow to hold"
    );
    let status = bench.status();
    assert_eq!(status.held_by, Some(HoldReason::Command));
    assert!(held.path_ticks < paper().1.duration_ticks());
    bench.wait_ticks(200);

    bench
        .session
        .order(&Request::Override { percent: 30 })
        .unwrap();
    bench.session.order(&Request::Resume).unwrap();
    let share = 0.5 * (1.0 + f64::from(held.path_ticks) / f64::from(paper().1.duration_ticks()));
    bench.until_share(share);
    bench
        .session
        .order(&Request::Override { percent: 100 })
        .unwrap();
    bench.until_state(State::Done);

    let begin = bench.seen.iter().position(|r| r.state == State::Running);
    let seen = &bench.seen[begin.unwrap()..];
    check(seen);

    // It stood while it was held.
    let held: Vec<_> = seen.iter().filter(|r| r.state == State::Held).collect();
    assert!(held.len() > 100);
    let places = held.iter().map(|record| record.sent.unwrap());
    let places: Vec<_> = places.map(|sent| sent.map(|axis| axis[0])).collect();
    assert!(places.windows(2).all(|pair| pair[0] == pair[1]));
    // It went on at 30 %: 750 of 2,500 time ticks per tick.
    let resumed = seen.iter().rposition(|record| record.state == State::Held);
    let steps = seen[resumed.unwrap()..].windows(2);
    let steps: Vec<_> = steps.map(|p| p[1].path_ticks - p[0].path_ticks).collect();
    let slow = steps.iter().filter(|step| (749..=751).contains(*step));
    assert!(slow.count() > 5, "{steps:?}");
    // The end is the planned one, exactly.
    let coefficients = paper().1.coefficients();
    let end = &coefficients[coefficients.len() - 3 * AXES..];
    let last = seen.last().unwrap().sent.unwrap();
    for (axis, sent) in last.iter().enumerate() {
        assert_eq!(sent[0].to_bits(), end[axis].to_bits());
    }
}

/// Slow motion from the start, faster and slower on the way.
#[test]
fn an_override_changes_the_speed_and_nothing_else() {
    let mut bench = Bench::running(30, &start_request());
    for (share, percent) in [(0.2, 100), (0.5, 30), (0.7, 100)] {
        bench.until_share(share);
        bench.session.order(&Request::Override { percent }).unwrap();
    }
    bench.until_state(State::Done);
    let begin = bench.seen.iter().position(|r| r.state == State::Running);
    check(&bench.seen[begin.unwrap()..]);
}
