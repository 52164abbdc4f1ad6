//! The firmware's executor in front of simulated drives on the flexible machine: what the board will do.

use super::drives::SimulatedDrives;
use super::modes::ModesError;
use super::recording::{Command, Recording};
use super::settings::{DriveSettings, DriveSettingsError};
use super::trajectory::board_limits;
use crate::machine::Plant;
use crate::movefile::Limits;
use nalgebra::SVector;
use stillpoint_firmware::{
    Config, ConfigError, DriveGroup, Executor, Fault, Refusal, Setpoint, State, TickInputs,
};
use stillpoint_shared::{LimitsError, MAX_AXES, Trajectory, time};

/// What plays a trajectory on what.
#[derive(Clone, Copy)]
pub struct ClosedLoop<'a> {
    /// The machine that is really there (see [`DriveSettings::real_machine`]).
    pub plant: &'a dyn Plant,
    /// Limits of the move, by which the executor accepts it.
    pub limits: &'a Limits,
    /// Pose at which the machine stands at first.
    pub from: &'a [f64],
    /// The drives.
    pub drives: &'a DriveSettings,
    /// The executor.
    pub executor: Config,
    /// Time watched after the end of the move.
    pub after_s: f64,
}

/// Why a trajectory was not played to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClosedLoopError {
    /// The drives' settings are impossible.
    #[error("[drive] {0}")]
    Settings(#[from] DriveSettingsError),
    /// The limits are none that a board takes.
    #[error("{0}")]
    Limits(LimitsError),
    /// The executor's configuration is impossible.
    #[error("{0}")]
    Executor(ConfigError),
    /// The machine and the trajectory do not fit, or the board has not as many axes.
    #[error(
        "the trajectory has {trajectory} axes, the machine {machine}: up to {MAX_AXES} and equal are possible"
    )]
    Axes {
        /// Axes of the trajectory.
        trajectory: usize,
        /// Axes of the machine.
        machine: usize,
    },
    /// The machine is singular where it stands.
    #[error(transparent)]
    Singular(#[from] ModesError),
    /// The executor refuses the trajectory.
    #[error("the executor refuses: {0}")]
    Refused(Refusal),
    /// The executor took the torque away.
    #[error("stopped {time_s:.4} s into the move: {fault}")]
    Fault {
        /// Time since the start.
        time_s: f64,
        /// The first cause.
        fault: Fault,
    },
    /// The mechanism has left what the model describes.
    #[error("the mechanism falls apart {time_s:.4} s into the move")]
    Undefined {
        /// Time since the start.
        time_s: f64,
    },
}

/// Ticks after which an armed executor has to have reached the first node: the start tolerance is far less away.
const APPROACH_TICKS: usize = 4000;

impl<'a> ClosedLoop<'a> {
    /// A machine with a 4 kHz executor, watched for 0.35 s after the move.
    #[must_use]
    pub fn new(
        plant: &'a dyn Plant,
        limits: &'a Limits,
        from: &'a [f64],
        drives: &'a DriveSettings,
    ) -> Self {
        Self {
            plant,
            limits,
            from,
            drives,
            executor: Config::default(),
            after_s: 0.35,
        }
    }

    /// Loads, arms, starts and records, from the first tick of the move on, one frame per tick.
    ///
    /// # Errors
    /// [`ClosedLoopError`]; what was recorded until then is lost.
    pub fn play(&self, trajectory: &Trajectory) -> Result<Recording, ClosedLoopError> {
        self.drives.validate()?;
        let (trajectory_axes, machine) = (trajectory.axes(), self.plant.axis_count());
        match machine {
            _ if trajectory_axes != machine => Err(ClosedLoopError::Axes {
                trajectory: trajectory_axes,
                machine,
            }),
            1 => self.play_on::<1>(trajectory),
            2 => self.play_on::<2>(trajectory),
            3 => self.play_on::<3>(trajectory),
            4 => self.play_on::<4>(trajectory),
            5 => self.play_on::<5>(trajectory),
            6 => self.play_on::<6>(trajectory),
            _ => Err(ClosedLoopError::Axes {
                trajectory: trajectory_axes,
                machine,
            }),
        }
    }

