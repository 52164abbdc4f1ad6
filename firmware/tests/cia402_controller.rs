//! What the group does with CAN controllers that refuse and displace frames: nothing is lost, and
//! nothing old takes the place of something newer.

mod cia402_sim;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use cia402_sim::{axis_drive, every, three_on_one_bus};
use stillpoint_firmware::cia402::{Buses, CanFrame, Cia402Group, Received, Sent, Stage};
use stillpoint_firmware::{DriveGroup, Setpoint};
use stillpoint_shared::DriveConfig;
use stillpoint_shared::drive_config::{AxisDrive, Mapping};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

const NODE: u16 = 5;
const SETPOINT: u16 = 0x200 + NODE;
const SYNC: u16 = 0x080;

/// A controller that does with frames what it is told, once each, and takes the others; behind it a
/// drive that agrees to everything.
#[derive(Default)]
struct Script {
    lines: Vec<(u16, Sent)>,
    /// Frames that were taken.
    taken: Vec<CanFrame>,
    /// Where the drive says it stands, in increments.
    counts: i32,
    /// Whether a set-point waits for the wire and lets no other one in.
    waits: bool,
    answers: VecDeque<CanFrame>,
}

#[derive(Clone, Default)]
struct Scripted(Rc<RefCell<Script>>);

impl Buses for Scripted {
    const COUNT: usize = 1;

    fn transmit(&mut self, _: usize, frame: &CanFrame) -> Sent {
        let mut script = self.0.borrow_mut();
        if script.waits && frame.id() == SETPOINT {
            return Sent::Busy;
        }
        let line = script.lines.iter().position(|(id, _)| *id == frame.id());
        let sent = line.map_or(Sent::Taken(None), |line| script.lines.remove(line).1);
        if !matches!(sent, Sent::Taken(_)) {
            return sent;
        }
        script.taken.push(*frame);
        match (frame.id(), frame.data()) {
            (SYNC, _) => {
                let [p0, p1, p2, p3] = script.counts.to_le_bytes();
                let feedback = [0x40, 0x02, p0, p1, p2, p3, 8];
                let heartbeat = CanFrame::new(0x700 + NODE, &[5]);
                script
                    .answers
                    .push_back(CanFrame::new(0x180 + NODE, &feedback));
                script.answers.push_back(heartbeat);
            }
            (0x605, &[0x40, low, high, sub, ..]) => {
                let value = if high == 0x10 { 402u32 } else { 1_270 };
                let [b4, b5, b6, b7] = value.to_le_bytes();
                let answer = [0x43, low, high, sub, b4, b5, b6, b7];
                script.answers.push_back(CanFrame::new(0x585, &answer));
            }
            (0x605, &[_, low, high, sub, ..]) => {
                let answer = [0x60, low, high, sub, 0, 0, 0, 0];
                script.answers.push_back(CanFrame::new(0x585, &answer));
            }
            _ => {}
        }
        sent
    }

    fn receive(&mut self, _: usize) -> Received {
        let answer = self.0.borrow_mut().answers.pop_front();
        answer.map_or(Received::Nothing, Received::Frame)
    }

    fn take_back(&mut self, _: usize, id: u16) {
        let mut script = self.0.borrow_mut();
        script.waits &= id != SETPOINT;
    }
}

#[test]
fn a_set_point_that_waits_does_not_hold_up_the_end_of_the_torque() {
    let (mut group, controller) = before_set_points();
    group.exchange(&[Setpoint::default()]).unwrap();
    controller.0.borrow_mut().taken.clear();
    controller.0.borrow_mut().waits = true;
    group.safe();
    let taken = controller.0.borrow().taken.clone();
    let disable_voltage = taken.iter().find(|frame| frame.id() == SETPOINT);
    assert_eq!(
        disable_voltage.map(|frame| &frame.data()[..2]),
        Some(&[0, 0][..])
    );
}

/// A group and its controller, operational and just before a tick in which set-points are sent.
fn before_set_points() -> (Cia402Group<1, Scripted>, Scripted) {
    let axis = AxisDrive {
        mapping: Mapping::Preset,
        ..axis_drive(0, NODE as u8)
    };
    let config = DriveConfig::new(every(2_000), &[axis]).unwrap();
    let controller = Scripted::default();
    let mut group = Cia402Group::new(&config, controller.clone(), DRIVE_PERIOD_TICKS).unwrap();
    let cycle = group.cycle();
    for _ in 0..100 * cycle.ticks + cycle.ticks - cycle.lead_ticks - 1 {
        group.observe().unwrap();
    }
    assert_eq!(group.report(0).unwrap().stage, Stage::Operational);
    controller.0.borrow_mut().taken.clear();
    (group, controller)
}

