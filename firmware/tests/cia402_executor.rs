//! The executor plays a move on simulated drives, and stops when one of them fails.

mod cia402_sim;
mod common;

use cia402_sim::drive::Pds;
use cia402_sim::{Rig, START_COUNTS, axis_drive, every};
use common::{AXES, DURATION_TICKS, FINE, REACH_RAD, START_RAD, limits, start, trajectory};
use stillpoint_firmware::cia402::{Stage, Units};
use stillpoint_firmware::{Config, DriveStatus, Executor, FaultCause, Refusal, State};
use stillpoint_shared::Player;
use stillpoint_shared::drive_config::AxisDrive;
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

/// Drives that stand where the move starts, the second one reversed.
fn axes() -> [AxisDrive; AXES] {
    [0, 1].map(|axis| AxisDrive {
        home_counts: START_COUNTS,
        home_rad: START_RAD[usize::from(axis)] as f32,
        reversed: axis == 1,
        ..axis_drive(0, axis + 1)
    })
}

/// Executor and drives that stand at the first node, in operation.
fn ready() -> (Executor<AXES>, Rig<AXES, 1>) {
    let mut rig = Rig::<AXES, 1>::new(every(2_000), axes());
    rig.drives(|drive| drive.traits.largest_step = 20_000);
    let mut config = Config::default();
    config.monitor.feedback_age_ticks = 1;
    let mut executor = Executor::new(limits(), config).unwrap();
    executor.allow_for_bus(Some(rig.group.cycle()));
    executor.load(&trajectory(), &start()).unwrap();
    while (0..AXES).any(|axis| rig.report(axis).stage != Stage::Operational) {
        let early = executor.arm();
        assert!(
            matches!(early, Err(Refusal::NoFeedback | Refusal::Feedback(_))),
            "{early:?}"
        );
        executor.tick(&mut rig, &FINE);
    }
    (executor, rig)
}

/// The same, armed and started.
fn armed() -> (Executor<AXES>, Rig<AXES, 1>) {
    let (mut executor, mut rig) = ready();
    executor.arm().unwrap();
    while executor.start(&executor.start_request()).is_err() {
        assert_eq!(executor.tick(&mut rig, &FINE).fault, None);
    }
    (executor, rig)
}

#[test]
fn a_move_is_played_to_its_end() {
    let (mut executor, mut rig) = armed();
    rig.drives(|drive| drive.executed.clear());
    let mut sent = Vec::new();
    while executor.state() == State::Running {
        let report = executor.tick(&mut rig, &FINE);
        assert_eq!(report.fault, None);
        sent.push(*report.setpoints);
    }
    for _ in 0..100 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(executor.state(), State::Done);

    let player = Player::<AXES>::new(&trajectory()).unwrap();
    for (axis, drive) in axes().iter().enumerate() {
        let units = Units::new(drive);
        let executed = rig.drive(axis, |drive| drive.executed.clone());
        let planned: Vec<i32> = (0..=DURATION_TICKS)
            .step_by(DRIVE_PERIOD_TICKS as usize)
            .map(|ticks| player.sample(ticks).unwrap().position_rad[axis])
            .map(|position_rad| units.counts(position_rad).unwrap().value)
            .collect();
        // Every eighth set-point, and the last ones again and again.
        let places: Vec<usize> = executed
            .iter()
            .skip(2)
            .map(|(_, counts)| {
                planned
                    .iter()
                    .rposition(|planned| planned == counts)
                    .unwrap()
            })
            .take_while(|place| *place < planned.len() - 1)
            .collect();
        assert!(places.len() > 25, "{}", places.len());
        assert!(
            places.windows(2).all(|pair| pair[1] == pair[0] + 8),
            "{places:?}"
        );

        let end_rad = (START_RAD[axis] + REACH_RAD[axis]) as f32;
        let end = units.counts(end_rad).unwrap().value;
        assert!((rig.drive(axis, |drive| drive.counts()) - end).abs() <= 1);
        assert_eq!(
            sent.last().unwrap()[axis].position_rad,
            player.sample(DURATION_TICKS).unwrap().position_rad[axis]
        );
    }
}