    /// Feeds set-points that a board has sent into the simulated drives, tick by tick: those of the move, and the last of
    /// them until the watch ends. `trajectory` says when the move ends. One frame per tick, as [`ClosedLoop::play`].
    ///
    /// # Errors
    /// [`ClosedLoopError`], as far as it concerns the drives and the machine.
    pub fn feed<const N: usize>(
        &self,
        trajectory: &Trajectory,
        sent: &[[Setpoint; N]],
    ) -> Result<Recording, ClosedLoopError> {
        self.drives.validate()?;
        let rest = self.plant.rest(self.from);
        let mut drives = SimulatedDrives::<N>::new(self.plant, self.limits, self.drives, &rest)?;
        let tick_s = time::seconds(self.executor.period_ticks);
        let mut setpoints = sent.first().copied().unwrap_or([Setpoint::default(); N]);
        // As with the executor, the first set-point switches the drives on one tick before the move.
        let Ok(_) = drives.exchange(&setpoints);
        drives
            .advance(tick_s)
            .ok_or(ClosedLoopError::Undefined { time_s: 0.0 })?;
        let mut sent = sent.iter();
        self.record(&mut drives, trajectory, |drives, _| {
            setpoints = sent.next().copied().unwrap_or(setpoints);
            let Ok(_) = drives.exchange(&setpoints);
            Ok(Command {
                setpoints: setpoints.to_vec(),
                limited: Vec::new(),
            })
        })
    }

    fn play_on<const N: usize>(
        &self,
        trajectory: &Trajectory,
    ) -> Result<Recording, ClosedLoopError> {
        let tick_s = time::seconds(self.executor.period_ticks);
        let rest = self.plant.rest(self.from);
        let mut drives = SimulatedDrives::<N>::new(self.plant, self.limits, self.drives, &rest)?;
        let limits = board_limits(self.limits, self.plant).map_err(ClosedLoopError::Limits)?;
        let mut executor =
            Executor::<N>::new(limits, self.executor).map_err(ClosedLoopError::Executor)?;
        let angles = self.plant.joint_angles(&rest);
        let measured = SVector::from_iterator(angles.into_iter().map(|angle| angle as f32));
        executor
            .load(trajectory, &measured)
            .map_err(ClosedLoopError::Refused)?;
        self.start(&mut executor, &mut drives, tick_s)?;

        self.record(&mut drives, trajectory, |drives, time_s| {
            let report = executor.tick(drives, &TickInputs::default());
            match report.fault {
                Some(fault) => Err(ClosedLoopError::Fault { time_s, fault }),
                None => Ok(Command {
                    setpoints: report.setpoints.to_vec(),
                    limited: report.limited.to_vec(),
                }),
            }
        })
    }

    /// Records from the first tick of the move on until the watch ends; `tick` tells the drives what to do.
    fn record<const N: usize>(
        &self,
        drives: &mut SimulatedDrives<'_, N>,
        trajectory: &Trajectory,
        mut tick: impl FnMut(&mut SimulatedDrives<'_, N>, f64) -> Result<Command, ClosedLoopError>,
    ) -> Result<Recording, ClosedLoopError> {
        let tick_s = time::seconds(self.executor.period_ticks);
        let duration_s = time::seconds(trajectory.duration_ticks());
        // The last set-point goes out with the first tick at or after the end, and is reached one tick later.
        let rest_from_s = ((duration_s / tick_s).ceil() + 1.0) * tick_s + self.drives.delay_s;
        let ticks = ((rest_from_s + self.after_s) / tick_s).round() as usize;
        let mut recording = Recording {
            duration_s,
            rest_from_s,
            ..Recording::default()
        };
        for index in 0..=ticks {
            let time_s = index as f64 * tick_s;
            let command = tick(drives, time_s)?;
            let frame = drives.frame(time_s, recording.frames.last());
            recording.frames.push(frame);
            recording.commands.push(command);
            drives
                .advance(tick_s)
                .ok_or(ClosedLoopError::Undefined { time_s })?;
        }
        Ok(recording)
    }

    /// Brings the executor from `Ready` to `Running`.
    fn start<const N: usize>(
        &self,
        executor: &mut Executor<N>,
        drives: &mut SimulatedDrives<'_, N>,
        tick_s: f64,
    ) -> Result<(), ClosedLoopError> {
        let mut refusal = None;
        for _ in 0..APPROACH_TICKS {
            let report = executor.tick(drives, &TickInputs::default());
            if let Some(fault) = report.fault {
                return Err(ClosedLoopError::Fault { time_s: 0.0, fault });
            }
            drives
                .advance(tick_s)
                .ok_or(ClosedLoopError::Undefined { time_s: 0.0 })?;
            let order = if executor.state() == State::Ready {
                executor.arm()
            } else {
                executor.start(&executor.start_request())
            };
            match order {
                Ok(()) if executor.state() == State::Running => return Ok(()),
                Ok(()) => {}
                // Enabling and creeping to the first node take their time.
                Err(wait @ (Refusal::NotEnabled { .. } | Refusal::Approaching { .. })) => {
                    refusal = Some(wait);
                }
                Err(other) => return Err(ClosedLoopError::Refused(other)),
            }
        }
        Err(ClosedLoopError::Refused(
            refusal.unwrap_or(Refusal::NoFeedback),
        ))
    }
}
