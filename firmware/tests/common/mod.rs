//! A still move of two axes, and drives that misbehave on demand.
#![allow(dead_code)] // Each test file uses its part.

use nalgebra::SVector;
use stillpoint_firmware::{
    Config, DriveGroup, DriveStatus, Executor, Feedback, IdealDrives, Setpoint, State, TickInputs,
};
use stillpoint_shared::assembly::{self, Outline};
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder, lgr};

pub(crate) const AXES: usize = 2;
pub(crate) const POINTS: usize = 8;
pub(crate) const INTERVALS: usize = 3;
pub(crate) const INTERVAL_TICKS: u32 = 200_000;
pub(crate) const DURATION_TICKS: u32 = INTERVALS as u32 * INTERVAL_TICKS;

/// Where the move starts and how far it goes, in rad.
pub(crate) const START_RAD: [f64; AXES] = [0.25, -1.0];
pub(crate) const REACH_RAD: [f64; AXES] = [0.3, -0.2];
/// Torque per acceleration, in kg·m².
pub(crate) const INERTIA: f64 = 0.1;

pub(crate) fn axis_limits() -> AxisLimits {
    AxisLimits {
        torque_nm: 100.0,
        torque_rate_nm_per_s: 20_000.0,
        speed_rad_per_s: 20.0,
        knee_speed_rad_per_s: 15.0,
        slope_nm_s_per_rad: 10.0,
    }
}

pub(crate) fn limits() -> Limits {
    Limits::new(&[axis_limits(); AXES]).unwrap()
}

pub(crate) fn start() -> SVector<f32, AXES> {
    SVector::from(START_RAD.map(|position| position as f32))
}

/// One value of a trajectory: interval, node, quantity (position, velocity, torque), axis.
pub(crate) type Index = (usize, usize, usize, usize);

/// A quintic from rest to rest with `change` applied to every value.
pub(crate) fn changed(limits: &Limits, change: impl Fn(Index, f64) -> f64) -> Trajectory {
    let mut nodes = [0.0; POINTS + 1];
    lgr::support_nodes(&mut nodes).unwrap();
    let duration_s = f64::from(DURATION_TICKS) * 1e-7;
    let mut builder = TrajectoryBuilder::new(42, limits);
    for interval in 0..INTERVALS {
        let mut rows = Vec::new();
        for (node, x) in nodes.iter().enumerate() {
            let s = (interval as f64 + (x + 1.0) / 2.0) / INTERVALS as f64;
            let values = [
                s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s),
                30.0 * s * s * (1.0 - s).powi(2) / duration_s,
                INERTIA * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration_s.powi(2),
            ];
            for (quantity, value) in values.into_iter().enumerate() {
                for axis in 0..AXES {
                    let offset = if quantity == 0 { START_RAD[axis] } else { 0.0 };
                    rows.push(change(
                        (interval, node, quantity, axis),
                        offset + REACH_RAD[axis] * value,
                    ));
                }
            }
        }
        builder.interval(INTERVAL_TICKS, POINTS, &rows).unwrap();
    }
    builder.finish().unwrap()
}

pub(crate) fn trajectory() -> Trajectory {
    changed(&limits(), |_, value| value)
}

/// Axis 0 pushes with τ = c (1 + x)² (1 − x) for 10 ms after as long at rest, and nothing moves.
///
/// On three points, τ′ is 0 at the first node, 0.68 c and −1.81 c at the others and −4 c at the
/// end; per second, times 200.
pub(crate) fn late_push(limits: &Limits, c: f64) -> Trajectory {
    let mut nodes = [0.0; 4];
    lgr::support_nodes(&mut nodes).unwrap();
    let push = nodes.map(|x| [0.0, 0.0, 0.0, 0.0, c * (1.0 + x).powi(2) * (1.0 - x), 0.0]);
    let mut builder = TrajectoryBuilder::new(1, limits);
    builder
        .interval(100_000, POINTS, &[0.0; 3 * AXES * (POINTS + 1)])
        .unwrap();
    builder.interval(100_000, 3, push.as_flattened()).unwrap();
    builder.finish().unwrap()
}

pub(crate) fn executor() -> Executor<AXES> {
    Executor::new(limits(), Config::default()).unwrap()
}

/// Nothing to report from the board.
pub(crate) const FINE: TickInputs = TickInputs {
    emergency_stop: false,
    busy_ticks: 0,
    missed_ticks: 0,
};

