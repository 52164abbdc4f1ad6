//! Everything that stops a move: the right state, the right cause, and no motion afterwards without
//! `clear`.

mod common;

use common::{AXES, Drives, FINE, begin, brought_to, limits, start, trajectory};
use stillpoint_firmware::path_time::FULL_SPEED;
use stillpoint_firmware::{
    CommsPolicy, Config, DriveStatus, Executor, FaultCause, HoldReason, Refusal, StartRequest,
    State, TickInputs,
};

/// 100 ticks into the move.
fn moving() -> (Executor<AXES>, Drives) {
    let (mut executor, mut drives) = brought_to(State::Running);
    for _ in 0..100 {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(executor.path_speed(), FULL_SPEED);
    (executor, drives)
}

/// Whatever is asked for, but `clear`: nothing moves.
fn stays_off(executor: &mut Executor<AXES>, drives: &mut Drives) {
    let fault = executor.fault();
    let exchanges = drives.exchanges;
    let _ = executor.resume();
    let _ = executor.arm();
    let _ = executor.start(&executor.start_request());
    let _ = executor.hold();
    executor.set_override(100).unwrap();
    for _ in 0..50 {
        let report = executor.tick(drives, &FINE);
        assert_eq!((report.state, report.fault), (State::Fault, fault));
    }
    assert_eq!(drives.exchanges, exchanges, "no set-point");
    executor.clear().unwrap();
    assert_eq!((executor.state(), executor.fault()), (State::Ready, None));
}

#[test]
fn no_setting_makes_a_quick_stop_slower_but_a_hold_takes_its_time() {
    let mut ticks = [0.02, 1.0].map(|ramp_s| {
        let slowed = |stop: fn(&mut Executor<AXES>)| {
            let config = Config {
                ramp_s,
                ..Config::default()
            };
            let mut executor = Executor::new(limits(), config).unwrap();
            let mut drives = Drives::at(&start());
            executor.tick(&mut drives, &FINE);
            executor.load(&trajectory(), &start()).unwrap();
            executor.arm().unwrap();
            executor.tick(&mut drives, &FINE);
            executor.start(&executor.start_request()).unwrap();
            for _ in 0..60 {
                executor.tick(&mut drives, &FINE);
            }
            stop(&mut executor);
            (0..)
                .take_while(|_| executor.tick(&mut drives, &FINE).path_speed > 0)
                .count()
        };
        [
            slowed(Executor::quick_stop),
            slowed(|executor| executor.hold().unwrap()),
        ]
    });
    let [[quick, hold], [quick_still, slow_hold]] = &mut ticks;
    assert_eq!(quick, quick_still);
    // 20 ms are 80 ticks; the slow hold does not stand before the end of the move.
    assert!(*quick < 120 && *hold == *quick, "{quick}, {hold}");
    assert!(*slow_hold > *quick, "{slow_hold}");
}

#[test]
fn a_quick_stop_slows_down_on_the_path_and_then_takes_the_torque_away() {
    let (mut executor, mut drives) = moving();
    executor.quick_stop();
    let (mut speed, mut path, safes) = (FULL_SPEED, executor.path_ticks(), drives.safes);
    let mut ticks = 0;
    loop {
        let report = executor.tick(&mut drives, &FINE);
        assert_eq!(
            report.fault.map(|fault| fault.cause),
            Some(FaultCause::QuickStop)
        );
        if report.state == State::Fault {
            break;
        }
        assert_eq!((report.state, drives.safes), (State::Stopping, safes));
        assert!(
            report.path_speed < speed || report.path_speed == 0,
            "from the next tick on"
        );
        assert!(report.path_ticks >= path);
        (speed, path) = (report.path_speed, report.path_ticks);
        ticks += 1;
        assert!(ticks < 150);
    }
    assert_eq!((speed, drives.safes), (0, safes + 1));
    stays_off(&mut executor, &mut drives);
}

#[test]
fn a_quick_stop_where_nothing_moves_takes_the_torque_away_with_the_next_tick() {
    for state in [State::Armed, State::Held, State::Done] {
        let (mut executor, mut drives) = brought_to(state);
        executor.quick_stop();
        let safes = drives.safes;
        executor.tick(&mut drives, &FINE);
        assert_eq!(
            (executor.state(), drives.safes),
            (State::Fault, safes + 1),
            "{state:?}"
        );
        stays_off(&mut executor, &mut drives);
    }
}

#[test]
fn a_fault_while_stopping_takes_the_torque_away_at_once_and_the_first_cause_stays() {
    let (mut executor, mut drives) = moving();
    executor.quick_stop();
    executor.tick(&mut drives, &FINE);
    let first = executor.fault();
    drives.spoil(|feedback| feedback[1].status = DriveStatus::Fault { code: 7 });
    let report = executor.tick(&mut drives, &FINE);
    assert_eq!((report.state, report.fault), (State::Fault, first));
}

#[test]
fn a_quick_stop_near_the_end_ends_there() {
    let (mut executor, mut drives) = brought_to(State::Running);
    while executor.path_ticks() + 20_000 < common::DURATION_TICKS {
        executor.tick(&mut drives, &FINE);
    }
    executor.quick_stop();
    while executor.state() == State::Stopping {
        executor.tick(&mut drives, &FINE);
    }
    let report = executor.report();
    assert_eq!(
        (report.state, report.path_ticks),
        (State::Fault, common::DURATION_TICKS)
    );
}

#[test]
fn a_hold_at_the_end_of_the_move_is_done() {
    let (mut executor, mut drives) = brought_to(State::Running);
    while executor.path_ticks() + 20_000 < common::DURATION_TICKS {
        executor.tick(&mut drives, &FINE);
    }
    executor.hold().unwrap();
    while executor.state() == State::Holding {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(executor.state(), State::Done);
}

#[test]
fn a_hold_is_held_only_when_the_axes_stand_by_their_feedback() {
    let (mut executor, mut drives) = moving();
    drives.spoil(|feedback| feedback[0].velocity_rad_per_s = 0.2);
    executor.hold().unwrap();
    for _ in 0..500 {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(
        (executor.state(), executor.path_speed()),
        (State::Holding, 0)
    );
    drives.spoil(|feedback| feedback[0].velocity_rad_per_s = -0.05);
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.state(), State::Held);
    assert_eq!(executor.hold_reason(), Some(HoldReason::Command));
}

#[test]
fn a_loop_that_is_late_is_a_fault_during_a_move_only() {
    let late = TickInputs {
        busy_ticks: 2_001,
        ..FINE
    };
    let missed = TickInputs {
        missed_ticks: 3,
        ..FINE
    };
    let overrun = FaultCause::LoopOverrun {
        duration_ticks: 2_001,
        limit_ticks: 2_000,
    };
    for (inputs, cause) in [
        (late, overrun),
        (missed, FaultCause::TicksMissed { missed: 3 }),
    ] {
        for state in State::ALL {
            let (mut executor, mut drives) = brought_to(state);
            let before = executor.fault().map(|fault| fault.cause);
            executor.tick(&mut drives, &inputs);
            let expected = if state.is_under_way() {
                before.or(Some(cause))
            } else {
                before
            };
            let found = executor.fault().map(|fault| fault.cause);
            assert_eq!(found, expected, "{state:?}");
            assert_eq!(
                executor.state() == State::Fault,
                found.is_some(),
                "{state:?}"
            );
        }
    }
    let (mut executor, mut drives) = moving();
    executor.tick(
        &mut drives,
        &TickInputs {
            busy_ticks: 1_999,
            ..FINE
        },
    );
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.monitor().peak_busy_ticks(), 1_999);
}

/// A move under a policy, brought to a state, with the host silent from there on.
fn silent(policy: CommsPolicy, state: State) -> (Executor<AXES>, Drives) {
    let (mut executor, mut drives) = brought_to(State::Armed);
    if state == State::Armed {
        return (executor, drives);
    }
    executor
        .start(&StartRequest {
            comms: policy,
            comms_timeout_ticks: 40,
            ..executor.start_request()
        })
        .unwrap();
    let mut heard = |executor: &mut Executor<AXES>| {
        executor.heard_from_host(executor.ticks());
        executor.tick(&mut drives, &FINE);
    };
    for _ in 0..100 {
        heard(&mut executor);
    }
    assert_eq!(executor.state(), State::Running);
    match state {
        State::Holding => executor.hold().unwrap(),
        State::Stopping => executor.quick_stop(),
        State::Held => {
            executor.hold().unwrap();
            while executor.state() != State::Held {
                heard(&mut executor);
            }
        }
        State::Done => {
            while executor.state() != State::Done {
                heard(&mut executor);
            }
        }
        _ => {}
    }
    executor.heard_from_host(executor.ticks());
    (executor, drives)
}

#[test]
fn a_silent_host_has_the_consequence_that_was_chosen_in_every_state() {
    use CommsPolicy::{Continue, Hold, QuickStop};
    use State::{Armed, Done, Fault, Held, Holding, Running, Stopping};
    let lost = Some(FaultCause::CommsLost {
        silent_ticks: 41,
        limit_ticks: 40,
    });
    let stop = Some(FaultCause::QuickStop);
    for (policy, state, after, cause) in [
        (Continue, Armed, Armed, None),
        (Continue, Running, Running, None),
        (Continue, Held, Held, None),
        (Continue, Done, Done, None),
        (Hold, Armed, Armed, None),
        (Hold, Running, Holding, None),
        (Hold, Holding, Holding, None),
        (Hold, Held, Held, None),
        (Hold, Done, Done, None),
        (Hold, Stopping, Stopping, stop),
        (QuickStop, Armed, Armed, None),
        (QuickStop, Running, Stopping, lost),
        (QuickStop, Holding, Stopping, lost),
        (QuickStop, Held, Fault, lost),
        (QuickStop, Done, Fault, lost),
        (QuickStop, Stopping, Stopping, stop),
    ] {
        let (mut executor, mut drives) = silent(policy, state);
        for _ in 0..40 {
            executor.tick(&mut drives, &FINE);
        }
        assert_eq!(executor.state(), state, "{policy:?} {state:?}: not yet");
        executor.tick(&mut drives, &FINE);
        let found = executor.fault().map(|fault| fault.cause);
        assert_eq!(
            (executor.state(), found),
            (after, cause),
            "{policy:?} {state:?}"
        );
    }
}

#[test]
fn a_move_held_by_silence_says_so_and_goes_on_only_by_resume() {
    let (mut executor, mut drives) = silent(CommsPolicy::Hold, State::Running);
    while executor.state() != State::Held {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(executor.hold_reason(), Some(HoldReason::CommsLost));
    executor.heard_from_host(executor.ticks());
    for _ in 0..30 {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(
        executor.state(),
        State::Held,
        "the host is back, but said nothing"
    );
    executor.resume().unwrap();
    assert_eq!(executor.hold_reason(), None);
    while executor.state() == State::Running {
        executor.heard_from_host(executor.ticks());
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(executor.state(), State::Done);
}

#[test]
fn resume_counts_as_heard() {
    let (mut executor, mut drives) = silent(CommsPolicy::Hold, State::Running);
    while executor.state() != State::Held {
        executor.tick(&mut drives, &FINE);
    }
    executor.resume().unwrap();
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.state(), State::Running);
}

#[test]
fn starts_that_mean_something_else_are_refused_with_both_hashes() {
    let (mut executor, _) = brought_to(State::Armed);
    let request = executor.start_request();
    let refused = |executor: &mut Executor<AXES>, request: StartRequest| {
        let refusal = executor.start(&request).unwrap_err();
        assert_eq!(executor.state(), State::Armed);
        refusal
    };
    assert_eq!(
        refused(
            &mut executor,
            StartRequest {
                trajectory_hash: 1,
                ..request
            }
        ),
        Refusal::OtherTrajectory {
            quoted: 1,
            loaded: request.trajectory_hash
        }
    );
    assert_eq!(
        refused(
            &mut executor,
            StartRequest {
                limits_hash: 2,
                ..request
            }
        ),
        Refusal::OtherLimits {
            quoted: 2,
            machine: request.limits_hash
        }
    );
    assert_eq!(
        refused(
            &mut executor,
            StartRequest {
                comms: CommsPolicy::Hold,
                ..request
            }
        ),
        Refusal::NoCommsTimeout
    );
    assert_eq!(
        executor.set_override(101),
        Err(Refusal::Override { percent: 101 })
    );
    // An upload that waits changes nothing about what a start means.
    begin(&mut executor, &trajectory());
    executor.start(&request).unwrap();
}
