//! The fault record: the last second is there, garbage is recognised, a restart is a fault.

mod common;

use common::{AXES, BUILD_ID, FINE, START_RAD, brought_to, start, trajectory};
use stillpoint_firmware::record::{PAST, RECENT};
use stillpoint_firmware::{DriveStatus, Fault, FaultCause, FaultRecord, HoldReason, State};

#[test]
fn the_last_second_before_a_fault_is_kept() {
    let (mut executor, mut drives) = brought_to(State::Running);
    for _ in 0..100 {
        executor.tick(&mut drives, &FINE);
    }
    executor.hold().unwrap();
    for _ in 0..8_000 {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(
        (executor.state(), executor.hold_reason()),
        (State::Held, Some(HoldReason::Command))
    );
    assert!(executor.fault_record().is_none(), "no fault yet");
    executor.resume().unwrap();
    for _ in 0..41 {
        executor.tick(&mut drives, &FINE);
    }
    drives.spoil(|feedback| feedback[1].position_rad += 0.5);
    let fault = executor.tick(&mut drives, &FINE).fault.unwrap();
    assert!(matches!(
        fault.cause,
        FaultCause::FollowingError { axis: 1, .. }
    ));

    let record = executor.fault_record().unwrap();
    let head = record.head().unwrap();
    assert_eq!(head.fault, Some(fault));
    assert_eq!((head.build_id, head.recording), (BUILD_ID, false));
    assert_eq!(head.trajectory_hash, trajectory().header().content_hash);
    let samples: Vec<_> = record.samples().collect();
    assert!(samples.len() >= RECENT + PAST - 10, "{}", samples.len());
    let ticks: Vec<u32> = samples.iter().map(|sample| sample.tick).collect();
    assert!(ticks.is_sorted_by(|a, b| a < b));
    let last = samples.last().unwrap();
    assert_eq!(u64::from(last.tick), fault.tick);
    let span = last.tick - ticks[0];
    assert!((3_900..4_100).contains(&span), "{span} ticks are a second");
    assert!(
        ticks
            .windows(2)
            .rev()
            .take(RECENT - 2)
            .all(|pair| pair[1] - pair[0] <= 4)
    );

    assert_eq!(last.state, Some(State::Fault));
    let report = executor.report();
    assert_eq!(last.path_ticks, report.path_ticks);
    for axis in 0..AXES {
        let error = if axis == 1 { -0.5 } else { 0.0 };
        assert!(
            (last.following_error_rad[axis] - error).abs() < 2e-3,
            "{last:?}"
        );
        let torque_nm = report.setpoints[axis].torque_nm;
        assert!((last.torque_nm[axis] - torque_nm).abs() <= torque_nm.abs() / 200.0);
    }
    assert_eq!(samples[0].state, Some(State::Held));
    assert_eq!(samples[0].path_speed, 0);

    // It stays over the clear, until the drives are armed again.
    executor.clear().unwrap();
    drives.spoil(|_| {});
    drives.ideal = stillpoint_firmware::IdealDrives::at(&start());
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.fault_record().unwrap().fault(), Some(fault));
    executor.arm().unwrap();
    assert!(executor.fault_record().is_none());
    executor.tick(&mut drives, &FINE);
    executor.disarm().unwrap();
    assert!(executor.fault_record().is_none());
}

#[test]
fn a_fault_with_the_drives_off_leaves_the_record_alone() {
    let (mut executor, mut drives) = brought_to(State::Armed);
    drives.spoil(|feedback| feedback[0].status = DriveStatus::Fault { code: 1 });
    let first = executor.tick(&mut drives, &FINE).fault.unwrap();
    executor.clear().unwrap();
    executor.tick(&mut drives, &FINE);
    executor.emergency_stop();
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.fault().unwrap().cause, FaultCause::EmergencyStop);
    assert_eq!(executor.fault_record().unwrap().fault(), Some(first));
}

#[test]
fn a_fault_without_feedback_is_recorded_too() {
    let (mut executor, mut drives) = brought_to(State::Running);
    drives.bus_broken = true;
    executor.tick(&mut drives, &FINE);
    let record = executor.fault_record().unwrap();
    let last = record.samples().last().unwrap();
    assert!(
        last.following_error_rad[0].is_nan() && last.age_ticks == 255,
        "{last:?}"
    );
}

/// A record as it is in memory: all of its fields are plain integers.
fn recording() -> FaultRecord<AXES> {
    let mut record = FaultRecord::<AXES>::empty();
    record.begin(5, 6, 2_500);
    record
}

#[test]
fn after_a_reset_a_recording_is_a_restart_and_a_finished_one_stays_what_it_was() {
    let mut record = recording();
    record.recover();
    let restart = Fault {
        cause: FaultCause::Restart,
        tick: 0,
    };
    assert_eq!(record.fault(), Some(restart));

    let mut record = recording();
    let fault = Fault {
        cause: FaultCause::FeedbackStale {
            axis: 2,
            age_ticks: u16::MAX,
            limit_ticks: u16::MAX,
        },
        tick: u64::MAX,
    };
    record.close(fault);
    record.recover();
    assert_eq!(record.fault(), Some(fault), "the longest numbers fit");

    let mut record = recording();
    record.end();
    record.recover();
    assert_eq!(record.fault(), None);
    assert!(record.head().is_some());

    let mut empty = FaultRecord::<AXES>::empty();
    empty.recover();
    assert_eq!((empty.head(), empty.samples().count()), (None, 0));
    assert_eq!(START_RAD.len(), AXES);
}
