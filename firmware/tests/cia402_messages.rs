//! Messages that are lost, come twice or late, kind by kind; and drives and messages that do at
//! random whatever they like. The laws of `cia402_sim::laws` are checked in every tick.

mod cia402_sim;

use std::collections::BTreeMap;

use cia402_sim::drive::{Drive, Nmt, Pds};
use cia402_sim::wire::{Fate, Raw};
use cia402_sim::{Rig, three_on_one_bus};
use proptest::prelude::*;
use stillpoint_firmware::DriveStatus;
use stillpoint_firmware::cia402::Stage;

/// Kinds of messages by identifier, and whether the board sends them.
const KINDS: [(&str, u16, bool); 9] = [
    ("network management", 0x000, true),
    ("SYNC", 0x080, true),
    ("emergency", 0x080, false),
    ("feedback", 0x180, false),
    ("set-points", 0x200, true),
    ("SDO answer", 0x580, false),
    ("SDO request", 0x600, true),
    ("heartbeat", 0x700, false),
    ("the board's heartbeat", 0x700, true),
];

fn is_kind(frame: &Raw, from_board: bool, kind: (&str, u16, bool)) -> bool {
    frame.id & 0x780 == kind.1 && from_board == kind.2
}

/// Of every identifier of a kind, every third message meets a fate.
fn every_third(rig: &mut Rig<3, 1>, kind: (&'static str, u16, bool), fate: Fate) {
    let mut counts = BTreeMap::<u16, u32>::new();
    rig.fates(move |frame, from_board| {
        if !is_kind(frame, from_board, kind) {
            return Fate::Arrives;
        }
        let count = counts.entry(frame.id).or_default();
        *count += 1;
        if count.is_multiple_of(3) {
            fate
        } else {
            Fate::Arrives
        }
    });
}

/// Knuth's and Lewis' generator.
struct Random(u32);

impl Random {
    fn below(&mut self, end: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 16) % end
    }
}

#[test]
fn no_kind_of_message_is_indispensable() {
    for kind in KINDS {
        for fate in [Fate::Lost, Fate::Twice, Fate::Late(700), Fate::Late(5_000)] {
            let mut rig = three_on_one_bus();
            every_third(&mut rig, kind, fate);
            rig.bring_up();
            rig.enable();
            let mut oldest_ticks = 0;
            let mut setpoints = Rig::<3, 1>::stay(&rig.standing());
            for _ in 0..2_000 {
                for setpoint in &mut setpoints {
                    setpoint.position_rad += 1e-6;
                }
                for axis in rig.exchange(&setpoints).unwrap() {
                    assert_eq!(axis.status, DriveStatus::Enabled, "{kind:?} {fate:?}");
                    let speed = axis.velocity_rad_per_s;
                    // 4 mrad/s in increments of 1 mrad/s; what was lost or late is made up for,
                    // and what overtakes goes back.
                    let most = if fate == Fate::Twice { 0.006 } else { 0.1 };
                    let least = if matches!(fate, Fate::Late(_)) {
                        -0.1
                    } else {
                        -1e-3
                    };
                    assert!((least..=most).contains(&speed), "{kind:?} {fate:?} {speed}");
                    oldest_ticks = oldest_ticks.max(axis.age_ticks);
                }
            }
            // The set-points of the last cycles may not have come.
            let behind_rad = rig
                .drives(|drive| setpoints[0].position_rad - cia402_sim::angle_rad(drive.counts()));
            for behind_rad in behind_rad {
                assert!(
                    (0.0..60e-6).contains(&behind_rad),
                    "{kind:?} {fate:?} {behind_rad}"
                );
            }
            let most_ticks = rig.group.cycle().feedback_age_ticks(2);
            assert!(
                oldest_ticks <= most_ticks,
                "{kind:?} {fate:?} {oldest_ticks} ticks"
            );
        }
    }
}