/// Identifiers and targets of what the controller took in so many ticks.
fn taken(
    group: &mut Cia402Group<1, Scripted>,
    controller: &Scripted,
    ticks: u16,
) -> Vec<(u16, Option<i32>)> {
    for _ in 0..ticks {
        let _ = group.observe();
    }
    let frames = std::mem::take(&mut controller.0.borrow_mut().taken);
    let told = |frame: &CanFrame| match *frame.data() {
        [_, _, p0, p1, p2, p3, _, _] => Some(i32::from_le_bytes([p0, p1, p2, p3])),
        _ => None,
    };
    let cyclic = frames.iter().filter(|frame| frame.id() != 0x77f);
    cyclic.map(|frame| (frame.id(), told(frame))).collect()
}

fn set_point(counts: i32) -> CanFrame {
    let [p0, p1, p2, p3] = counts.to_le_bytes();
    CanFrame::new(SETPOINT, &[0, 0, p0, p1, p2, p3, 0, 0])
}

#[test]
fn a_displaced_frame_is_sent_again() {
    let (mut group, controller) = before_set_points();
    let lead_ticks = group.cycle().lead_ticks;
    // SYNC displaces the set-point that has waited all the time.
    let displaced = Sent::Taken(Some(set_point(0)));
    controller.0.borrow_mut().lines = vec![(SYNC, displaced)];
    let frames = taken(&mut group, &controller, lead_ticks + 2);
    assert_eq!(
        frames,
        [(SETPOINT, Some(0)), (SYNC, None), (SETPOINT, Some(0))]
    );

    // A heartbeat of the board and a request are displaced by a set-point.
    let (mut group, controller) = before_set_points();
    for frame in [CanFrame::new(0x77f, &[5]), CanFrame::new(0x605, &[0x40; 8])] {
        let displaced = Sent::Taken(Some(frame));
        controller.0.borrow_mut().lines = vec![(SETPOINT, displaced)];
        taken(&mut group, &controller, lead_ticks + 1);
        let before = group.traffic(0).unwrap().sent;
        let frames = taken(&mut group, &controller, 1);
        let again = group.traffic(0).unwrap().sent - before;
        assert_eq!(again, 1, "{frames:?}");
        taken(&mut group, &controller, 8 - lead_ticks - 2);
    }
}

#[test]
fn a_displaced_frame_does_not_take_the_place_of_a_newer_one() {
    let (mut group, controller) = before_set_points();
    let cycle = group.cycle();
    taken(&mut group, &controller, 1);
    controller.0.borrow_mut().counts = 70;
    // The set-points of the next cycle are refused, since the old ones still wait; then SYNC
    // displaces those.
    taken(&mut group, &controller, cycle.ticks - 1);
    let displaced = Sent::Taken(Some(set_point(0)));
    let mut lines = vec![(SETPOINT, Sent::Busy); usize::from(cycle.lead_ticks) + 1];
    lines.push((SYNC, displaced));
    controller.0.borrow_mut().lines = lines;
    let frames = taken(&mut group, &controller, cycle.lead_ticks + 2);
    assert_eq!(frames, [(SYNC, None), (SETPOINT, Some(70))]);
}

#[test]
fn all_set_points_of_a_cycle_are_given_to_the_controller_at_once() {
    // The simulated controller refuses what is not more urgent than all that waits.
    let mut rig = three_on_one_bus();
    rig.bring_up();
    rig.enable();
    let setpoints = [Setpoint::default(); 3].map(|setpoint| Setpoint {
        position_rad: cia402_sim::angle_rad(cia402_sim::START_COUNTS),
        ..setpoint
    });
    let mut most = 0;
    for _ in 0..32 {
        let before = rig.taken().len();
        rig.exchange(&setpoints).unwrap();
        let now = rig.taken();
        let set_points = now[before..]
            .iter()
            .filter(|frame| frame.id & 0x780 == 0x200)
            .count();
        assert!(matches!(set_points, 0 | 3), "{set_points} in one tick");
        most = most.max(set_points);
    }
    assert_eq!(most, 3);
}

#[test]
fn a_controller_that_fails_is_counted_and_told() {
    let (mut group, controller) = before_set_points();
    let lines = std::iter::repeat_n((SETPOINT, Sent::Failed), 40);
    let sync = std::iter::repeat_n((SYNC, Sent::Failed), 40);
    controller.0.borrow_mut().lines = lines.chain(sync).collect();
    let mut stuck = None;
    for _ in 0..40 {
        stuck = stuck.or(group.observe().err());
    }
    assert_eq!(stuck.map(|stuck| stuck.bus), Some(0));
    assert!(group.traffic(0).unwrap().errors > 16);
}
