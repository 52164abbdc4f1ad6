//! Drives that work: set-up, enabling, motion, feedback, timing, load.

mod cia402_sim;

use cia402_sim::drive::{Drive, Nmt, Pds};
use cia402_sim::{
    COUNTS_PER_TURN, GEAR_RATIO, RATED_TORQUE_NM, Rig, START_COUNTS, TICK_US, angle_rad,
    axis_drive, every, one, three_on_one_bus, three_on_two_buses,
};
use stillpoint_firmware::cia402::{Cia402Group, GroupError};
use stillpoint_firmware::{DriveStatus, Setpoint};
use stillpoint_shared::DriveConfig;
use stillpoint_shared::drive_config::{AxisDrive, DriveConfigError, Mapping, bus_load_permille};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

#[test]
fn drives_come_up_are_enabled_where_they_stand_and_can_be_switched_off() {
    let mut rig = three_on_one_bus();
    let up_ms = rig.bring_up();
    assert!(up_ms < 300, "{up_ms} ms");
    let feedback = rig.off().unwrap();
    for axis in feedback {
        assert_eq!(axis.status, DriveStatus::Disabled);
        assert_eq!(axis.position_rad, angle_rad(START_COUNTS));
        assert_eq!(axis.velocity_rad_per_s, 0.0);
    }
    assert_eq!(rig.drives(|drive| drive.state), [Pds::SwitchOnDisabled; 3]);

    let enable_ms = rig.enable();
    assert!(enable_ms < 50, "{enable_ms} ms");
    assert_eq!(
        rig.drives(|drive| drive.counts()),
        [START_COUNTS; 3],
        "no jump"
    );
    rig.off_for_ms(5);
    let gone_through = rig.drives(|drive| drive.transitions.clone());
    assert_eq!(gone_through, [[0, 1, 2, 3, 4, 9]; 3]);
    assert_eq!(rig.report(0).to_string(), "switch on disabled");
}

#[test]
fn a_drive_is_told_what_the_table_says() {
    let mut rig = one();
    rig.bring_up();
    for (index, sub, value) in [
        (0x1017, 0, 50),
        (0x1016, 1, 127 << 16 | 150),
        (0x60c2, 1, 2),
        (0x60c2, 2, 0xfd),
        (0x6061, 0, 8),
        (0x1400, 1, 0x205),
        (0x1400, 2, 1),
        (0x1800, 1, 0x4000_0185),
        (0x1800, 2, 1),
        (0x1801, 1, 0xc000_0285),
    ] {
        let found = rig.drive(0, |drive| drive.dictionary.get(index, sub));
        assert_eq!(found, value, "{index:#06x}:{sub}");
    }
    let mapping = rig.drive(0, |drive| {
        [0x1600, 0x1a00].map(|at| drive.dictionary.mapping(at))
    });
    assert_eq!(mapping[0], [(0x6040, 0, 2), (0x607a, 0, 4), (0x60b2, 0, 2)]);
    assert_eq!(mapping[1], [(0x6041, 0, 2), (0x6064, 0, 4), (0x6061, 0, 1)]);
    assert_eq!(rig.drive(0, |drive| drive.nmt), Nmt::Operational);
}

#[test]
fn a_preset_mapping_is_left_alone() {
    let axis = AxisDrive {
        mapping: Mapping::Preset,
        ..axis_drive(0, 5)
    };
    let mut drive = Drive::new(5, 1_270, START_COUNTS);
    for (index, sub, value) in [
        (0x1400, 2, 1),
        (0x1600, 0, 3),
        (0x1600, 2, 0x607a_0020),
        (0x1600, 3, 0x60b2_0010),
        (0x1800, 2, 1),
        (0x1a00, 0, 3),
        (0x1a00, 2, 0x6064_0020),
        (0x1a00, 3, 0x6061_0008),
        (0x1801, 1, 0xc000_0285),
    ] {
        drive.dictionary.set(index, sub, value);
        drive.dictionary.refused.insert((index, sub), 0x0601_0000);
    }
    drive.power_on();
    let mut rig = Rig::<1, 1>::with(every(2_000), [axis], [vec![drive]]);
    rig.bring_up();
    rig.enable();
}

/// Set-points of a motion that each tick moves on, and the tick in which each was sent.
fn moved<const N: usize, const B: usize>(rig: &mut Rig<N, B>, ticks: u64) -> Vec<(u64, f32)> {
    let start_rad = angle_rad(START_COUNTS);
    let mut sent = Vec::new();
    for tick in 0..ticks {
        let setpoint = Setpoint {
            position_rad: start_rad + tick as f32 * 1e-5,
            velocity_rad_per_s: 0.04,
            torque_nm: 3.175,
        };
        rig.exchange(&[setpoint; N]).unwrap();
        sent.push((rig.now_us, setpoint.position_rad));
    }
    sent
}

/// The tick in which the set-point was sent that a drive moved to.
fn sent_at(sent: &[(u64, f32)], counts: i32) -> u64 {
    let target = |rad: f32| (f64::from(rad) / std::f64::consts::TAU * COUNTS_PER_TURN).round();
    let hit = sent
        .iter()
        .find(|(_, rad)| target(*rad) == f64::from(counts));
    hit.unwrap_or_else(|| panic!("{counts} was never a set-point"))
        .0
}

