//! The state machine and its tick.

use nalgebra::SVector;
use stillpoint_shared::time;
use stillpoint_shared::{Limits, Player, Sample, Trajectory};

use crate::accept;
use crate::limiter::{self, LimiterConfig};
use crate::monitor::{self, Monitor};
use crate::{
    Command, Config, ConfigError, DriveGroup, DriveStatus, Fault, FaultCause, Feedback, LimitFlags,
    Refusal, Rejection, Setpoint, State,
};

/// What happened in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TickReport<const AXES: usize> {
    /// Ticks since the executor was made, this one included.
    pub tick: u64,
    /// State after the tick.
    pub state: State,
    /// Time in the trajectory that the set-points belong to, in time ticks.
    pub path_ticks: u32,
    /// What was sent; where the axes stand, if the drives are off.
    pub setpoints: [Setpoint; AXES],
    /// What came back, if anything did.
    pub feedback: Option<[Feedback; AXES]>,
    /// Limits in force in this tick.
    pub limited: [LimitFlags; AXES],
    /// The first cause, in state `Fault`.
    pub fault: Option<Fault>,
}

/// Plays trajectories on AXES drives. About 20 kB, most of it the trajectory.
#[derive(Debug, Clone)]
pub struct Executor<const AXES: usize> {
    config: Config,
    limits: Limits,
    limiters: [LimiterConfig; AXES],
    approach_step_rad: f32,
    player: Player<AXES>,
    monitor: Monitor<AXES>,
    state: State,
    tick: u64,
    path_ticks: u32,
    commanded: [Setpoint; AXES],
    feedback: Option<[Feedback; AXES]>,
    limited: [LimitFlags; AXES],
    fault: Option<Fault>,
}

impl<const AXES: usize> Executor<AXES> {
    /// An idle executor for a machine with these limits, which must be of AXES axes.
    pub fn new(limits: Limits, config: Config) -> Result<Self, ConfigError> {
        config.check()?;
        let period_s = time::seconds(config.period_ticks) as f32;
        let axes = <&[_; AXES]>::try_from(limits.axes()).map_err(|_| ConfigError::Axes {
            limits: limits.axes().len(),
            executor: AXES,
        })?;
        Ok(Self {
            limiters: axes.map(|axis| LimiterConfig::new(&axis, period_s)),
            limits,
            approach_step_rad: config.approach_speed_rad_per_s * period_s,
            config,
            player: Player::empty(),
            monitor: Monitor::default(),
            state: State::Idle,
            tick: 0,
            path_ticks: 0,
            commanded: [Setpoint::default(); AXES],
            feedback: None,
            limited: [LimitFlags::NONE; AXES],
            fault: None,
        })
    }

    /// Where the executor is.
    pub fn state(&self) -> State {
        self.state
    }

    /// The first cause, in state `Fault`.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Limits that were in force since the last `start`, axis by axis.
    pub fn limited(&self) -> &[LimitFlags; AXES] {
        &self.limited
    }

    /// Following-error peaks since the last `start`.
    pub fn monitor(&self) -> &Monitor<AXES> {
        &self.monitor
    }

    /// The machine's limits.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// What is loaded; without intervals in state `Idle`.
    pub fn trajectory(&self) -> &Trajectory {
        self.player.trajectory()
    }

    /// Checks a trajectory against the limits and where the axes stand (rad), and takes a copy of
    /// it.
    ///
    /// A refused one leaves the previous one loaded.
    pub fn load(
        &mut self,
        trajectory: &Trajectory,
        measured_rad: &SVector<f32, AXES>,
    ) -> Result<(), Refusal> {
        self.allow(Command::Load)?;
        accept::check(
            trajectory,
            &self.limits,
            measured_rad.as_slice(),
            &self.config.accept,
        )?;
        self.player.load(trajectory).map_err(|_| Rejection::Axes {
            trajectory: trajectory.axes() as u8,
            machine: AXES as u8,
        })?;
        self.state = if self.state.is_energised() {
            State::Armed
        } else {
            State::Ready
        };
        Ok(())
    }

