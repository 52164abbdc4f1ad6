//! The test bench: its drives misbehave as they are told, and its bytes mean what was meant.

use nalgebra::SVector;
use proptest::prelude::*;
use stillpoint_firmware::bench::{
    AXES, Action, ActionReader, BenchDrives, DRIVE_FAULT, ENABLING_TICKS, MAX_ACTION_BYTES,
    MAX_RECORD_BYTES, Record, TickRecord,
};
use stillpoint_firmware::drive::NoAnswer;
use stillpoint_firmware::{DriveGroup, DriveStatus, Feedback, Setpoint, State};

fn to(position_rad: f32) -> [Setpoint; AXES] {
    [Setpoint {
        position_rad,
        velocity_rad_per_s: 0.5,
        torque_nm: 0.0,
    }; AXES]
}

/// Drives that follow.
fn enabled() -> BenchDrives<AXES> {
    let mut drives = BenchDrives::at(&SVector::zeros());
    for _ in 0..ENABLING_TICKS {
        let feedback = drives.exchange(&to(0.0)).unwrap();
        assert!(
            feedback
                .iter()
                .all(|axis| axis.status == DriveStatus::Disabled)
        );
    }
    drives.exchange(&to(0.0)).unwrap();
    drives
}

fn after(action: Action) -> [Feedback; AXES] {
    let mut drives = enabled();
    drives.act(action);
    drives.exchange(&to(1.0)).unwrap();
    drives.exchange(&to(2.0)).unwrap()
}

#[test]
fn each_trouble_is_that_of_its_axis() {
    let well = Feedback {
        position_rad: 2.0,
        velocity_rad_per_s: 0.5,
        age_ticks: 0,
        status: DriveStatus::Enabled,
    };
    let axis = 1;
    for (action, expected) in [
        (
            Action::Fault { axis },
            Feedback {
                status: DriveStatus::Fault { code: DRIVE_FAULT },
                ..well
            },
        ),
        (
            Action::SwitchOff { axis },
            Feedback {
                status: DriveStatus::Disabled,
                ..well
            },
        ),
        (
            Action::Silence { axis },
            Feedback {
                position_rad: 0.0,
                age_ticks: 2,
                ..well
            },
        ),
        (
            Action::Block { axis },
            Feedback {
                position_rad: 0.0,
                velocity_rad_per_s: 0.0,
                ..well
            },
        ),
    ] {
        assert_eq!(after(action), [well, expected, well], "{action:?}");
    }
    assert_eq!(after(Action::Fault { axis: 9 }), [well; AXES]);
}

#[test]
fn a_cut_bus_fails_until_it_is_repaired() {
    let mut drives = enabled();
    drives.act(Action::CutBus);
    assert_eq!(drives.exchange(&to(1.0)), Err(NoAnswer));
    assert_eq!(drives.observe(), Err(NoAnswer));
    drives.act(Action::Repair);
    assert!(drives.exchange(&to(1.0)).is_ok());
}

#[test]
fn only_drives_that_are_off_can_be_turned() {
    let turn = Action::Turn {
        axis: 2,
        position_rad: 0.7,
    };
    let mut drives = enabled();
    drives.act(turn);
    assert_eq!(drives.observe().unwrap()[2].position_rad, 0.0);
    drives.safe();
    drives.act(turn);
    let positions = drives.observe().unwrap().map(|axis| axis.position_rad);
    assert_eq!(positions, [0.0, 0.0, 0.7]);
}

#[test]
fn a_reset_ends_a_fault_and_no_other_trouble() {
    let mut drives = enabled();
    drives.act(Action::Fault { axis: 0 });
    drives.act(Action::SwitchOff { axis: 1 });
    drives.act(Action::Silence { axis: 2 });
    drives.reset_faults();
    let feedback = drives.exchange(&to(0.0)).unwrap();
    assert_eq!(
        feedback.map(|axis| (axis.status, axis.age_ticks)),
        [
            (DriveStatus::Enabled, 0),
            (DriveStatus::Disabled, 0),
            (DriveStatus::Enabled, 1)
        ]
    );
}

#[test]
fn set_points_are_shown_once() {
    let mut drives = enabled();
    assert_eq!(drives.take_sent(), Some(to(0.0)));
    assert_eq!(drives.take_sent(), None);
    drives.safe();
    assert_eq!(drives.take_sent(), None);
}

#[test]
fn no_record_is_too_long() {
    let longest = Record::Tick(TickRecord {
        tick: u32::MAX,
        state: State::Fault,
        path_ticks: u32::MAX,
        sent: Some([[f32::MAX; 3]; AXES]),
        to_setpoint_counts: u16::MAX,
        whole_counts: u16::MAX,
    });
    let mut buffer = [0; MAX_RECORD_BYTES];
    assert!(postcard::to_slice(&longest, &mut buffer).is_ok());
}

fn actions() -> impl Strategy<Value = Action> {
    let axis = 0u8..4;
    prop_oneof![
        Just(Action::Repair),
        Just(Action::Stop),
        Just(Action::CutBus),
        Just(Action::Overrun),
        Just(Action::Reset),
        Just(Action::MeasureStack),
        axis.clone().prop_map(|axis| Action::Fault { axis }),
        axis.clone().prop_map(|axis| Action::Block { axis }),
        (axis, any::<f32>().prop_filter("a number", |x| !x.is_nan()))
            .prop_map(|(axis, position_rad)| Action::Turn { axis, position_rad }),
    ]
}

proptest! {
    #[test]
    fn bytes_mean_what_was_meant(meant in prop::collection::vec(actions(), 0..20)) {
        let mut reader = ActionReader::default();
        let mut understood = Vec::new();
        for action in &meant {
            let mut buffer = [0; MAX_ACTION_BYTES];
            understood.extend(action.encode(&mut buffer).iter().filter_map(|&byte| reader.take(byte)));
        }
        prop_assert_eq!(understood, meant);
    }

    #[test]
    fn nonsense_is_forgotten(bytes in prop::collection::vec(any::<u8>(), 0..100)) {
        let mut reader = ActionReader::default();
        for byte in bytes {
            reader.take(byte);
        }
        // At most one action was begun.
        for _ in 0..MAX_ACTION_BYTES {
            reader.take(0);
        }
        let mut buffer = [0; MAX_ACTION_BYTES];
        let stop = Action::Stop.encode(&mut buffer);
        prop_assert_eq!(stop.iter().filter_map(|&byte| reader.take(byte)).last(), Some(Action::Stop));
    }
}
