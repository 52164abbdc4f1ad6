//! The state machine and its tick.
//!
//! [`State`] and [`Command`] say what is possible when; here is what it does. The host's commands
//! are in `commands`, trajectories come in by `loading`, and `tick` is the drive loop.

mod commands;
mod loading;
mod recording;
mod report;
mod tick;

use nalgebra::SVector;
use stillpoint_shared::drive_config::Cycle;
use stillpoint_shared::{Limits, Trajectory, time};

use crate::buffers::Buffers;
use crate::comms::CommsWatch;
use crate::limiter::LimiterConfig;
use crate::monitor::{self, Monitor, MonitorConfig};
use crate::pace::Pace;
use crate::path_time::PathTime;
use crate::ramp::Ramp;
use crate::record::{FaultRecord, sample_every};
use crate::slot::Slot;
use crate::{
    Command, Config, ConfigError, DriveStatus, Fault, FaultCause, Feedback, HoldReason, LimitFlags,
    Refusal, Setpoint, State,
};

pub use report::TickReport;
pub use tick::ENABLING_TIME_TICKS;

/// Plays trajectories on AXES drives. About 30 kB, most of it two trajectory buffers.
///
/// A static one that begins as [`Executor::unconfigured`] takes no flash and is never moved. In the
/// order of its fields: what a tick reads is near, so that one instruction reaches it.
#[derive(Debug)]
#[repr(C)]
pub struct Executor<const AXES: usize> {
    tick: u64,
    path: PathTime,
    ramp: Ramp,
    sent_path_ticks: u32,
    state: State,
    dry_run: bool,
    /// The hold was not asked for, but came with the host's silence.
    held_by_silence: bool,
    stop_pressed: bool,
    /// The drives' faults are to be reset with the next tick.
    reset_drives: bool,
    /// 100 % less the override in per cent, so that a new one is zero.
    slower_percent: u8,
    commanded: [Setpoint; AXES],
    /// Which axes have been enabled since the drives were armed, and when that was.
    enabled: [bool; AXES],
    armed_tick: u64,
    feedback: Slot<[Feedback; AXES]>,
    /// Limits in force in the last tick, and since the last `start`.
    limited: [LimitFlags; AXES],
    ever_limited: [LimitFlags; AXES],
    monitor: Monitor<AXES>,
    limiters: [LimiterConfig; AXES],
    pace: Pace<AXES>,
    period_s: f32,
    approach_step_rad: f32,
    config: Config,
    /// What the monitor allows: as configured, and what the bus needs.
    allowed: MonitorConfig,
    bus: Slot<Cycle>,
    comms: CommsWatch,
    fault: Slot<Fault>,
    record: Option<&'static mut FaultRecord<AXES>>,
    /// Samples are being added to the record.
    recording: bool,
    /// Ticks until the next sample of the record.
    record_in_ticks: u16,
    record_every_ticks: u16,
    build_id: u64,
    limits: Option<Limits>,
    limits_hash: u64,
    buffers: Buffers,
}

const NO_FEEDBACK: Feedback = Feedback {
    position_rad: 0.0,
    velocity_rad_per_s: 0.0,
    age_ticks: 0,
    status: DriveStatus::Disabled,
};

const NO_FAULT: Fault = Fault {
    cause: FaultCause::EmergencyStop,
    tick: 0,
};

const NO_CYCLE: Cycle = Cycle {
    ticks: 0,
    lead_ticks: 0,
    reply_ticks: 0,
};

const AT_ZERO: Setpoint = Setpoint {
    position_rad: 0.0,
    velocity_rad_per_s: 0.0,
    torque_nm: 0.0,
};

impl<const AXES: usize> Executor<AXES> {
    /// An idle executor that takes nothing but [`Executor::configure`]. All its bytes are zero.
    pub const fn unconfigured() -> Self {
        Self {
            config: Config::UNSET,
            allowed: Config::UNSET.monitor,
            bus: Slot::empty(NO_CYCLE),
            limits: None,
            limits_hash: 0,
            limiters: [LimiterConfig::NONE; AXES],
            period_s: 0.0,
            approach_step_rad: 0.0,
            buffers: Buffers::empty(),
            pace: Pace::NONE,
            state: State::Idle,
            dry_run: false,
            held_by_silence: false,
            stop_pressed: false,
            reset_drives: false,
            tick: 0,
            path: PathTime::START,
            ramp: Ramp::at(0),
            slower_percent: 0,
            comms: CommsWatch::OFF,
            commanded: [AT_ZERO; AXES],
            enabled: [false; AXES],
            armed_tick: 0,
            feedback: Slot::empty([NO_FEEDBACK; AXES]),
            limited: [LimitFlags::NONE; AXES],
            ever_limited: [LimitFlags::NONE; AXES],
            sent_path_ticks: 0,
            monitor: Monitor::NEW,
            fault: Slot::empty(NO_FAULT),
            record: None,
            recording: false,
            record_in_ticks: 0,
            record_every_ticks: 0,
            build_id: 0,
        }
    }

    /// An idle executor for a machine with these limits, which must be of AXES axes.
    pub fn new(limits: Limits, config: Config) -> Result<Self, ConfigError> {
        let mut executor = Self::unconfigured();
        executor.set_up(&limits, &config)?;
        Ok(executor)
    }

    /// Takes other limits or another configuration, with the drives off. What was loaded was
    /// accepted under the old ones and is forgotten.
    pub fn configure(&mut self, limits: &Limits, config: &Config) -> Result<(), Refusal> {
        self.allows(Command::Configure)?;
        self.set_up(limits, config)?;
        self.buffers.clear();
        self.state = State::Idle;
        Ok(())
    }

