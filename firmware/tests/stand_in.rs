//! The drive loop while the executor is busy.

use nalgebra::SVector;
use stillpoint_firmware::bench::{Action, BenchDrives, ENABLING_TICKS};
use stillpoint_firmware::stand_in::StandIn;
use stillpoint_firmware::{DriveGroup, DriveStatus, Setpoint, TickInputs};

const WELL: TickInputs = TickInputs {
    emergency_stop: false,
    busy_ticks: 0,
    missed_ticks: 0,
};

const PRESSED: TickInputs = TickInputs {
    emergency_stop: true,
    ..WELL
};

fn drives() -> StandIn<BenchDrives<2>, 2> {
    StandIn::new(BenchDrives::at(&SVector::zeros()))
}

fn setpoints() -> [Setpoint; 2] {
    [1.0, -2.0].map(|position_rad| Setpoint {
        position_rad,
        velocity_rad_per_s: 0.0,
        torque_nm: 3.0,
    })
}

fn statuses(drives: &mut StandIn<BenchDrives<2>, 2>) -> [DriveStatus; 2] {
    drives.observe().unwrap().map(|feedback| feedback.status)
}

/// Drives that follow these set-points.
fn following() -> StandIn<BenchDrives<2>, 2> {
    let mut drives = drives();
    for _ in 0..=ENABLING_TICKS {
        drives.exchange(&setpoints()).unwrap();
    }
    assert_eq!(statuses(&mut drives), [DriveStatus::Enabled; 2]);
    drives
}

#[test]
fn what_was_told_last_is_told_again() {
    let mut drives = following();
    drives.drives_mut().take_sent();
    drives.tick(&WELL);
    assert_eq!(drives.drives_mut().take_sent(), Some(setpoints()));
    let feedback = drives.observe().unwrap();
    assert_eq!(feedback.map(|axis| axis.position_rad), [1.0, -2.0]);
}

#[test]
fn drives_that_are_off_stay_off() {
    let mut drives = drives();
    drives.tick(&WELL);
    assert_eq!(drives.drives_mut().take_sent(), None);

    let mut drives = following();
    drives.safe();
    drives.drives_mut().take_sent();
    drives.tick(&WELL);
    assert_eq!(drives.drives_mut().take_sent(), None);
    assert_eq!(statuses(&mut drives), [DriveStatus::Disabled; 2]);
}

#[test]
fn a_stop_takes_the_torque_away_at_once_and_is_not_forgotten() {
    let mut drives = following();
    drives.tick(&PRESSED);
    assert_eq!(statuses(&mut drives), [DriveStatus::Disabled; 2]);
    // Released again: not before the executor says so.
    drives.tick(&WELL);
    assert_eq!(statuses(&mut drives), [DriveStatus::Disabled; 2]);

    let mut inputs = WELL;
    drives.hand_back(&mut inputs);
    assert!(inputs.emergency_stop);
    let mut inputs = WELL;
    drives.hand_back(&mut inputs);
    assert!(!inputs.emergency_stop);
}

#[test]
fn a_reset_of_faults_is_passed_on() {
    let mut drives = drives();
    drives.drives_mut().act(Action::Fault { axis: 1 });
    drives.tick(&WELL);
    assert_ne!(statuses(&mut drives), [DriveStatus::Disabled; 2]);
    drives.reset_faults();
    assert_eq!(statuses(&mut drives), [DriveStatus::Disabled; 2]);
}

#[test]
fn a_broken_bus_is_left_to_the_executor() {
    let mut drives = following();
    drives.drives_mut().act(Action::CutBus);
    drives.tick(&WELL);
    assert!(drives.observe().is_err());
    drives.drives_mut().act(Action::Repair);
    drives.tick(&WELL);
    assert_eq!(statuses(&mut drives), [DriveStatus::Enabled; 2]);
}

#[test]
fn a_drive_that_is_lost_is_not_brought_back() {
    let mut drives = following();
    drives.drives_mut().act(Action::SwitchOff { axis: 1 });
    drives.tick(&WELL);
    drives.drives_mut().act(Action::Repair);
    drives.drives_mut().take_sent();
    for _ in 0..2 * ENABLING_TICKS {
        drives.tick(&WELL);
        assert_eq!(drives.drives_mut().take_sent(), None);
        assert_eq!(statuses(&mut drives), [DriveStatus::Disabled; 2]);
    }
}
