//! A dry run: the same checks and the same set-points, and the drives stay off.

mod common;

use common::{AXES, Drives, FINE, REACH_RAD, START_RAD, brought_to, start, trajectory};
use nalgebra::SVector;
use stillpoint_firmware::{
    Command, DriveStatus, Executor, FaultCause, Refusal, Setpoint, StartRequest, State,
};

fn dry(executor: &Executor<AXES>) -> StartRequest {
    StartRequest {
        dry_run: true,
        ..executor.start_request()
    }
}

fn started() -> (Executor<AXES>, Drives) {
    let (mut executor, drives) = brought_to(State::Ready);
    executor.start(&dry(&executor)).unwrap();
    (executor, drives)
}

fn setpoints(executor: &mut Executor<AXES>, drives: &mut Drives) -> Vec<[Setpoint; AXES]> {
    let mut setpoints = Vec::new();
    while executor.state() == State::Running {
        setpoints.push(*executor.tick(drives, &FINE).setpoints);
        if setpoints.len() == 50 {
            executor.set_override(40).unwrap();
        }
    }
    setpoints
}

#[test]
fn a_dry_run_plays_what_a_run_plays_with_the_drives_off() {
    let (mut executor, mut drives) = started();
    let would_be = setpoints(&mut executor, &mut drives);
    assert_eq!(
        (executor.state(), executor.is_dry_run()),
        (State::Done, true)
    );
    assert_eq!(drives.exchanges, 0);
    assert!(drives.safes as usize >= would_be.len());

    let (mut executor, mut drives) = brought_to(State::Running);
    assert_eq!(setpoints(&mut executor, &mut drives), would_be);
}

#[test]
fn a_dry_run_can_be_held_and_resumed_and_ends_in_ready() {
    let (mut executor, mut drives) = started();
    for _ in 0..60 {
        executor.tick(&mut drives, &FINE);
    }
    executor.hold().unwrap();
    while executor.state() == State::Holding {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(executor.state(), State::Held);
    executor.resume().unwrap();
    while executor.state() == State::Running {
        executor.tick(&mut drives, &FINE);
    }
    executor.disarm().unwrap();
    executor.tick(&mut drives, &FINE);
    assert_eq!(
        (executor.state(), executor.is_dry_run()),
        (State::Ready, false)
    );
    assert_eq!(drives.exchanges, 0);
    // From there the real one.
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    executor.start(&executor.start_request()).unwrap();
}

#[test]
fn what_is_loaded_after_a_dry_run_leaves_the_drives_off() {
    let (mut executor, mut drives) = started();
    while executor.state() == State::Running {
        executor.tick(&mut drives, &FINE);
    }
    executor.load(&trajectory(), &start()).unwrap();
    assert_eq!(
        (executor.state(), executor.is_dry_run()),
        (State::Ready, false)
    );
    assert_eq!(drives.exchanges, 0);
}

#[test]
fn a_dry_run_is_refused_where_a_run_would_be() {
    let (mut executor, mut drives) = brought_to(State::Ready);
    drives.spoil(|feedback| feedback[0].position_rad = 1.0);
    executor.tick(&mut drives, &FINE);
    assert!(matches!(
        executor.start(&dry(&executor)),
        Err(Refusal::NotAtStart { axis: 0, .. })
    ));
    drives.spoil(|feedback| feedback[0].age_ticks = 9);
    executor.tick(&mut drives, &FINE);
    assert!(matches!(
        executor.start(&dry(&executor)),
        Err(Refusal::Feedback(FaultCause::FeedbackStale { axis: 0, .. }))
    ));
    let (mut executor, _) = brought_to(State::Armed);
    assert_eq!(
        executor.start(&dry(&executor)),
        Err(Refusal::WrongState {
            command: Command::DryRun,
            state: State::Armed
        })
    );
}

#[test]
fn faults_are_faults_in_a_dry_run_but_axes_that_do_not_follow_are_not() {
    let (mut executor, mut drives) = started();
    for _ in 0..100 {
        let report = executor.tick(&mut drives, &FINE);
        assert_eq!(report.fault, None);
    }
    let measured = executor.measured_rad().unwrap();
    assert_eq!(measured, start());
    let sent = executor.report().setpoints[0].position_rad;
    assert!((f64::from(sent) - START_RAD[0]).abs() > 0.1 * REACH_RAD[0].abs());

    drives.spoil(|feedback| feedback[1].status = DriveStatus::Fault { code: 3 });
    let fault = executor.tick(&mut drives, &FINE).fault.unwrap();
    assert_eq!(fault.cause, FaultCause::DriveFault { axis: 1, code: 3 });
    executor.clear().unwrap();
    assert!(!executor.is_dry_run());

    let (mut executor, mut drives) = started();
    drives.bus_broken = true;
    let fault = executor.tick(&mut drives, &FINE).fault.unwrap();
    assert_eq!(fault.cause, FaultCause::ExchangeFailed);
    assert_eq!(SVector::from(START_RAD.map(|rad| rad as f32)), start());
}