    fn set_up(&mut self, limits: &Limits, config: &Config) -> Result<(), ConfigError> {
        config.check()?;
        let axes = <&[_; AXES]>::try_from(limits.axes()).map_err(|_| ConfigError::Axes {
            limits: limits.axes().len() as u8,
            executor: AXES as u8,
        })?;
        let period_s = time::seconds(config.period_ticks) as f32;
        for (limiter, axis) in self.limiters.iter_mut().zip(axes) {
            *limiter = LimiterConfig::new(axis, period_s);
        }
        self.period_s = period_s;
        self.approach_step_rad = config.approach_speed_rad_per_s * period_s;
        self.record_every_ticks = sample_every(config.period_ticks);
        self.limits_hash = limits.hash();
        self.limits = Some(limits.clone());
        self.config = *config;
        self.allow();
        Ok(())
    }

    /// The drives are behind a bus with this cycle, if any: the monitor allows what that costs, on
    /// top of what is configured, now and after every other configuration.
    pub fn allow_for_bus(&mut self, cycle: Option<Cycle>) {
        match cycle {
            Some(cycle) => self.bus.put(cycle),
            None => self.bus.empty_out(),
        }
        self.allow();
    }

    fn allow(&mut self) {
        let Config {
            monitor,
            period_ticks,
            ..
        } = &self.config;
        self.allowed = match self.bus.get() {
            Some(cycle) => cycle.monitor(monitor, *period_ticks),
            None => *monitor,
        };
    }

    /// What the monitor allows: as configured, and what the bus needs on top.
    pub fn allowed(&self) -> &MonitorConfig {
        &self.allowed
    }

    /// Where the executor is.
    pub fn state(&self) -> State {
        self.state
    }

    /// Ticks since the executor was made.
    pub fn ticks(&self) -> u64 {
        self.tick
    }

    /// The first cause, in the states `Stopping` and `Fault`.
    pub fn fault(&self) -> Option<Fault> {
        self.fault.get().copied()
    }

    /// Limits that were in force since the last `start`, axis by axis.
    #[allow(clippy::misnamed_getters)] // Those of the last tick are in its report.
    pub fn limited(&self) -> &[LimitFlags; AXES] {
        &self.ever_limited
    }

    /// Peaks since the last `start`.
    pub fn monitor(&self) -> &Monitor<AXES> {
        &self.monitor
    }

    /// The machine's limits; `None` until it is configured.
    pub fn limits(&self) -> Option<&Limits> {
        self.limits.as_ref()
    }

    /// How it plays.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// What is loaded; without intervals if nothing is.
    pub fn trajectory(&self) -> &Trajectory {
        self.buffers.playing()
    }

    /// The numbers by which the loaded move changes its path speed.
    pub fn pace(&self) -> &Pace<AXES> {
        &self.pace
    }

    /// Whether the move that was started is a dry run.
    pub fn is_dry_run(&self) -> bool {
        self.dry_run
    }

    /// Why the move is held, in the states `Holding` and `Held`.
    pub fn hold_reason(&self) -> Option<HoldReason> {
        let held = matches!(self.state, State::Holding | State::Held);
        held.then_some(if self.held_by_silence {
            HoldReason::CommsLost
        } else {
            HoldReason::Command
        })
    }

    /// The override in per cent.
    pub fn override_percent(&self) -> u8 {
        100 - self.slower_percent
    }

    /// Time of the coming set-points in the trajectory, in time ticks.
    pub fn path_ticks(&self) -> u32 {
        self.path.ticks()
    }

    /// Path speed, 0 to `FULL_SPEED`.
    pub fn path_speed(&self) -> u32 {
        if self.state.is_under_way() {
            self.ramp.speed()
        } else {
            0
        }
    }

    /// What happened in the last tick.
    #[inline]
    pub fn report(&self) -> TickReport<'_, AXES> {
        TickReport {
            tick: self.tick,
            state: self.state,
            path_ticks: self.sent_path_ticks,
            path_speed: self.path_speed(),
            setpoints: &self.commanded,
            feedback: self.feedback.get(),
            limited: &self.limited,
            fault: self.fault.get().copied(),
        }
    }

    /// Positions in rad by the feedback of the last tick, if it can be believed: a drive in a fault
    /// still measures, one that is silent or was never heard does not.
    pub fn measured_rad(&self) -> Result<SVector<f32, AXES>, Refusal> {
        let feedback = self.feedback.get().ok_or(Refusal::NoFeedback)?;
        let mut measured = SVector::<f32, AXES>::zeros();
        for (axis, (measured, feedback)) in (0..).zip(measured.iter_mut().zip(feedback)) {
            monitor::fresh(&self.allowed, axis, feedback).map_err(Refusal::Feedback)?;
            *measured = feedback.position_rad;
        }
        Ok(measured)
    }

    /// Whether a command is taken now, as far as the state says.
    pub fn allows(&self, command: Command) -> Result<(), Refusal> {
        if !command.allowed_in().contains(&self.state) {
            return Err(Refusal::WrongState {
                command,
                state: self.state,
            });
        }
        Ok(())
    }

    /// Whether the drives follow set-points.
    fn is_driving(&self) -> bool {
        self.state.is_energised() && !self.dry_run
    }

    /// `Ready`, or `Idle` if nothing is loaded.
    fn rest(&self) -> State {
        if self.buffers.is_loaded() {
            State::Ready
        } else {
            State::Idle
        }
    }

    /// Latches the first cause.
    fn latch(&mut self, cause: FaultCause) {
        if self.fault.get().is_none() {
            self.fault.put(Fault {
                cause,
                tick: self.tick,
            });
        }
    }

    /// Takes the torque away at the next tick, for good.
    fn fail(&mut self, cause: FaultCause) {
        self.latch(cause);
        self.buffers.abort();
        self.state = State::Fault;
    }
}