    /// Lets the next tick energise the drives, where they stand; they then creep to the first node,
    /// from which they may be no further than the start tolerance.
    pub fn arm(&mut self) -> Result<(), Refusal> {
        self.allow(Command::Arm)?;
        self.near_first_node(Command::Arm)?;
        self.state = State::Armed;
        Ok(())
    }

    /// Plays from the next tick on, if the drives are enabled and stand at the first node by fresh
    /// feedback.
    pub fn start(&mut self) -> Result<(), Refusal> {
        self.allow(Command::Start)?;
        let (feedback, first) = self.near_first_node(Command::Start)?;
        let axes = self.commanded.iter().zip(&feedback).zip(first.position_rad);
        for (axis, ((commanded, feedback), first_rad)) in (0u8..).zip(axes) {
            if feedback.status != DriveStatus::Enabled {
                return Err(Refusal::NotEnabled { axis });
            }
            let distance_rad = first_rad - commanded.position_rad;
            if distance_rad != 0.0 {
                return Err(Refusal::Approaching { axis, distance_rad });
            }
        }
        self.path_ticks = 0;
        self.limited = [LimitFlags::NONE; AXES];
        self.monitor = Monitor::default();
        self.state = State::Running;
        Ok(())
    }

    /// Switches the drives off at rest, before or after a move.
    pub fn disarm(&mut self) -> Result<(), Refusal> {
        self.allow(Command::Disarm)?;
        self.state = State::Ready;
        Ok(())
    }

    /// Leaves `Fault`. What is loaded stays loaded.
    pub fn clear(&mut self) -> Result<(), Refusal> {
        self.allow(Command::Clear)?;
        self.fault = None;
        self.state = if self.player.first().is_some() {
            State::Ready
        } else {
            State::Idle
        };
        Ok(())
    }

    /// Takes the torque away at the next tick and latches the fault, in any state.
    pub fn emergency_stop(&mut self) {
        self.fail(FaultCause::EmergencyStop);
    }

    /// One tick of the drive loop: evaluate, limit, exchange, monitor; or, with the drives off,
    /// make safe and observe.
    ///
    /// Bounded and without division: one evaluation, and loops over the axes.
    pub fn tick<D: DriveGroup<AXES>>(&mut self, drives: &mut D) -> TickReport<AXES> {
        self.tick = self.tick.wrapping_add(1);
        let path_ticks = self.path_ticks;
        let mut limited = [LimitFlags::NONE; AXES];
        if self.state.is_energised() {
            if let Err(cause) = self.drive(drives, &mut limited) {
                drives.safe();
                self.fail(cause);
            }
        } else {
            drives.safe();
            self.observe(drives);
        }
        TickReport {
            tick: self.tick,
            state: self.state,
            path_ticks,
            setpoints: self.commanded,
            feedback: self.feedback,
            limited,
            fault: self.fault,
        }
    }

    fn drive<D: DriveGroup<AXES>>(
        &mut self,
        drives: &mut D,
        limited: &mut [LimitFlags; AXES],
    ) -> Result<(), FaultCause> {
        let playing = self.state != State::Armed;
        let wanted = if playing {
            self.player.sample(self.path_ticks).map(setpoints)
        } else {
            self.approach()
        };
        let wanted = wanted.ok_or(FaultCause::NothingLoaded)?;
        let axes = self
            .commanded
            .iter_mut()
            .zip(&wanted)
            .zip(&self.limiters)
            .zip(limited)
            .zip(&mut self.limited);
        for ((((commanded, wanted), limiter), limited), sticky) in axes {
            (*commanded, *limited) = limiter::limit(limiter, commanded, wanted);
            *sticky |= *limited;
        }

        self.feedback = drives.exchange(&self.commanded).ok();
        let feedback = self.feedback.as_ref().ok_or(FaultCause::ExchangeFailed)?;
        self.monitor
            .check(&self.config.monitor, &self.commanded, feedback, playing)?;

        if self.state == State::Running {
            let duration_ticks = self.player.trajectory().duration_ticks();
            if self.path_ticks >= duration_ticks {
                self.state = State::Done;
            } else {
                self.path_ticks = self
                    .path_ticks
                    .saturating_add(self.config.period_ticks)
                    .min(duration_ticks);
            }
        }
        Ok(())
    }