#[test]
fn a_drive_that_fails_stops_the_move_and_the_other_drive() {
    let (mut executor, mut rig) = armed();
    for _ in 0..120 {
        assert_eq!(executor.tick(&mut rig, &FINE).fault, None);
    }
    rig.drive(1, |drive| drive.fail(0x3210));
    let mut ticks = 0;
    while executor.state() == State::Running {
        executor.tick(&mut rig, &FINE);
        ticks += 1;
        assert!(ticks < 20);
    }
    let cause = FaultCause::DriveFault {
        axis: 1,
        code: 0x3210,
    };
    assert_eq!(executor.fault().map(|fault| fault.cause), Some(cause));
    for _ in 0..40 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(
        rig.drives(|drive| drive.state),
        [Pds::SwitchOnDisabled, Pds::Fault]
    );
    let stands = rig.drives(|drive| (drive.executed.len(), drive.counts()));

    // Time does not bring it back.
    for _ in 0..400 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(rig.drive(1, |drive| drive.state), Pds::Fault);
    // `clear` does, and nothing moves by that.
    executor.clear().unwrap();
    for _ in 0..100 {
        executor.tick(&mut rig, &FINE);
        assert!(executor.arm().is_err(), "far from the start");
    }
    assert_eq!(
        rig.drives(|drive| drive.state),
        [Pds::SwitchOnDisabled; AXES]
    );
    assert_eq!(
        rig.drives(|drive| (drive.executed.len(), drive.counts())),
        stands
    );
}

#[test]
fn a_drive_that_comes_up_in_its_fault_is_reset_by_clear_and_by_nothing_else() {
    let mut rig = Rig::<AXES, 1>::new(every(2_000), axes());
    rig.drive(1, |drive| drive.fail(0x7500));
    let mut executor = Executor::new(limits(), Config::default()).unwrap();
    executor.allow_for_bus(Some(rig.group.cycle()));
    executor.load(&trajectory(), &start()).unwrap();
    for _ in 0..4_000 {
        executor.tick(&mut rig, &FINE);
    }
    let fault = DriveStatus::Fault { code: 0x7500 };
    let statuses = |executor: &Executor<AXES>| {
        let feedback = executor.report().feedback.copied();
        feedback.map(|feedback| feedback.map(|axis| axis.status))
    };
    assert_eq!(statuses(&executor), Some([DriveStatus::Disabled, fault]));
    let code = 0x7500;
    let refused = Refusal::Feedback(FaultCause::DriveFault { axis: 1, code });
    assert_eq!(executor.arm(), Err(refused));
    assert_eq!((executor.state(), executor.fault()), (State::Ready, None));

    executor.clear().unwrap();
    assert_eq!(executor.state(), State::Ready);
    for _ in 0..100 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(statuses(&executor), Some([DriveStatus::Disabled; AXES]));
    // The reset is asked for once: a later fault stays.
    rig.drive(1, |drive| drive.fail(0x7500));
    for _ in 0..400 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(statuses(&executor), Some([DriveStatus::Disabled, fault]));
}

#[test]
fn feedback_that_stays_away_stops_the_move() {
    let (mut executor, mut rig) = armed();
    rig.drive(0, |drive| drive.traits.sends_feedback = false);
    while executor.state() == State::Running {
        executor.tick(&mut rig, &FINE);
    }
    let limit_ticks = rig.group.cycle().feedback_age_ticks(1);
    let cause = FaultCause::FeedbackStale {
        axis: 0,
        age_ticks: limit_ticks + 1,
        limit_ticks,
    };
    assert_eq!(executor.fault().map(|fault| fault.cause), Some(cause));
}

#[test]
fn an_armed_drive_that_lost_its_torque_is_not_switched_on_again() {
    let (mut executor, mut rig) = ready();
    executor.arm().unwrap();
    for _ in 0..400 {
        assert_eq!(executor.tick(&mut rig, &FINE).fault, None);
    }
    assert_eq!(
        rig.drives(|drive| drive.state),
        [Pds::OperationEnabled; AXES]
    );
    // Its safe torque off opens, the axis is pushed away, and it closes again.
    rig.drive(0, |drive| {
        drive.state = Pds::SwitchOnDisabled;
        drive.push(20_000);
    });
    let stands = rig.drive(0, |drive| drive.counts());
    for _ in 0..4_000 {
        executor.tick(&mut rig, &FINE);
    }
    assert_eq!(
        executor.fault().map(|fault| fault.cause),
        Some(FaultCause::DriveDisabled { axis: 0 })
    );
    assert_eq!(
        rig.drives(|drive| drive.state),
        [Pds::SwitchOnDisabled; AXES]
    );
    assert_eq!(rig.drive(0, |drive| drive.counts()), stands);
}
