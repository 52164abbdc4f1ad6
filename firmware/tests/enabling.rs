//! From arming to enabled drives: where they stand, how long it may take, and that it stays so.

mod common;

use common::{AXES, Drives, FINE, START_RAD, brought_to, changed, limits};
use nalgebra::SVector;
use stillpoint_firmware::executor::ENABLING_TIME_TICKS;
use stillpoint_firmware::{Config, DriveStatus, Executor, FaultCause, Feedback, State};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

/// Armed drives that need so many ticks, and whose feedback is spoiled.
fn enabling(
    ticks: u32,
    spoil: impl Fn(&mut [Feedback; AXES]) + 'static,
) -> (Executor<AXES>, Drives) {
    let (mut executor, mut drives) = brought_to(State::Ready);
    drives.enabling_ticks = ticks;
    executor.arm().unwrap();
    drives.spoil(spoil);
    (executor, drives)
}

fn cause(executor: &Executor<AXES>) -> Option<FaultCause> {
    executor.fault().map(|fault| fault.cause)
}

#[test]
fn an_axis_that_leaves_the_first_node_before_it_is_enabled_is_a_fault() {
    let tolerance_rad = Config::default().accept.start_tolerance_rad;
    // It sinks while the brake opens, or stands elsewhere when it says that it is enabled.
    for status in [DriveStatus::Disabled, DriveStatus::Enabled] {
        let (mut executor, mut drives) = enabling(10, move |feedback| {
            if feedback[1].status == status {
                feedback[1].position_rad -= 0.002;
            }
        });
        for _ in 0..20 {
            executor.tick(&mut drives, &FINE);
        }
        let Some(FaultCause::LeftStart {
            axis,
            distance_rad,
            tolerance_rad: allowed_rad,
        }) = cause(&executor)
        else {
            panic!("{status:?}: {:?}", executor.fault());
        };
        assert_eq!((axis, allowed_rad), (1, tolerance_rad));
        assert!((distance_rad - 0.002).abs() < 1e-6, "{distance_rad}");
    }
}

#[test]
fn within_the_tolerance_it_may_move_and_creeps_from_there() {
    let (mut executor, mut drives) = enabling(10, |feedback| {
        if feedback[1].status == DriveStatus::Disabled {
            feedback[1].position_rad -= 0.0009;
        }
    });
    for _ in 0..200 {
        assert_eq!(executor.tick(&mut drives, &FINE).fault, None);
    }
    executor.start(&executor.start_request()).unwrap();
}

#[test]
fn drives_that_are_not_enabled_in_time_are_a_fault() {
    let limit_ticks = ENABLING_TIME_TICKS / DRIVE_PERIOD_TICKS;
    let (mut executor, mut drives) = enabling(limit_ticks - 1, |_| {});
    for _ in 0..limit_ticks + 10 {
        assert_eq!(executor.tick(&mut drives, &FINE).fault, None);
    }
    let (mut executor, mut drives) = enabling(u32::MAX, |feedback| {
        feedback[0].status = DriveStatus::Enabled;
    });
    for _ in 0..limit_ticks {
        assert_eq!(executor.tick(&mut drives, &FINE).fault, None);
    }
    executor.tick(&mut drives, &FINE);
    let cause = cause(&executor);
    assert_eq!(
        cause,
        Some(FaultCause::NotEnabled {
            axis: 1,
            waited_ticks: limit_ticks + 1,
            limit_ticks,
        })
    );
}

#[test]
fn an_axis_arrives_however_many_turns_it_is_from_zero() {
    for turned_rad in [300.0, -3_000.0, 20_000.0] {
        let mut config = Config::default();
        config.accept.start_tolerance_rad = 0.01;
        let mut executor = Executor::<AXES>::new(limits(), config).unwrap();
        let moved = changed(&limits(), |(_, _, quantity, axis), value| {
            // The turns alone: this far away, the move itself would be rounding errors.
            match (quantity, axis) {
                (0, 0) => turned_rad,
                (_, 0) => 0.0,
                _ => value,
            }
        });
        let stands_rad = SVector::from([turned_rad as f32 + 0.006, START_RAD[1] as f32]);
        let mut drives = Drives::at(&stands_rad);
        executor.tick(&mut drives, &FINE);
        executor.load(&moved, &stands_rad).unwrap();
        executor.arm().unwrap();
        for _ in 0..1_000 {
            assert_eq!(executor.tick(&mut drives, &FINE).fault, None);
        }
        let request = executor.start_request();
        assert_eq!(executor.start(&request), Ok(()), "{turned_rad} rad");
    }
}