#[test]
fn a_lost_feedback_is_an_older_one() {
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    for lost in 1..=3u16 {
        let mut left = lost;
        rig.fates(move |frame, _| {
            if frame.id == 0x182 && left > 0 {
                left -= 1;
                return Fate::Lost;
            }
            Fate::Arrives
        });
        let mut oldest = [0; 3];
        let setpoints = Rig::<3, 1>::stay(&rig.standing());
        for _ in 0..80 {
            let feedback = rig.exchange(&setpoints).unwrap();
            for (oldest, axis) in oldest.iter_mut().zip(feedback) {
                *oldest = axis.age_ticks.max(*oldest);
            }
        }
        let cycle = rig.group.cycle();
        let expected = [0, lost, 0].map(|lost| cycle.feedback_age_ticks(lost));
        for (oldest, expected) in oldest.into_iter().zip(expected) {
            // A tick or two less, where the answers do not queue.
            assert!(
                (expected - 2..=expected).contains(&oldest),
                "{oldest} of {expected}"
            );
        }
    }
}

#[test]
fn a_kind_of_message_that_never_comes_keeps_the_drives_still() {
    for kind in KINDS {
        let mut rig = three_on_one_bus();
        rig.fates(
            move |frame, from_board| match is_kind(frame, from_board, kind) {
                true => Fate::Lost,
                false => Fate::Arrives,
            },
        );
        for _ in 0..8_000 {
            let _ = rig.exchange(&Rig::<3, 1>::stay(&rig.standing()));
        }
        let harmless = kind.1 == 0x080 && !kind.2 || kind.1 == 0x700 && kind.2;
        let moved = rig.drives(|drive| !drive.executed.is_empty());
        // Without heartbeats the drives are used until the time is up.
        if kind.0 != "heartbeat" {
            assert_eq!(moved, [harmless; 3], "{}", kind.0);
        }
        let enabled = rig.drives(|drive| drive.state == Pds::OperationEnabled);
        assert_eq!(enabled, [harmless; 3], "{}", kind.0);
    }
}

/// What may happen in a step of a few ms.
#[derive(Debug, Clone)]
enum Event {
    Stay,
    Move(i8),
    Off,
    SafeAtOnce,
    Reset,
    Fail(usize, u16),
    PowerCycle(usize),
    Heartbeats(usize, bool),
    Feedback(usize, bool),
    Sdo(usize, bool),
    LocalCommand(usize, u16),
    Network(usize, u8),
    Persists(usize, bool),
    Push(usize, i16),
    Cut(bool),
    Lose(u8),
}

fn event() -> impl Strategy<Value = Event> {
    let axis = 0..3usize;
    prop_oneof![
        4 => Just(Event::Stay),
        8 => any::<i8>().prop_map(Event::Move),
        3 => Just(Event::Off),
        1 => Just(Event::SafeAtOnce),
        2 => Just(Event::Reset),
        1 => (axis.clone(), prop::sample::select(vec![0x2310u16, 0x7305, 0x8611]))
            .prop_map(|(axis, code)| Event::Fail(axis, code)),
        1 => axis.clone().prop_map(Event::PowerCycle),
        1 => (axis.clone(), any::<bool>()).prop_map(|(axis, on)| Event::Heartbeats(axis, on)),
        1 => (axis.clone(), any::<bool>()).prop_map(|(axis, on)| Event::Feedback(axis, on)),
        1 => (axis.clone(), any::<bool>()).prop_map(|(axis, on)| Event::Sdo(axis, on)),
        2 => (axis.clone(), prop::sample::select(vec![0u16, 2, 6, 7, 15, 0x80]))
            .prop_map(|(axis, word)| Event::LocalCommand(axis, word)),
        1 => (axis.clone(), prop::sample::select(vec![1u8, 2, 0x80]))
            .prop_map(|(axis, command)| Event::Network(axis, command)),
        1 => (axis.clone(), any::<bool>()).prop_map(|(axis, on)| Event::Persists(axis, on)),
        1 => (axis, any::<i16>()).prop_map(|(axis, counts)| Event::Push(axis, counts)),
        1 => any::<bool>().prop_map(Event::Cut),
        1 => (0u8..60).prop_map(Event::Lose),
    ]
}

