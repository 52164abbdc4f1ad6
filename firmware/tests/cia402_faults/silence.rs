//! Feedback that is missing, wires that are cut, frames of others.

use crate::cia402_sim::drive::Pds;
use crate::cia402_sim::wire::{Raw, TestFrame};
use crate::cia402_sim::{
    Rig, TICK_US, axis_drive, every, one, three_on_one_bus, three_on_two_buses,
};
use crate::{fault, statuses};
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::{CanFrame, Trouble};
use stillpoint_shared::drive_config::{AxisDrive, Mapping};
use stillpoint_shared::drive_error::seen;

#[test]
fn feedback_that_is_missing_or_mapped_otherwise_is_told() {
    let mut rig = one();
    rig.drive(0, |drive| drive.traits.sends_feedback = false);
    assert_eq!(statuses(rig.off_for_ms(900)), [fault(seen::NO_FEEDBACK)]);
    assert_eq!(rig.report(0).trouble, Some(Trouble::NoFeedback));
    // The command to start may be lost, so it is given again every 100 ms for half a second.
    let is_start = |frame: &&Raw| frame.id == 0 && frame.data() == [1, 5];
    let starts = rig.taken().iter().filter(is_start).count();
    assert!((5..=6).contains(&starts), "{starts}");

    let axis = AxisDrive {
        mapping: Mapping::Preset,
        ..axis_drive(0, 5)
    };
    let mut rig = Rig::<1, 1>::new(every(2_000), [axis]);
    rig.drive(0, |drive| drive.dictionary.set(0x1800, 2, 1));
    assert_eq!(
        statuses(rig.off_for_ms(400)),
        [fault(seen::FEEDBACK_LENGTH)]
    );
    assert_eq!(
        rig.report(0).trouble,
        Some(Trouble::FeedbackLength { bytes: 2 })
    );
}

#[test]
fn a_silent_axis_is_switched_off_while_the_others_go_on() {
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    rig.drive(1, |drive| drive.traits.sends_feedback = false);
    let mut feedback = rig.exchange_where_they_stand();
    let mut age_ticks = 0;
    for _ in 0..60 {
        feedback = rig.exchange_where_they_stand();
        if feedback[1].status == DriveStatus::Enabled {
            age_ticks = age_ticks.max(feedback[1].age_ticks);
        }
    }
    assert_eq!(age_ticks, rig.group.cycle().feedback_age_ticks(3));
    assert_eq!(
        statuses(feedback),
        [
            DriveStatus::Enabled,
            DriveStatus::Disabled,
            DriveStatus::Enabled
        ]
    );
    assert_eq!(rig.drive(1, |drive| drive.state), Pds::SwitchOnDisabled);

    // It does not come back by itself if that lasts.
    rig.off_for_ms(600);
    rig.drive(1, |drive| drive.traits.sends_feedback = true);
    assert_eq!(statuses(rig.off_for_ms(100))[1], fault(seen::NO_FEEDBACK));
    assert_eq!(rig.report(1).trouble, Some(Trouble::NoFeedback));
    rig.request_fault_reset();
    rig.bring_up();
    rig.enable();
}

#[test]
fn a_cut_wire_is_told_within_two_cycles_and_healed() {
    let mut rig = three_on_two_buses();
    rig.bring_up();
    rig.enable();
    rig.wires[1].borrow_mut().is_cut = true;
    let mut ticks = 0;
    let stuck = loop {
        let stands = Rig::<3, 2>::stay(&rig.standing());
        match rig.exchange(&stands) {
            Ok(_) => ticks += 1,
            Err(stuck) => break stuck,
        }
        assert!(ticks < 100);
    };
    assert_eq!(stuck.bus, 1);
    assert!(ticks <= 3 * 4 + 4, "{ticks} ticks");
    rig.safe();
    rig.wires[1].borrow_mut().is_cut = false;
    rig.off_for_ms(400);
    rig.request_fault_reset();
    rig.bring_up();
    rig.enable();
}

/// Makes safe so many ticks after the motion, and waits until the torque is off.
fn switched_off<const N: usize>(extra_ticks: u16) {
    let axes = std::array::from_fn(|axis| axis_drive(0, axis as u8 + 1));
    let mut rig = Rig::<N, 1>::new(every(2_000), axes);
    rig.bring_up();
    rig.enable();
    rig.move_for_ms(20, 1e-6);
    for _ in 0..extra_ticks {
        rig.exchange_where_they_stand();
    }
    let taken = rig.taken().len();
    rig.safe();
    let since_us = rig.now_us;
    while rig.drives(|drive| drive.state) != [Pds::SwitchOnDisabled; N] {
        rig.off().unwrap();
    }
    let cycle = rig.group.cycle();
    // And the tick in which it is seen here, SYNC and a frame that had begun.
    let most_ticks = u64::from(cycle.lead_ticks + cycle.lead_ticks.max(cycle.reply_ticks)) + 1;
    let ticks = (rig.now_us - since_us) / TICK_US;
    assert!(
        ticks <= most_ticks,
        "{ticks} of {most_ticks} ticks, {extra_ticks} on"
    );
    for node in 1..=N as u16 {
        let mut later = rig.taken()[taken..].to_vec().into_iter();
        let first = later.find(|frame| frame.id == 0x200 + node);
        assert_eq!(first.unwrap().data()[..2], [0, 0], "the very next frame");
    }
}

#[test]
fn safe_takes_the_torque_away_in_less_than_a_cycle_from_any_tick() {
    for extra_ticks in 0..9 {
        switched_off::<3>(extra_ticks);
        switched_off::<5>(extra_ticks);
    }
}

#[test]
fn frames_of_others_and_an_overrun_do_nothing_but_count() {
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| {
        for id in [0x001, 0x080, 0x17f, 0x186, 0x285, 0x586, 0x706, 0x7ff] {
            drive.outgoing.push_back(Raw::new(id, &[0xff; 8]));
        }
        // Its own, of wrong lengths, and answers to nothing.
        drive.outgoing.push_back(Raw::new(0x085, &[]));
        drive.outgoing.push_back(Raw::new(0x705, &[]));
        drive.outgoing.push_back(Raw::new(0x585, &[0x60; 8]));
        drive.outgoing.push_back(Raw::new(0x585, &[0x60; 3]));
    });
    let feedback = rig.move_for_ms(20, 1e-6);
    assert_eq!(statuses(feedback), [DriveStatus::Enabled]);
    let traffic = rig.group.traffic(0).unwrap();
    assert_eq!((traffic.foreign, traffic.overruns), (8, 0));

    for remote in [false, true] {
        assert_eq!(CanFrame::received(&TestFrame::foreign(remote)), None);
    }

    // Nobody fetches for 20 ms.
    for _ in 0..80 {
        rig.now_us += TICK_US;
        rig.wires[0].borrow_mut().advance(rig.now_us);
        rig.drive(0, |drive| {
            drive.outgoing.push_back(Raw::new(0x085, &[0; 8]))
        });
    }
    let feedback = rig.move_for_ms(20, 1e-6);
    assert_eq!(statuses(feedback), [DriveStatus::Enabled]);
    assert_eq!(rig.group.traffic(0).unwrap().overruns, 1);
}
