//! The drive loop while the executor is busy.

use nalgebra::SVector;
use stillpoint_firmware::bench::{Action, BenchDrives, ENABLING_TICKS};
use stillpoint_firmware::stand_in::{StandIn, Watched};
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

/// Drives and who stands in.
struct Rig {
    drives: BenchDrives<2>,
    stand_in: StandIn<2>,
}

impl Rig {
    fn at_rest() -> Self {
        Self {
            drives: BenchDrives::at(&SVector::zeros()),
            stand_in: StandIn::new(),
        }
    }

    /// Drives that follow the set-points.
    fn following() -> Self {
        let mut rig = Self::at_rest();
        for _ in 0..=ENABLING_TICKS {
            rig.watched().exchange(&setpoints()).unwrap();
        }
        assert_eq!(rig.statuses(), [DriveStatus::Enabled; 2]);
        rig
    }

    /// As the executor sees them.
    fn watched(&mut self) -> Watched<'_, BenchDrives<2>, 2> {
        self.stand_in.watching(&mut self.drives)
    }

    /// A tick without the executor.
    fn tick(&mut self, inputs: &TickInputs) {
        self.stand_in.tick(&mut self.drives, inputs);
    }

    fn statuses(&mut self) -> [DriveStatus; 2] {
        self.drives
            .observe()
            .unwrap()
            .map(|feedback| feedback.status)
    }
}

fn setpoints() -> [Setpoint; 2] {
    [1.0, -2.0].map(|position_rad| Setpoint {
        position_rad,
        velocity_rad_per_s: 0.0,
        torque_nm: 3.0,
    })
}

#[test]
fn what_was_told_last_is_told_again() {
    let mut rig = Rig::following();
    rig.drives.take_sent();
    rig.tick(&WELL);
    assert_eq!(rig.drives.take_sent(), Some(setpoints()));
    let feedback = rig.drives.observe().unwrap();
    assert_eq!(feedback.map(|axis| axis.position_rad), [1.0, -2.0]);
}

#[test]
fn drives_that_are_off_stay_off() {
    let mut rig = Rig::at_rest();
    rig.tick(&WELL);
    assert_eq!(rig.drives.take_sent(), None);

    let mut rig = Rig::following();
    rig.watched().safe();
    rig.drives.take_sent();
    rig.tick(&WELL);
    assert_eq!(rig.drives.take_sent(), None);
    assert_eq!(rig.statuses(), [DriveStatus::Disabled; 2]);
}

#[test]
fn a_stop_takes_the_torque_away_at_once_and_is_not_forgotten() {
    let mut rig = Rig::following();
    rig.tick(&PRESSED);
    assert_eq!(rig.statuses(), [DriveStatus::Disabled; 2]);
    // Released again: not before the executor says so.
    rig.tick(&WELL);
    assert_eq!(rig.statuses(), [DriveStatus::Disabled; 2]);

    let mut inputs = WELL;
    rig.stand_in.hand_back(&mut inputs);
    assert!(inputs.emergency_stop);
    let mut inputs = WELL;
    rig.stand_in.hand_back(&mut inputs);
    assert!(!inputs.emergency_stop);
}

#[test]
fn a_reset_of_faults_is_passed_on() {
    let mut rig = Rig::at_rest();
    rig.drives.act(Action::Fault { axis: 1 });
    rig.tick(&WELL);
    assert_ne!(rig.statuses(), [DriveStatus::Disabled; 2]);
    rig.watched().reset_faults();
    assert_eq!(rig.statuses(), [DriveStatus::Disabled; 2]);
}

#[test]
fn a_broken_bus_is_left_to_the_executor() {
    let mut rig = Rig::following();
    rig.drives.act(Action::CutBus);
    rig.tick(&WELL);
    assert!(rig.drives.observe().is_err());
    rig.drives.act(Action::Repair);
    rig.tick(&WELL);
    assert_eq!(rig.statuses(), [DriveStatus::Enabled; 2]);
}

#[test]
fn a_drive_that_is_lost_is_not_brought_back() {
    let mut rig = Rig::following();
    rig.drives.act(Action::SwitchOff { axis: 1 });
    rig.tick(&WELL);
    rig.drives.act(Action::Repair);
    rig.drives.take_sent();
    for _ in 0..2 * ENABLING_TICKS {
        rig.tick(&WELL);
        assert_eq!(rig.drives.take_sent(), None);
        assert_eq!(rig.statuses(), [DriveStatus::Disabled; 2]);
    }
}
