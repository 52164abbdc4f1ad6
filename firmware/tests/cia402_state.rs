//! The state machine: all states, all transitions, the same in the board's table and in the
//! simulated drive; and back to Operation enabled from wherever a drive has gone.

mod cia402_sim;

use std::collections::BTreeSet;

use cia402_sim::drive::{Drive, Pds};
use cia402_sim::{START_COUNTS, one};
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::{Command, DriveState};

const STATES: [(Pds, DriveState); 8] = [
    (Pds::NotReady, DriveState::NotReadyToSwitchOn),
    (Pds::SwitchOnDisabled, DriveState::SwitchOnDisabled),
    (Pds::ReadyToSwitchOn, DriveState::ReadyToSwitchOn),
    (Pds::SwitchedOn, DriveState::SwitchedOn),
    (Pds::OperationEnabled, DriveState::OperationEnabled),
    (Pds::QuickStopActive, DriveState::QuickStopActive),
    (Pds::FaultReaction, DriveState::FaultReactionActive),
    (Pds::Fault, DriveState::Fault),
];

#[test]
fn every_statusword_is_one_state_or_none() {
    // The patterns of the profile: bits 6, 5, 3 to 0.
    let pattern = |statusword: u16| {
        let told = |mask, bits| statusword & mask == bits;
        Some(match () {
            () if told(0x4f, 0x00) => DriveState::NotReadyToSwitchOn,
            () if told(0x4f, 0x40) => DriveState::SwitchOnDisabled,
            () if told(0x6f, 0x21) => DriveState::ReadyToSwitchOn,
            () if told(0x6f, 0x23) => DriveState::SwitchedOn,
            () if told(0x6f, 0x27) => DriveState::OperationEnabled,
            () if told(0x6f, 0x07) => DriveState::QuickStopActive,
            () if told(0x4f, 0x0f) => DriveState::FaultReactionActive,
            () if told(0x4f, 0x08) => DriveState::Fault,
            () => return None,
        })
    };
    for statusword in 0..=u16::MAX {
        assert_eq!(
            DriveState::from_statusword(statusword),
            pattern(statusword),
            "{statusword:#x}"
        );
    }
    for (pds, state) in STATES {
        assert_eq!(DriveState::from_statusword(pds as u16), Some(state));
    }
}

#[test]
fn table_and_simulated_drive_agree_on_every_command_in_every_state() {
    let mut seen = BTreeSet::new();
    for (pds, state) in STATES {
        for command in Command::ALL {
            if command == Command::FaultReset && state != DriveState::Fault {
                // Its other bits would be another command.
                continue;
            }
            let mut drive = Drive::new(1, 1_270, START_COUNTS);
            drive.power_on();
            drive.traits.resumes = true;
            drive.state = pds;
            drive.transitions.clear();
            drive.command(command.controlword());
            let expected = state.after(command);
            let after = STATES
                .iter()
                .find(|(pds, _)| *pds == drive.state)
                .unwrap()
                .1;
            assert_eq!(
                after,
                expected.map_or(state, |(_, to)| to),
                "{state:?} {command:?}"
            );
            assert_eq!(
                drive.transitions.first().copied(),
                expected.map(|(number, _)| number),
                "{state:?} {command:?}"
            );
            seen.extend(drive.transitions);
        }
    }
    assert_eq!(
        seen.into_iter().collect::<Vec<_>>(),
        [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 15, 16]
    );
}

#[test]
fn commands_lead_to_operation_enabled_in_four_steps_and_never_out_of_a_fault() {
    for mut state in DriveState::ALL {
        let stuck = state.is_fault() || state == DriveState::NotReadyToSwitchOn;
        for _ in 0..4 {
            if let Some((_, to)) = state.after(state.towards_enabled()) {
                assert!(!stuck, "{state:?} is left by the drive alone");
                state = to;
            }
        }
        assert!(stuck || state == DriveState::OperationEnabled, "{state:?}");
    }
}

#[test]
fn a_drive_goes_through_every_transition_and_is_brought_back() {
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    // What someone at the drive's own panel may do, with the state it goes to at once.
    let local: [&[u16]; 6] = [
        &[0x07],             // 5
        &[0x06],             // 8
        &[0x00],             // 9
        &[0x02],             // 11, and 12 when it stands
        &[0x07, 0x06, 0x00], // 5, 6, 7
        &[0x07, 0x00],       // 5, 10
    ];
    for commands in local {
        let before = rig.drive(0, |drive| drive.counts());
        rig.drive(0, |drive| {
            for command in commands {
                drive.command(*command);
            }
        });
        let mut feedback = rig.exchange_where_they_stand();
        let mut was_disabled = false;
        for _ in 0..400 {
            was_disabled |= feedback[0].status == DriveStatus::Disabled;
            feedback = rig.exchange_where_they_stand();
        }
        assert!(was_disabled, "{commands:?} was told");
        assert_eq!(feedback[0].status, DriveStatus::Enabled, "{commands:?}");
        assert_eq!(rig.drive(0, |drive| drive.counts()), before, "no jump");
    }
    // A drive that stays in Quick stop active when it stands.
    rig.drive(0, |drive| {
        drive.traits.stays_in_quick_stop = true;
        drive.command(0x02);
    });
    for _ in 0..400 {
        rig.exchange_where_they_stand();
    }
    assert_eq!(rig.drive(0, |drive| drive.state), Pds::OperationEnabled);
    // Out of a quick stop straight back, as a drive may do it.
    rig.drive(0, |drive| {
        drive.traits.resumes = true;
        drive.command(0x02);
        drive.command(0x0f);
    });
    rig.off_for_ms(5);
    rig.drive(0, |drive| drive.fail(0x2310));
    rig.off_for_ms(20);
    rig.request_fault_reset();
    rig.off_for_ms(20);
    rig.enable();
    let gone: BTreeSet<u8> = rig.drive(0, |drive| drive.transitions.iter().copied().collect());
    assert_eq!(
        gone.into_iter().collect::<Vec<_>>(),
        (0..=16).collect::<Vec<_>>()
    );
}
