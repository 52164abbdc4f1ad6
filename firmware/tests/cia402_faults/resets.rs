//! Faults that drives latch themselves: told, ending all motion, and reset on request only.

use crate::cia402_sim::drive::{Drive, Pds};
use crate::cia402_sim::wire::{Fate, Raw};
use crate::cia402_sim::{Rig, START_COUNTS, axis_drive, every, one, three_on_one_bus};
use crate::{fault, statuses, ticks_to_fault};
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::Stage;
use stillpoint_shared::drive_error;

#[test]
fn a_fault_at_any_time_is_told_and_ends_all_motion_until_a_reset() {
    // From the start of the set-up to well into the motion.
    for at_ms in (0..400).step_by(7) {
        let mut rig = three_on_one_bus();
        let mut up = false;
        let mut feedback = None;
        for ms in 0..440 {
            if ms == at_ms {
                rig.drive(1, |drive| drive.fail(0x3210));
            }
            if !up {
                feedback = Some(rig.off_for_ms(1));
                up = (0..3).all(|axis| rig.report(axis).stage == Stage::Operational);
            } else if rig.drive(1, |drive| drive.state) != Pds::Fault {
                feedback = Some(rig.move_for_ms(1, 1e-6));
            } else {
                rig.exchange_where_they_stand();
                rig.safe();
                feedback = Some(rig.off_for_ms(1));
            }
        }
        let stands = rig.drive(1, |drive| drive.executed.len());
        rig.off_for_ms(200);
        assert_eq!(
            statuses(feedback.unwrap())[1],
            fault(0x3210),
            "at {at_ms} ms"
        );
        assert_eq!(rig.drive(1, |drive| drive.executed.len()), stands);
        assert_eq!(
            rig.drive(1, |drive| drive.state),
            Pds::Fault,
            "at {at_ms} ms"
        );
        assert_eq!(
            rig.report(1).to_string(),
            "fault; error 0x3210, DC link over-voltage"
        );

        rig.request_fault_reset();
        assert_eq!(statuses(rig.off_for_ms(20)), [DriveStatus::Disabled; 3]);
        assert_eq!(rig.report(1).error_code, 0);
        rig.enable();
    }
}

#[test]
fn a_reset_is_one_edge_per_request_and_none_if_the_cause_is_still_there() {
    let mut rig = one();
    rig.bring_up();
    rig.drive(0, |drive| {
        drive.traits.cause_persists = true;
        drive.fail(0x4310);
    });
    rig.off_for_ms(20);
    let edges = |rig: &Rig<1, 1>| {
        let words = rig.taken().into_iter().filter(|frame| frame.id == 0x205);
        let high: Vec<bool> = words.map(|frame| frame.data()[0] & 0x80 != 0).collect();
        high.windows(2).filter(|pair| !pair[0] && pair[1]).count()
    };
    assert_eq!(edges(&rig), 0);
    for request in 1..=3 {
        rig.request_fault_reset();
        assert_eq!(statuses(rig.off_for_ms(300)), [fault(0x4310)]);
        assert_eq!(edges(&rig), request);
    }
    rig.drive(0, |drive| drive.traits.cause_persists = false);
    rig.off_for_ms(300);
    assert_eq!(
        rig.drive(0, |drive| drive.state),
        Pds::Fault,
        "no reset by itself"
    );
    rig.drive(0, |drive| drive.traits.cause_persists = true);
    rig.request_fault_reset();
    rig.off_for_ms(20);
    rig.drive(0, |drive| drive.traits.cause_persists = false);
    rig.request_fault_reset();
    assert_eq!(
        statuses(rig.off_for_ms(20)),
        [DriveStatus::Disabled],
        "a second edge"
    );

    rig.drive(0, |drive| drive.fail(0x4310));
    rig.off_for_ms(300);
    assert_eq!(
        rig.drive(0, |drive| drive.state),
        Pds::Fault,
        "the next fault needs the next request"
    );
}