    /// Set-points of an armed tick: an enabled axis creeps to the first node, any other stays where
    /// it is measured.
    fn approach(&mut self) -> Option<[Setpoint; AXES]> {
        let first = setpoints(self.player.first()?);
        let mut wanted = first;
        for ((wanted, commanded), feedback) in wanted
            .iter_mut()
            .zip(&mut self.commanded)
            .zip(self.feedback.as_ref()?)
        {
            if feedback.status == DriveStatus::Enabled {
                let distance_rad = wanted.position_rad - commanded.position_rad;
                if distance_rad > self.approach_step_rad {
                    wanted.position_rad = commanded.position_rad + self.approach_step_rad;
                } else if distance_rad < -self.approach_step_rad {
                    wanted.position_rad = commanded.position_rad - self.approach_step_rad;
                }
                wanted.velocity_rad_per_s = 0.0;
            } else {
                *commanded = at_rest(feedback, commanded);
                *wanted = *commanded;
            }
        }
        Some(wanted)
    }

    fn observe<D: DriveGroup<AXES>>(&mut self, drives: &mut D) {
        self.feedback = drives.observe().ok();
        for (commanded, feedback) in self
            .commanded
            .iter_mut()
            .zip(self.feedback.iter().flatten())
        {
            *commanded = at_rest(feedback, commanded);
        }
    }

    fn allow(&self, command: Command) -> Result<(), Refusal> {
        if command.allowed_in().contains(&self.state) {
            Ok(())
        } else {
            Err(Refusal::WrongState {
                command,
                state: self.state,
            })
        }
    }

    /// Feedback and first node, if the feedback can be believed and every axis stands at the node.
    fn near_first_node(
        &self,
        command: Command,
    ) -> Result<([Feedback; AXES], Sample<AXES>), Refusal> {
        let feedback = self.feedback.ok_or(Refusal::NoFeedback)?;
        let first = self.player.first().ok_or(Refusal::WrongState {
            command,
            state: self.state,
        })?;
        let tolerance_rad = self.config.accept.start_tolerance_rad;
        for (axis, (feedback, first_rad)) in (0u8..).zip(feedback.iter().zip(first.position_rad)) {
            monitor::alive(&self.config.monitor, axis, feedback).map_err(Refusal::Feedback)?;
            let measured_rad = feedback.position_rad;
            if (measured_rad - first_rad).abs() > tolerance_rad {
                return Err(Refusal::NotAtStart {
                    axis,
                    measured_rad,
                    first_rad,
                    tolerance_rad,
                });
            }
        }
        Ok((feedback, first))
    }

    /// Latches the first cause.
    fn fail(&mut self, cause: FaultCause) {
        if self.fault.is_none() {
            self.fault = Some(Fault {
                cause,
                tick: self.tick,
            });
        }
        self.state = State::Fault;
    }
}

/// Set-points axis by axis.
fn setpoints<const AXES: usize>(sample: Sample<AXES>) -> [Setpoint; AXES] {
    let mut setpoints = [Setpoint::default(); AXES];
    let values = sample
        .position_rad
        .into_iter()
        .zip(sample.velocity_rad_per_s)
        .zip(sample.torque_nm);
    for (setpoint, ((position_rad, velocity_rad_per_s), torque_nm)) in
        setpoints.iter_mut().zip(values)
    {
        *setpoint = Setpoint {
            position_rad,
            velocity_rad_per_s,
            torque_nm,
        };
    }
    setpoints
}

/// A set-point that asks an axis to stay where it is measured, or where it was told to be if the
/// measurement is no number.
fn at_rest(feedback: &Feedback, commanded: &Setpoint) -> Setpoint {
    let position_rad = if feedback.position_rad.is_finite() {
        feedback.position_rad
    } else {
        commanded.position_rad
    };
    Setpoint {
        position_rad,
        ..Setpoint::default()
    }
}
