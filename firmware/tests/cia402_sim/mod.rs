//! Simulated CiA 402 drives on a simulated CAN bus, and the group of drives under test on them.
#![allow(dead_code)] // Each test file uses its part.

pub(crate) mod dictionary;
pub(crate) mod drive;
pub(crate) mod laws;
pub(crate) mod wire;

use std::cell::RefCell;
use std::rc::Rc;

use stillpoint_firmware::cia402::{AxisReport, BusStuck, Cia402Group, Stage};
use stillpoint_firmware::{DriveGroup, DriveStatus, Feedback, Setpoint};
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, DriveConfig, Mapping};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

use drive::Drive;
use laws::{Call, Laws};
use wire::{Fate, Port, Raw, Wire};

/// Tick of the executor.
pub(crate) const TICK_US: u64 = DRIVE_PERIOD_TICKS as u64 / 10;

/// Increments per turn of the joint: 16 bits and a gear of 50.
pub(crate) const COUNTS_PER_TURN: f64 = 65_536.0 * 50.0;
pub(crate) const GEAR_RATIO: f32 = 50.0;
pub(crate) const RATED_TORQUE_NM: f32 = 1.27;

/// Where the drives stand at first, in increments.
pub(crate) const START_COUNTS: i32 = 123_456;

pub(crate) fn axis_drive(bus: u8, node: u8) -> AxisDrive {
    AxisDrive {
        bus,
        node,
        counts_per_turn: COUNTS_PER_TURN,
        reversed: false,
        home_counts: 0,
        home_rad: 0.0,
        gear_ratio: GEAR_RATIO,
        rated_torque_nm: RATED_TORQUE_NM,
        torque_limit_permille: 3_000,
        mapping: Mapping::Write,
        tells_following: true,
    }
}

pub(crate) fn every(period_us: u16) -> BusConfig {
    BusConfig {
        period_us,
        ..BusConfig::default()
    }
}

/// Joint angle in rad at a number of increments.
pub(crate) fn angle_rad(counts: i32) -> f32 {
    (f64::from(counts) / COUNTS_PER_TURN * std::f64::consts::TAU) as f32
}

/// N drives on B buses, and the group that commands them.
pub(crate) struct Rig<const N: usize, const B: usize> {
    pub(crate) group: Cia402Group<N, [Port; B]>,
    pub(crate) config: DriveConfig,
    pub(crate) wires: [Rc<RefCell<Wire>>; B],
    pub(crate) laws: [Laws; B],
    pub(crate) now_us: u64,
}

impl<const N: usize, const B: usize> Rig<N, B> {
    /// Drives at the places of a configuration, switched on.
    pub(crate) fn new(bus: BusConfig, axes: [AxisDrive; N]) -> Self {
        let drives = |bus: usize| {
            let on_bus = axes.iter().filter(|axis| usize::from(axis.bus) == bus);
            let drives = on_bus.map(|axis| {
                let mut drive = Drive::new(axis.node, 1_270, START_COUNTS);
                drive.power_on();
                drive
            });
            drives.collect()
        };
        Self::with(bus, axes, std::array::from_fn(drives))
    }

    /// With drives of one's own.
    pub(crate) fn with(bus: BusConfig, axes: [AxisDrive; N], drives: [Vec<Drive>; B]) -> Self {
        let config = DriveConfig::new(bus, &axes).unwrap();
        let wires = drives.map(|drives| Rc::new(RefCell::new(Wire::new(drives))));
        let ports = wires.each_ref().map(|wire| Port(Rc::clone(wire)));
        Self {
            group: Cia402Group::new(&config, ports, DRIVE_PERIOD_TICKS).unwrap(),
            config,
            wires,
            laws: std::array::from_fn(|_| Laws::default()),
            now_us: 0,
        }
    }

    fn pass(&mut self) {
        self.now_us += TICK_US;
        for wire in &self.wires {
            wire.borrow_mut().advance(self.now_us);
        }
    }

    fn check(&mut self, call: Call) {
        for (laws, wire) in self.laws.iter_mut().zip(&self.wires) {
            laws.check(&mut wire.borrow_mut(), call);
        }
    }

    /// One tick with set-points.
    pub(crate) fn exchange(
        &mut self,
        setpoints: &[Setpoint; N],
    ) -> Result<[Feedback; N], BusStuck> {
        self.pass();
        let result = self.group.exchange(setpoints);
        self.check(Call::Exchange);
        result
    }

    /// One tick with the drives off.
    pub(crate) fn off(&mut self) -> Result<[Feedback; N], BusStuck> {
        self.pass();
        self.group.safe();
        self.check(Call::Safe);
        let result = self.group.observe();
        self.check(Call::Observe);
        result
    }

    /// Makes safe after an exchange in the same tick, as the executor does at a fault.
    pub(crate) fn safe(&mut self) {
        self.group.safe();
        self.check(Call::Safe);
    }

    /// So many ms with the drives off.
    pub(crate) fn off_for_ms(&mut self, ms: u64) -> [Feedback; N] {
        for _ in 1..ms * 1_000 / TICK_US {
            let _ = self.off();
        }
        self.off().unwrap()
    }