fn follows_in_step<const N: usize, const B: usize>(mut rig: Rig<N, B>) {
    rig.bring_up();
    rig.enable();
    rig.drives(|drive| drive.executed.clear());
    let cycle = rig.group.cycle();
    let sent = moved(&mut rig, 2_000);
    let executed = rig.drives(|drive| drive.executed.clone());
    assert_eq!(executed[0].len(), 2_000 / usize::from(cycle.ticks));
    for (cycles, first) in executed[0].iter().enumerate().skip(2) {
        let (at_us, counts) = *first;
        for other in &executed {
            assert_eq!(
                other[cycles].1, counts,
                "all axes move to set-points of the same tick"
            );
        }
        let waited_us = at_us - sent_at(&sent, counts);
        let lead_us = u64::from(cycle.lead_ticks) * TICK_US;
        // SYNC itself takes 55 µs, and may have to wait for a frame that has begun.
        assert!(
            (lead_us + 55..=lead_us + 190).contains(&waited_us),
            "{waited_us} µs"
        );
    }
    let thousandths = 3.175 / (GEAR_RATIO * RATED_TORQUE_NM) * 1e3;
    assert_eq!(
        rig.drives(|drive| drive.torque_offset),
        [thousandths.round() as i16; N]
    );
}

#[test]
fn three_axes_follow_in_step_on_one_bus_at_500_hz() {
    follows_in_step(three_on_one_bus());
}

#[test]
fn three_axes_follow_in_step_on_two_buses_at_1_khz() {
    follows_in_step(three_on_two_buses());
}

#[test]
fn the_bus_carries_what_the_documentation_says() {
    let load = |rig: &Rig<3, 1>| rig.wires[0].borrow().busy_us;
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    let before = load(&rig);
    rig.move_for_ms(1_000, 1e-6);
    let permille = (load(&rig) - before) / 1_000;
    let cyclic = u64::from(bus_load_permille(rig.config.bus(), 3));
    assert!(
        (cyclic - 1..=cyclic + 6).contains(&permille),
        "{permille} of 1000"
    );

    let mut rig = three_on_two_buses();
    rig.bring_up();
    rig.enable();
    let before = rig.wires.each_ref().map(|wire| wire.borrow().busy_us);
    rig.move_for_ms(1_000, 1e-6);
    for ((bus, wire), before) in rig.wires.iter().enumerate().zip(before) {
        let permille = (wire.borrow().busy_us - before) / 1_000;
        let cyclic = u64::from(bus_load_permille(rig.config.bus(), rig.config.axes_on(bus)));
        assert!(
            (cyclic - 1..=cyclic + 6).contains(&permille),
            "{permille} of 1000"
        );
    }
}

#[test]
fn feedback_tells_its_age_and_the_speed() {
    for (mut rig, most_ticks) in [(three_on_one_bus(), 10)] {
        rig.bring_up();
        rig.enable();
        let mut ages = Vec::new();
        let mut setpoint = Setpoint {
            position_rad: angle_rad(START_COUNTS),
            ..Setpoint::default()
        };
        for tick in 0..2_000 {
            setpoint.position_rad += 1e-5;
            let feedback = rig.exchange(&[setpoint; 3]).unwrap();
            ages.extend(feedback.map(|axis| axis.age_ticks));
            if tick < 100 {
                continue;
            }
            for axis in feedback {
                // 10 µrad per 250 µs, seen through increments of 1.9 µrad every 2 ms.
                assert!((axis.velocity_rad_per_s - 0.04).abs() < 1e-3, "{axis:?}");
                let lag_rad = setpoint.position_rad - axis.position_rad;
                let most_rad = 1e-5 * f32::from(rig.group.cycle().following_lag_ticks()) + 2e-6;
                assert!(
                    (0.0..=most_rad).contains(&lag_rad),
                    "{lag_rad} of {most_rad} rad"
                );
            }
        }
        let (least, most) = (ages.iter().min().unwrap(), ages.iter().max().unwrap());
        assert!(
            *least >= 1 && *most <= most_ticks,
            "{least} to {most} ticks"
        );
        assert_eq!(rig.group.cycle().feedback_age_ticks(0), most_ticks);
    }
}

