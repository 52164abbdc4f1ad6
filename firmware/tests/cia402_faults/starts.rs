//! Heartbeats that fail, and drives that start anew.

use crate::cia402_sim::drive::Pds;
use crate::cia402_sim::wire::{Fate, Raw};
use crate::cia402_sim::{START_COUNTS, one, three_on_one_bus};
use crate::{fault, statuses, ticks_to_fault};
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::{NmtState, Stage, Trouble};
use stillpoint_shared::drive_error::seen;

#[test]
fn a_drive_without_heartbeat_is_lost_and_is_set_up_anew_only_on_request() {
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    rig.drive(2, |drive| drive.traits.sends_heartbeats = false);
    let (ticks, code) = ticks_to_fault(&mut rig, 2);
    // 150 ms after the last one, which was 50 ms ago at most.
    assert!((400..=608).contains(&ticks), "{ticks} ticks");
    assert_eq!(code, seen::HEARTBEAT_LOST);
    assert_eq!(
        rig.report(2).trouble,
        Some(Trouble::HeartbeatLost { timeout_ms: 150 })
    );
    // Set-points that go on do not move it.
    rig.move_for_ms(5, 1e-6);
    rig.safe();
    rig.drive(2, |drive| {
        drive.power_off();
        drive.power_on();
    });
    rig.off_for_ms(50);
    let first = Trouble::HeartbeatLost { timeout_ms: 150 };
    assert_eq!(rig.report(2).trouble, Some(first), "the first cause stays");
    rig.drive(2, |drive| drive.traits.sends_heartbeats = true);
    assert_eq!(
        statuses(rig.off_for_ms(500))[2],
        fault(seen::HEARTBEAT_LOST)
    );
    assert_eq!(rig.drive(2, |drive| drive.state), Pds::SwitchOnDisabled);
    rig.request_fault_reset();
    rig.bring_up();
    rig.enable();
}

#[test]
fn a_drive_that_starts_anew_is_not_used_as_if_nothing_had_been() {
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| {
        drive.power_off();
        drive.push(5_000);
        drive.power_on();
    });
    assert_eq!(ticks_to_fault(&mut rig, 0).1, seen::RESTARTED);
    assert_eq!(rig.report(0).trouble, Some(Trouble::Restarted));
    rig.move_for_ms(5, 1e-6);
    rig.safe();
    rig.off_for_ms(100);
    rig.request_fault_reset();
    let feedback = rig.off().unwrap();
    assert_eq!(
        feedback[0].age_ticks,
        u16::MAX,
        "what it said before no longer counts"
    );
    rig.bring_up();
    rig.enable();
    assert_eq!(rig.drive(0, |drive| drive.counts()), START_COUNTS + 5_000);
}

#[test]
fn a_drive_that_starts_anew_while_it_is_set_up_is_set_up_from_the_beginning() {
    for at_ms in (21..240).step_by(10) {
        for boot_up_is_lost in [false, true] {
            let mut rig = one();
            rig.off_for_ms(at_ms);
            rig.fates(move |frame, _| match frame.id {
                0x705 if boot_up_is_lost && frame.data() == [0] => Fate::Lost,
                _ => Fate::Arrives,
            });
            if rig.report(0).stage == Stage::Operational {
                continue;
            }
            rig.drive(0, |drive| {
                if boot_up_is_lost {
                    // Longer than three requests wait for their answers.
                    drive.traits.boot_us = 400_000;
                }
                drive.power_off();
                drive.power_on();
            });
            rig.bring_up();
            rig.enable();
        }
    }
}

#[test]
fn answers_to_other_requests_are_none_to_this_one() {
    let mut rig = one();
    for _ in 0..4_000 {
        rig.drive(0, |drive| {
            // Refused, and written, for objects that were not asked for.
            for (command, index) in [(0x80, 0x2000u16), (0x60, 0x6040), (0x4f, 0x6041)] {
                let [low, high] = index.to_le_bytes();
                let answer = [command, low, high, 9, 0, 0, 2, 6];
                drive.outgoing.push_back(Raw::new(0x585, &answer));
            }
        });
        for _ in 0..3 {
            let _ = rig.off();
        }
        if rig.report(0).stage == Stage::Operational {
            rig.off_for_ms(5);
            rig.enable();
            return;
        }
    }
    panic!("{}", rig.report(0));
}

#[test]
fn a_heartbeat_from_before_the_start_is_no_sign_of_a_stop() {
    let mut rig = one();
    let is_start = |frame: &Raw| frame.id == 0x000 && frame.data()[0] == 0x01;
    while !rig.taken().iter().any(is_start) {
        let _ = rig.off();
    }
    while rig.report(0).stage != Stage::Operational {
        let _ = rig.off();
    }
    rig.drive(0, |drive| {
        drive.outgoing.push_back(Raw::new(0x705, &[0x7f]))
    });
    assert_eq!(statuses(rig.off_for_ms(1)), [DriveStatus::Disabled]);
    assert_eq!(rig.report(0).nmt, Some(NmtState::PreOperational));
    rig.off_for_ms(100);
    assert_eq!(rig.report(0).nmt, Some(NmtState::Operational));
}

#[test]
fn a_drive_that_is_stopped_by_another_master_is_told() {
    let mut rig = one();
    rig.bring_up();
    rig.off_for_ms(100);
    rig.drive(0, |drive| drive.receive(&Raw::new(0x000, &[0x02, 5])));
    assert_eq!(
        statuses(rig.off_for_ms(100)),
        [fault(seen::NOT_OPERATIONAL)]
    );
    let state = NmtState::Stopped;
    assert_eq!(
        rig.report(0).trouble,
        Some(Trouble::NotOperational { state })
    );
    rig.request_fault_reset();
    rig.bring_up();
}
