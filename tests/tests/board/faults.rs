//! Everything that stops a move: the right state, the right cause, and no motion afterwards without `clear`.

use stillpoint::device::DeviceError;
use stillpoint_firmware::bench::{Action, DRIVE_FAULT};
use stillpoint_firmware::{FaultCause, Refusal, State};
use stillpoint_shared::protocol::{Denial, Request, Status};
use stillpoint_shared::status::{CommsPolicy, HoldReason, StartRequest};

use super::bench::{Bench, paper, start_request};

/// The state is `Fault`, nothing moves, no order changes that, and the record is there. Then a move is possible again
/// once all is well and the fault is cleared.
fn stopped(bench: &mut Bench, is_cause: impl Fn(&FaultCause) -> bool) {
    if bench
        .seen
        .last()
        .is_none_or(|last| last.state != State::Fault)
    {
        bench.until_state(State::Fault);
    }
    let status = bench.status();
    assert_eq!(status.state, State::Fault);
    let fault = status.fault.unwrap();
    assert!(is_cause(&fault.cause), "{}", fault.cause);

    let seen = bench.seen.len();
    for request in [
        Request::Arm,
        Request::Start(start_request()),
        Request::Resume,
        Request::Hold,
    ] {
        let error = bench.session.order(&request).unwrap_err();
        let DeviceError::Denied(Denial::Executor(Refusal::WrongState { state, .. })) = error else {
            panic!("{request:?}: {error}");
        };
        assert_eq!(state, State::Fault);
    }
    bench.wait_ticks(400);
    bench.drain();
    let after = &bench.seen[seen..];
    assert!(
        after.iter().all(|record| record.sent.is_none()),
        "{after:?}"
    );
    let now = bench.status();
    assert_eq!((now.state, now.fault), (State::Fault, Some(fault)));
    let stands =
        |status: &Status| -> Vec<_> { status.axes.iter().map(|axis| axis.measured_rad).collect() };
    assert_eq!(stands(&now), stands(&status));

    let report = bench.session.fault_report().unwrap().unwrap();
    assert_eq!(report.head.fault, fault);
    assert_eq!(report.head.trajectory_hash, paper().1.header().content_hash);
    assert_eq!(report.samples.len(), usize::from(report.head.samples));
    assert!(report.samples.len() > 10 && report.samples.is_sorted_by_key(|sample| sample.tick));
    // One sample is a millisecond; a quick stop is noted when it begins and recorded to its end.
    let last = report.samples.last().unwrap();
    assert!(u64::from(last.tick) + 4 >= fault.tick, "{last:?}");

    bench.act(Action::Repair);
    bench.wait_ticks(4);
    bench.session.order(&Request::Clear).unwrap();
    let status = bench.status();
    assert_eq!((status.state, status.fault), (State::Ready, None));
    // As text: what was not measured is no number.
    let kept = bench.session.fault_report().unwrap();
    assert_eq!(format!("{kept:?}"), format!("{:?}", Some(report)));
}

/// A fault that the bench makes in the middle of a move.
fn disturbed(action: Action, is_cause: impl Fn(&FaultCause) -> bool) {
    let mut bench = Bench::under_way();
    bench.act(action);
    stopped(&mut bench, is_cause);
}

#[test]
fn an_emergency_stop_takes_the_torque_away_until_it_is_released_and_cleared() {
    let mut bench = Bench::under_way();
    bench.act(Action::Stop);
    bench.until_state(State::Fault);
    let error = bench.session.order(&Request::Clear).unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::Denied(Denial::Executor(Refusal::EmergencyStop))
        ),
        "{error}"
    );
    stopped(&mut bench, |cause| *cause == FaultCause::EmergencyStop);
}

#[test]
fn a_drive_fault_stops_all_axes() {
    disturbed(Action::Fault { axis: 1 }, |cause| {
        *cause
            == FaultCause::DriveFault {
                axis: 1,
                code: DRIVE_FAULT,
            }
    });
}

#[test]
fn a_drive_that_switches_off_stops_all_axes() {
    disturbed(Action::SwitchOff { axis: 2 }, |cause| {
        *cause == FaultCause::DriveDisabled { axis: 2 }
    });
}

#[test]
fn stale_feedback_stops_all_axes() {
    disturbed(Action::Silence { axis: 0 }, |cause| {
        *cause
            == FaultCause::FeedbackStale {
                axis: 0,
                age_ticks: 3,
                limit_ticks: 2,
            }
    });
}

#[test]
fn a_blocked_axis_is_a_following_error() {
    disturbed(Action::Block { axis: 1 }, |cause| match *cause {
        FaultCause::FollowingError {
            axis,
            error_rad,
            limit_rad,
        } => axis == 1 && error_rad.abs() > limit_rad && limit_rad >= 0.01,
        _ => false,
    });
}

#[test]
fn a_bus_that_fails_stops_all_axes() {
    disturbed(Action::CutBus, |cause| *cause == FaultCause::ExchangeFailed);
}

#[test]
fn a_tick_that_takes_too_long_stops_the_move() {
    disturbed(Action::Overrun, |cause| match *cause {
        FaultCause::LoopOverrun {
            duration_ticks,
            limit_ticks,
        } => limit_ticks == 2_000 && duration_ticks > limit_ticks,
        _ => false,
    });
}

#[test]
fn a_quick_stop_slows_down_and_takes_the_torque_away() {
    let mut bench = Bench::under_way();
    bench.session.order(&Request::QuickStop).unwrap();
    bench.until_state(State::Stopping);
    stopped(&mut bench, |cause| *cause == FaultCause::QuickStop);
}

/// Nothing is sent for this many ticks: silence.
const TIMEOUT_TICKS: u32 = 200;

fn silent(comms: CommsPolicy) -> Bench {
    let start = StartRequest {
        comms,
        comms_timeout_ticks: TIMEOUT_TICKS,
        ..start_request()
    };
    Bench::running(10, &start)
}

#[test]
fn a_silent_host_is_played_on_without() {
    let mut bench = silent(CommsPolicy::Continue);
    bench.until_state(State::Done);
    assert!(bench.seen.iter().all(|record| record.state != State::Held));
}

#[test]
fn a_silent_host_holds_the_move_which_goes_on_when_it_is_back() {
    let mut bench = silent(CommsPolicy::Hold);
    bench.until_state(State::Held);
    let running = bench.seen.iter().filter(|r| r.state == State::Running);
    let heard = running.count() as u32;
    assert!(
        (TIMEOUT_TICKS..TIMEOUT_TICKS + 40).contains(&heard),
        "{heard}"
    );
    assert_eq!(bench.status().held_by, Some(HoldReason::CommsLost));
    // A sign of life alone moves nothing.
    bench.wait_ticks(50);
    assert_eq!(bench.status().state, State::Held);
    bench.session.order(&Request::Resume).unwrap();
    loop {
        let status = bench.status();
        match status.state {
            State::Done => break,
            State::Running | State::Holding => {}
            // This computer was silent for too long again.
            State::Held => bench.session.order(&Request::Resume).unwrap(),
            state => panic!("{state:?}"),
        }
    }
}

#[test]
fn a_silent_host_stops_the_move() {
    let mut bench = silent(CommsPolicy::QuickStop);
    bench.until_state(State::Stopping);
    stopped(&mut bench, |cause| match *cause {
        FaultCause::CommsLost {
            silent_ticks,
            limit_ticks,
        } => limit_ticks == TIMEOUT_TICKS && silent_ticks > limit_ticks,
        _ => false,
    });
}