#[test]
fn torque_and_position_that_do_not_fit_are_cut_and_counted() {
    let mut rig = one();
    rig.bring_up();
    rig.enable();
    let stands = Setpoint {
        position_rad: angle_rad(START_COUNTS),
        ..Setpoint::default()
    };
    let counters = |rig: &Rig<1, 1>| {
        let report = rig.report(0);
        (report.torque_saturated > 0, report.position_saturated > 0)
    };
    let run = |rig: &mut Rig<1, 1>, setpoint| {
        for _ in 0..16 {
            rig.exchange(&[setpoint]).unwrap();
        }
    };
    run(&mut rig, stands);
    assert_eq!(counters(&rig), (false, false));

    let torque_nm = -3.2 * GEAR_RATIO * RATED_TORQUE_NM;
    run(
        &mut rig,
        Setpoint {
            torque_nm,
            ..stands
        },
    );
    assert_eq!(rig.drive(0, |drive| drive.torque_offset), -3_000);
    assert_eq!(counters(&rig), (true, false));

    let target = START_COUNTS + 1_000;
    let away = Setpoint {
        position_rad: angle_rad(target),
        ..stands
    };
    run(&mut rig, away);
    for wrong in [f32::NAN, f32::INFINITY] {
        let setpoint = Setpoint {
            position_rad: wrong,
            torque_nm: wrong,
            ..stands
        };
        run(&mut rig, setpoint);
        let last = rig.drive(0, |drive| drive.executed.last().map(|(_, target)| *target));
        assert_eq!(last, Some(target), "the target stays where it was");
        assert_eq!(rig.drive(0, |drive| drive.torque_offset), 0);
    }
    assert_eq!(counters(&rig), (true, true));

    // After the axis was pushed, the target before is no longer that of the motion.
    rig.off_for_ms(10);
    rig.drive(0, |drive| drive.push(-500));
    rig.enable();
    let nowhere = Setpoint {
        position_rad: f32::NAN,
        ..stands
    };
    run(&mut rig, nowhere);
    assert_eq!(rig.drive(0, |drive| drive.counts()), target - 500);
}

#[test]
fn a_drive_that_does_not_tell_whether_it_follows_can_be_used() {
    let axis = AxisDrive {
        tells_following: false,
        ..axis_drive(0, 5)
    };
    let mut rig = Rig::<1, 1>::new(every(2_000), [axis]);
    rig.laws[0].tells_following = false;
    rig.drive(0, |drive| drive.traits.tells_following = false);
    rig.bring_up();
    rig.enable();
    rig.drive(0, |drive| drive.dictionary.set(0x6061, 0, 1));
    let mut feedback = rig.exchange_where_they_stand();
    for _ in 0..40 {
        feedback = rig.exchange_where_they_stand();
    }
    assert_eq!(
        feedback[0].status,
        DriveStatus::Disabled,
        "in another mode it does not follow"
    );
}

#[test]
fn drives_may_be_switched_on_after_the_board() {
    let drives = vec![
        Drive::new(1, 1_270, START_COUNTS),
        Drive::new(2, 1_270, START_COUNTS),
    ];
    let axes = [axis_drive(0, 1), axis_drive(0, 2)];
    let mut rig = Rig::<2, 1>::with(every(2_000), axes, [drives]);
    for _ in 0..4_000 {
        let _ = rig.off();
    }
    let nobody = rig.off().unwrap_err();
    assert_eq!(nobody.bus, 0);
    assert!(nobody.to_string().contains("check cabling"), "{nobody}");

    rig.drive(1, Drive::power_on);
    rig.off_for_ms(1_000);
    let [absent, present] = rig.off().unwrap();
    assert_eq!(
        (absent.age_ticks, present.status),
        (u16::MAX, DriveStatus::Disabled)
    );
    assert!(present.age_ticks <= 10);
    assert_eq!(
        rig.report(0).to_string(),
        "no answer to 1000h:00h: check the node id, the cabling and the drive's supply"
    );

    rig.drive(0, Drive::power_on);
    rig.bring_up();
    rig.enable();
}

#[test]
fn drives_stop_when_the_board_does() {
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    rig.wires[0].borrow_mut().advance(rig.now_us + 160_000);
    assert_eq!(rig.drives(|drive| drive.state), [Pds::Fault; 3]);
    assert_eq!(
        rig.drives(|drive| drive.dictionary.get(0x603f, 0)),
        [0x8130; 3]
    );
}

#[test]
fn a_group_is_made_only_of_what_fits() {
    let three = [1, 2, 3].map(|node| axis_drive(0, node));
    let config = DriveConfig::new(every(2_000), &three).unwrap();
    let ports = || {
        Rig::<1, 1>::new(every(2_000), [axis_drive(0, 1)])
            .wires
            .map(cia402_sim::wire::Port)
    };
    let made = |config, tick| Cia402Group::<3, _>::new(config, ports(), tick).map(|_| ());
    assert_eq!(made(&config, DRIVE_PERIOD_TICKS), Ok(()));
    assert_eq!(
        made(&config, 3_000),
        Err(GroupError::Config(DriveConfigError::NotTicks {
            period_us: 2_000,
            tick_ticks: 3_000
        }))
    );
    let two = DriveConfig::new(every(2_000), &three[..2]).unwrap();
    assert_eq!(
        made(&two, DRIVE_PERIOD_TICKS),
        Err(GroupError::Axes {
            config: 2,
            group: 3
        })
    );
    let apart = [axis_drive(0, 1), axis_drive(1, 1), axis_drive(0, 2)];
    let apart = DriveConfig::new(every(2_000), &apart).unwrap();
    assert_eq!(
        made(&apart, DRIVE_PERIOD_TICKS),
        Err(GroupError::Buses {
            config: 2,
            group: 1
        })
    );
}