fn happen(rig: &mut Rig<3, 1>, event: Event, seed: &mut u32) {
    let step = |rig: &mut Rig<3, 1>, by: i8| {
        let mut setpoints = Rig::<3, 1>::stay(&rig.standing());
        for _ in 0..40 {
            for setpoint in &mut setpoints {
                setpoint.position_rad += f32::from(by) * 1e-7;
                setpoint.torque_nm = f32::from(by);
            }
            let _ = rig.exchange(&setpoints);
        }
    };
    match event {
        Event::Stay => step(rig, 0),
        Event::Move(by) => step(rig, by),
        Event::Off => {
            for _ in 0..40 {
                let _ = rig.off();
            }
        }
        Event::SafeAtOnce => {
            let _ = rig.exchange(&Rig::<3, 1>::stay(&rig.standing()));
            rig.safe();
        }
        Event::Reset => {
            rig.request_fault_reset();
            for _ in 0..80 {
                let _ = rig.off();
            }
        }
        Event::Fail(axis, code) => rig.drive(axis, |drive| drive.fail(code)),
        Event::PowerCycle(axis) => rig.drive(axis, |drive| {
            drive.power_off();
            drive.power_on();
        }),
        Event::Heartbeats(axis, on) => rig.drive(axis, |drive| drive.traits.sends_heartbeats = on),
        Event::Feedback(axis, on) => rig.drive(axis, |drive| drive.traits.sends_feedback = on),
        Event::Sdo(axis, on) => rig.drive(axis, |drive| drive.traits.answers_sdo = on),
        Event::LocalCommand(axis, word) => rig.drive(axis, |drive| drive.command(word)),
        Event::Network(axis, command) => rig.drive(axis, |drive| {
            let node = drive.node;
            drive.receive(&Raw::new(0x000, &[command, node]));
        }),
        Event::Persists(axis, on) => rig.drive(axis, |drive| drive.traits.cause_persists = on),
        Event::Push(axis, counts) => rig.drive(axis, |drive| drive.push(i32::from(counts))),
        Event::Cut(cut) => rig.wires[0].borrow_mut().is_cut = cut,
        Event::Lose(percent) => {
            let mut random = Random(*seed);
            *seed = seed.wrapping_add(1);
            rig.fates(move |_, _| {
                let roll = random.below(100);
                match roll {
                    _ if roll >= u32::from(percent) => Fate::Arrives,
                    _ if roll.is_multiple_of(4) => Fate::Twice,
                    _ if roll % 4 == 1 => Fate::Late(u64::from(roll) * 150),
                    _ => Fate::Lost,
                }
            });
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever happens, the laws hold, and when all is well again the drives come up by no more
    /// than a reset.
    #[test]
    fn the_laws_hold_whatever_happens(
        events in prop::collection::vec(event(), 1..60),
        mut seed in any::<u32>(),
        up_first in any::<bool>(),
    ) {
        let mut rig = three_on_one_bus();
        if up_first {
            rig.bring_up();
            rig.enable();
        }
        for event in events {
            happen(&mut rig, event, &mut seed);
            for axis in 0..3 {
                let faults = rig.drive(axis, |drive| {
                    matches!(drive.state, Pds::Fault | Pds::FaultReaction)
                });
                let executed = rig.drive(axis, |drive| drive.executed.len());
                rig.off().ok();
                let stands = rig.drive(axis, |drive| drive.executed.len()) == executed;
                prop_assert!(stands || !faults, "a drive in fault moved");
            }
        }

        rig.wires[0].borrow_mut().is_cut = false;
        rig.fates(|_, _| Fate::Arrives);
        rig.drives(|drive: &mut Drive| {
            drive.traits.cause_persists = false;
            drive.traits.sends_heartbeats = true;
            drive.traits.sends_feedback = true;
            drive.traits.answers_sdo = true;
            if drive.nmt != Nmt::Booting && drive.nmt != Nmt::Operational {
                // Stopped by another master: SDO is off until the board's next command.
                drive.nmt = Nmt::PreOperational;
            }
        });
        rig.off_for_ms(700);
        rig.request_fault_reset();
        rig.bring_up();
        // A drive set up anew may have been in a fault before.
        rig.off_for_ms(100);
        rig.request_fault_reset();
        let feedback = rig.off_for_ms(100);
        for (axis, feedback) in feedback.into_iter().enumerate() {
            prop_assert_eq!(rig.report(axis).stage, Stage::Operational);
            prop_assert_eq!(feedback.status, DriveStatus::Disabled, "{}", rig.report(axis));
        }
        rig.enable();
    }
}