    pub(crate) fn request_fault_reset(&mut self) {
        self.reset_faults();
    }

    /// Waits until all drives exchange process data; how many ms that took.
    pub(crate) fn bring_up(&mut self) -> u64 {
        let since_us = self.now_us;
        for _ in 0..8_000 {
            let _ = self.off();
            if (0..N).all(|axis| self.report(axis).stage == Stage::Operational) {
                return (self.now_us - since_us) / 1_000;
            }
        }
        panic!("not operational: {:?}", self.group.report(0));
    }

    /// Set-points where the axes were measured.
    pub(crate) fn stay(feedback: &[Feedback; N]) -> [Setpoint; N] {
        feedback.map(|feedback| Setpoint {
            position_rad: feedback.position_rad,
            ..Setpoint::default()
        })
    }

    /// Enables all drives where they stand, as an armed executor does; how many ms that took.
    pub(crate) fn enable(&mut self) -> u64 {
        let since_us = self.now_us;
        let mut feedback = self.off().unwrap();
        for _ in 0..4_000 {
            feedback = self.exchange(&Self::stay(&feedback)).unwrap();
            if feedback.map(|feedback| feedback.status) == [DriveStatus::Enabled; N] {
                return (self.now_us - since_us) / 1_000;
            }
        }
        panic!("not enabled: {feedback:?}");
    }

    /// Exchanges for so many ms with set-points that move by so much per tick.
    pub(crate) fn move_for_ms(&mut self, ms: u64, step_rad: f32) -> [Feedback; N] {
        let mut setpoints = Self::stay(&self.exchange_where_they_stand());
        let mut feedback = None;
        for _ in 0..ms * 1_000 / TICK_US {
            for setpoint in &mut setpoints {
                setpoint.position_rad += step_rad;
            }
            feedback = self.exchange(&setpoints).ok().or(feedback);
        }
        feedback.unwrap()
    }

    /// Feedback of where the axes stand, without asking the group.
    pub(crate) fn standing(&self) -> [Feedback; N] {
        let stands = self.drives(|drive| angle_rad(drive.counts()));
        stands.map(|position_rad| Feedback {
            position_rad,
            velocity_rad_per_s: 0.0,
            age_ticks: 0,
            status: DriveStatus::Disabled,
        })
    }

    /// One more exchange where the axes stand; they must be at rest.
    pub(crate) fn exchange_where_they_stand(&mut self) -> [Feedback; N] {
        self.exchange(&Self::stay(&self.standing())).unwrap()
    }

    /// Asks, or changes, the drive of an axis.
    pub(crate) fn drive<T>(&self, axis: usize, ask: impl FnOnce(&mut Drive) -> T) -> T {
        let AxisDrive { bus, node, .. } = self.config.axes()[axis];
        let mut wire = self.wires[usize::from(bus)].borrow_mut();
        let drive = wire.drives.iter_mut().find(|drive| drive.node == node);
        ask(drive.unwrap())
    }

    /// Asks the drives of all axes.
    pub(crate) fn drives<T>(&self, ask: impl Fn(&mut Drive) -> T) -> [T; N] {
        std::array::from_fn(|axis| self.drive(axis, &ask))
    }

    pub(crate) fn report(&self, axis: usize) -> AxisReport {
        self.group.report(axis).unwrap()
    }

    /// Decides what becomes of the frames of bus 0.
    pub(crate) fn fates(&mut self, fates: impl FnMut(&Raw, bool) -> Fate + 'static) {
        self.wires[0].borrow_mut().fates = Box::new(fates);
    }

    /// Frames the board sent to bus 0, since the start.
    pub(crate) fn taken(&self) -> Vec<Raw> {
        self.wires[0].borrow().taken.clone()
    }
}

/// For the executor: every exchange and every observation is a tick.
impl<const N: usize, const B: usize> DriveGroup<N> for Rig<N, B> {
    type Error = BusStuck;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], BusStuck> {
        Rig::exchange(self, setpoints)
    }

    fn observe(&mut self) -> Result<[Feedback; N], BusStuck> {
        self.pass();
        let result = self.group.observe();
        self.check(Call::Observe);
        result
    }

    fn safe(&mut self) {
        Rig::safe(self);
    }

    fn reset_faults(&mut self) {
        self.group.reset_faults();
        for laws in &mut self.laws {
            laws.requests += 1;
        }
    }
}

/// Three drives on one bus at 500 Hz.
pub(crate) fn three_on_one_bus() -> Rig<3, 1> {
    Rig::new(every(2_000), [1, 2, 3].map(|node| axis_drive(0, node)))
}

/// Three drives on two buses at 1 kHz.
pub(crate) fn three_on_two_buses() -> Rig<3, 2> {
    Rig::new(
        every(1_000),
        [axis_drive(0, 1), axis_drive(0, 2), axis_drive(1, 1)],
    )
}

/// One drive at 500 Hz.
pub(crate) fn one() -> Rig<1, 1> {
    Rig::new(every(2_000), [axis_drive(0, 5)])
}