/// Build id in the fault records.
pub(crate) const BUILD_ID: u64 = 77;

/// Executor, with a fault record, and drives brought to a state with the test move loaded, unless
/// it is `Idle`.
pub(crate) fn brought_to(state: State) -> (Executor<AXES>, Drives) {
    let (mut executor, mut drives) = (executor(), Drives::at(&start()));
    executor.record_into(Box::leak(Box::default()), BUILD_ID);
    executor.tick(&mut drives, &FINE);
    if state == State::Idle {
        return (executor, drives);
    }
    executor.load(&trajectory(), &start()).unwrap();
    match state {
        State::Ready => return (executor, drives),
        State::Loading => {
            begin(&mut executor, &trajectory());
            return (executor, drives);
        }
        _ => {}
    }
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    if state == State::Armed {
        return (executor, drives);
    }
    executor.start(&executor.start_request()).unwrap();
    let mut until = |executor: &mut Executor<AXES>, wanted| {
        while executor.state() != wanted {
            assert_eq!(executor.tick(&mut drives, &FINE).fault, None);
        }
    };
    match state {
        State::Running => {}
        State::Holding => executor.hold().unwrap(),
        State::Held => {
            executor.hold().unwrap();
            until(&mut executor, State::Held);
        }
        State::Done => until(&mut executor, State::Done),
        State::Stopping => executor.quick_stop(),
        State::Fault => executor.emergency_stop(),
        other => panic!("no way to {other:?}"),
    }
    assert_eq!(executor.state(), state);
    (executor, drives)
}

/// Begins an upload and sends all blocks.
pub(crate) fn begin(executor: &mut Executor<AXES>, trajectory: &Trajectory) {
    let outline = Outline::of(trajectory);
    executor.begin_load(&outline).unwrap();
    for block in 0..executor.arrived().blocks {
        let bytes = block_bytes(trajectory, block);
        executor.load_block(outline.tag(), block, &bytes).unwrap();
    }
}

/// A block as it is sent.
pub(crate) fn block_bytes(trajectory: &Trajectory, block: u8) -> Vec<u8> {
    let values = assembly::block(trajectory, block).iter();
    values.flat_map(|value| value.to_le_bytes()).collect()
}

/// A hook on the feedback.
pub(crate) type Spoil = dyn Fn(&mut [Feedback; AXES]);

/// Ideal drives that take some ticks to enable, with a hook on feedback and a count of calls.
pub(crate) struct Drives {
    pub(crate) ideal: IdealDrives<AXES>,
    pub(crate) enabling_ticks: u32,
    pub(crate) spoil: Box<Spoil>,
    pub(crate) bus_broken: bool,
    pub(crate) exchanges: u32,
    pub(crate) safes: u32,
    energised_ticks: u32,
}

impl Drives {
    pub(crate) fn at(position_rad: &SVector<f32, AXES>) -> Self {
        Self {
            ideal: IdealDrives::at(position_rad),
            enabling_ticks: 0,
            spoil: Box::new(|_| {}),
            bus_broken: false,
            exchanges: 0,
            safes: 0,
            energised_ticks: 0,
        }
    }

    pub(crate) fn spoil(&mut self, spoil: impl Fn(&mut [Feedback; AXES]) + 'static) {
        self.spoil = Box::new(spoil);
    }

    fn report(&self, mut feedback: [Feedback; AXES]) -> Result<[Feedback; AXES], &'static str> {
        (self.spoil)(&mut feedback);
        if self.bus_broken {
            Err("bus broken")
        } else {
            Ok(feedback)
        }
    }
}

impl DriveGroup<AXES> for Drives {
    type Error = &'static str;

    fn exchange(&mut self, setpoints: &[Setpoint; AXES]) -> Result<[Feedback; AXES], Self::Error> {
        self.exchanges += 1;
        self.energised_ticks += 1;
        if self.energised_ticks <= self.enabling_ticks {
            return self.observe();
        }
        let Ok(feedback) = self.ideal.exchange(setpoints);
        assert!(
            feedback
                .iter()
                .all(|feedback| feedback.status == DriveStatus::Enabled)
        );
        self.report(feedback)
    }

    fn observe(&mut self) -> Result<[Feedback; AXES], Self::Error> {
        let Ok(feedback) = self.ideal.observe();
        self.report(feedback)
    }

    fn safe(&mut self) {
        self.safes += 1;
        self.energised_ticks = 0;
        self.ideal.safe();
    }
}
