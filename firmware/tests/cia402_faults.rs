//! Drives that fail and messages that do not arrive: what the executor is told, what the drives are
//! told, and that nothing comes back by itself.

mod cia402_sim;

use cia402_sim::drive::{Drive, Pds};
use cia402_sim::wire::{Fate, Raw, TestFrame};
use cia402_sim::{
    Rig, START_COUNTS, TICK_US, axis_drive, every, one, three_on_one_bus, three_on_two_buses,
};
use stillpoint_firmware::cia402::{CanFrame, NmtState, Stage, Trouble};
use stillpoint_firmware::{DriveStatus, Feedback};
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, Mapping};
use stillpoint_shared::drive_error::{self, seen};

fn statuses<const N: usize>(feedback: [Feedback; N]) -> [DriveStatus; N] {
    feedback.map(|feedback| feedback.status)
}

const fn fault(code: u16) -> DriveStatus {
    DriveStatus::Fault { code }
}

/// Ticks until an axis reports a fault, with the others held where they are; and its code.
fn ticks_to_fault<const N: usize, const B: usize>(rig: &mut Rig<N, B>, axis: usize) -> (u64, u16) {
    let since_us = rig.now_us;
    let mut feedback = rig.exchange_where_they_stand();
    for _ in 0..4_000 {
        if let DriveStatus::Fault { code } = feedback[axis].status {
            return ((rig.now_us - since_us) / TICK_US, code);
        }
        feedback = rig.exchange(&Rig::<N, B>::stay(&feedback)).unwrap();
    }
    panic!("no fault");
}

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
