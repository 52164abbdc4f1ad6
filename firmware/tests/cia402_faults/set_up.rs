//! Drives that refuse their set-up, or are not what they should be.

use crate::cia402_sim::drive::{Drive, Pds};
use crate::cia402_sim::{Rig, START_COUNTS, axis_drive, every, one, three_on_one_bus};
use crate::{fault, statuses};
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::{Stage, Trouble};
use stillpoint_shared::drive_config::BusConfig;
use stillpoint_shared::drive_error::seen;

#[test]
fn every_refused_object_is_named_with_the_reason() {
    let objects = [
        (0x1000, 0),
        (0x6040, 0),
        (0x6076, 0),
        (0x1017, 0),
        (0x1016, 1),
        (0x60c2, 1),
        (0x60c2, 2),
        (0x6060, 0),
        (0x1400, 1),
        (0x1400, 2),
        (0x1600, 0),
        (0x1600, 1),
        (0x1600, 2),
        (0x1600, 3),
        (0x1800, 1),
        (0x1800, 2),
        (0x1a00, 0),
        (0x1a00, 1),
        (0x1a00, 2),
        (0x1a00, 3),
        (0x1801, 1),
    ];
    for (index, sub) in objects {
        let mut rig = one();
        rig.drive(0, |drive| {
            drive.dictionary.refused.insert((index, sub), 0x0800_0022)
        });
        assert_eq!(
            statuses(rig.off_for_ms(400)),
            [fault(seen::REFUSED)],
            "{index:04x}"
        );
        let trouble = rig.report(0).trouble.unwrap().to_string();
        let expected = format!(
            "the drive refuses object {index:04X}h:{sub:02X}h: the drive's state does not allow it (08000022h)"
        );
        assert!(trouble.starts_with(&expected), "{trouble}");

        // It is not asked again by itself.
        let before = rig.taken().iter().filter(|frame| frame.id == 0x605).count();
        rig.off_for_ms(500);
        assert_eq!(
            rig.taken().iter().filter(|frame| frame.id == 0x605).count(),
            before
        );
        rig.drive(0, |drive| drive.dictionary.refused.clear());
        rig.request_fault_reset();
        rig.bring_up();
    }
}

#[test]
fn what_a_drive_may_lack_it_may_lack_and_the_rest_not() {
    for (index, may) in [
        (0x6076, true),
        (0x1801, true),
        (0x1016, false),
        (0x60c2, false),
        (0x60b2, false),
    ] {
        let mut rig = one();
        rig.drive(0, |drive| drive.dictionary.lacks(index));
        let expected = if may {
            DriveStatus::Disabled
        } else {
            fault(seen::REFUSED)
        };
        assert_eq!(statuses(rig.off_for_ms(400)), [expected], "{index:04x}");
        assert_eq!(rig.report(0).stage == Stage::Operational, may);
    }
    // An object that is shorter than the profile says is read for what it has.
    let mut rig = one();
    rig.drive(0, |drive| drive.dictionary.resize(0x6076, 0, 2));
    rig.bring_up();

    let bus = BusConfig {
        controller_node: 0,
        ..every(2_000)
    };
    let mut rig = Rig::<1, 1>::new(bus, [axis_drive(0, 5)]);
    rig.drive(0, |drive| drive.dictionary.lacks(0x1016));
    rig.bring_up();
    assert!(
        rig.taken().iter().all(|frame| frame.id < 0x700),
        "no heartbeat of the board"
    );
}

#[test]
fn a_mode_that_is_not_taken_up_is_told_and_never_enabled() {
    let mut rig = one();
    rig.drive(0, |drive| drive.traits.stubborn_mode = Some(1));
    assert_eq!(statuses(rig.off_for_ms(900)), [fault(seen::MODE)]);
    assert_eq!(rig.report(0).trouble, Some(Trouble::Mode { shown: 1 }));

    // Enabled already, and then it leaves the mode.
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| drive.dictionary.set(0x6061, 0, 3));
    let mut feedback = rig.exchange_where_they_stand();
    for _ in 0..40 {
        feedback = rig.exchange_where_they_stand();
    }
    assert_eq!(statuses(feedback), [DriveStatus::Disabled]);
    assert_eq!(rig.drive(0, |drive| drive.state), Pds::SwitchOnDisabled);
}

#[test]
fn a_drive_that_is_switched_on_late_is_set_up_without_a_clear() {
    let mut rig = three_on_one_bus();
    rig.drive(1, |drive| drive.power_off());
    let silent = statuses(rig.off_for_ms(1_000));
    let off = DriveStatus::Disabled;
    assert_eq!(silent, [off, fault(seen::NO_ANSWER), off]);
    rig.drive(1, |drive| drive.power_on());
    assert_eq!(statuses(rig.off_for_ms(1_000)), [off; 3]);
    assert_eq!(rig.report(1).stage, Stage::Operational);
}

#[test]
fn a_wrong_node_id_a_wrong_device_and_a_wrong_motor_are_told_apart() {
    let mut rig = Rig::<1, 1>::with(
        every(2_000),
        [axis_drive(0, 5)],
        [vec![{
            let mut drive = Drive::new(6, 1_270, START_COUNTS);
            drive.power_on();
            drive
        }]],
    );
    let feedback = rig.off_for_ms(1_000);
    assert_eq!(
        (feedback[0].age_ticks, feedback[0].status),
        (u16::MAX, fault(seen::NO_ANSWER))
    );
    assert!(
        rig.report(0)
            .to_string()
            .starts_with("no answer to 1000h:00h")
    );
    let commands = rig.taken().iter().filter(|frame| frame.id == 0).count();
    assert!(
        (3..=5).contains(&commands),
        "looked for every 300 ms: {commands}"
    );
    assert!(
        rig.group.traffic(0).unwrap().foreign > 0,
        "node 6 was heard"
    );
    assert_eq!(rig.group.traffic(1), None);

    let mut rig = one();
    rig.drive(0, |drive| drive.dictionary.set(0x1000, 0, 0x000f_0191));
    assert_eq!(statuses(rig.off_for_ms(300)), [fault(seen::NOT_A_DRIVE)]);
    let device_type = 0x000f_0191;
    assert_eq!(
        rig.report(0).trouble,
        Some(Trouble::NotADrive { device_type })
    );
    let written = rig
        .taken()
        .iter()
        .any(|frame| frame.id == 0x605 && frame.data()[0] != 0x40);
    assert!(!written, "nothing is written to what is no drive");

    let mut rig = one();
    rig.drive(0, |drive| drive.dictionary.set(0x6076, 0, 2_390));
    assert_eq!(statuses(rig.off_for_ms(300)), [fault(seen::RATED_TORQUE)]);
    let trouble = rig.report(0).trouble.unwrap().to_string();
    assert!(
        trouble.contains("1.27 N·m in the configuration and 2.39 N·m in the drive"),
        "{trouble}"
    );
}