#[test]
fn a_reset_works_though_messages_are_lost_and_is_refused_while_drives_are_on() {
    for lost in 0..5 {
        let mut rig = three_on_one_bus();
        rig.bring_up();
        rig.drive(2, |drive| drive.fail(0x2310));
        rig.off_for_ms(20);
        let mut left = lost;
        rig.fates(move |frame, _| {
            let reset = frame.id == 0x203 && frame.data()[0] & 0x80 != 0;
            if reset && left > 0 {
                left -= 1;
                return Fate::Lost;
            }
            Fate::Arrives
        });
        rig.request_fault_reset();
        assert_eq!(
            statuses(rig.off_for_ms(30)),
            [DriveStatus::Disabled; 3],
            "{lost} lost"
        );
    }

    let mut rig = one();
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| drive.fail(0x2310));
    for _ in 0..80 {
        rig.exchange_where_they_stand();
        rig.group.request_fault_reset();
    }
    rig.off_for_ms(100);
    assert_eq!(rig.drive(0, |drive| drive.state), Pds::Fault);
}

#[test]
fn a_drive_that_comes_up_in_fault_stays_there_until_a_reset() {
    let mut drive = Drive::new(5, 1_270, START_COUNTS);
    drive.traits.fault_at_boot = Some(0x7305);
    drive.power_on();
    let mut rig = Rig::<1, 1>::with(every(2_000), [axis_drive(0, 5)], [vec![drive]]);
    rig.request_fault_reset();
    rig.bring_up();
    // The request was before it was known to be in a fault. The emergency message came before the set-up; the code is read.
    assert_eq!(statuses(rig.off_for_ms(500)), [fault(0x7305)]);
    assert_eq!(rig.drive(0, |drive| drive.state), Pds::Fault);
    rig.request_fault_reset();
    assert_eq!(statuses(rig.off_for_ms(20)), [DriveStatus::Disabled]);
    rig.enable();
}

#[test]
fn the_code_is_read_if_the_emergency_message_is_lost() {
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    rig.fates(|frame, _| match frame.id {
        0x085 => Fate::Lost,
        _ => Fate::Arrives,
    });
    rig.drive(0, |drive| drive.fail(0x8611));
    let (ticks, code) = ticks_to_fault(&mut rig, 0);
    assert!(ticks <= 16, "{ticks} ticks");
    assert_eq!(code, drive_error::GENERIC);
    rig.safe();
    assert_eq!(statuses(rig.off_for_ms(20)), [fault(0x8611)]);

    // So is that of the next fault.
    rig.request_fault_reset();
    rig.off_for_ms(20);
    assert_eq!(rig.report(0).error_code, 0);
    rig.drive(0, |drive| drive.fail(0x2310));
    assert_eq!(statuses(rig.off_for_ms(20)), [fault(0x2310)]);

    // A drive that has none is asked once.
    rig.request_fault_reset();
    rig.off_for_ms(20);
    rig.drive(0, |drive| {
        drive.dictionary.lacks(0x603f);
        drive.fail(0x2310);
    });
    let asked = |rig: &Rig<1, 1>| rig.taken().iter().filter(|frame| frame.id == 0x605).count();
    let before = asked(&rig);
    assert_eq!(statuses(rig.off_for_ms(500)), [fault(drive_error::GENERIC)]);
    assert_eq!(asked(&rig), before + 1);
}

#[test]
fn warnings_are_no_faults_and_do_not_hide_the_next_cause() {
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| {
        let warning = [0x20, 0x81, 0x10, 0, 0, 0, 0, 0];
        drive.outgoing.push_back(Raw::new(0x085, &warning));
    });
    let feedback = rig.move_for_ms(10, 1e-6);
    assert_eq!(statuses(feedback), [DriveStatus::Enabled]);
    assert_eq!(rig.report(0).error_code, 0x8120);
    rig.drive(0, |drive| drive.fail(0x2320));
    assert_eq!(ticks_to_fault(&mut rig, 0).1, 0x2320);
    rig.safe();
    rig.drive(0, |drive| {
        let consequence = [0x20, 0x32, 0x05, 0, 0, 0, 0, 0];
        drive.outgoing.push_back(Raw::new(0x085, &consequence));
    });
    assert_eq!(statuses(rig.off_for_ms(20)), [fault(0x2320)]);
}
