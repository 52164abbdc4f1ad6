//! The drive loop: once per tick evaluate, limit, exchange, monitor.

use stillpoint_shared::Sample;
use stillpoint_shared::status::CommsPolicy;
use stillpoint_shared::time::TIME_TICKS_PER_SECOND;

use super::{Executor, TickReport};
use crate::limiter;
use crate::path_time::{FULL_SPEED, speed_ratio};
use crate::ramp::AxisLoad;
use crate::{
    DriveGroup, DriveStatus, FaultCause, Feedback, LimitFlags, Setpoint, State, TickInputs,
};

/// Longest time from arming until every drive is enabled, in time ticks: 5 s, enough for a brake to
/// open and for a motor to find its commutation.
pub const ENABLING_TIME_TICKS: u32 = 5 * TIME_TICKS_PER_SECOND;

impl<const AXES: usize> Executor<AXES> {
    /// One tick: evaluate, limit, exchange, monitor; or, with the drives off, make safe and observe.
    ///
    /// Bounded: one evaluation, and loops over the axes; division only while the path speed
    /// changes.
    pub fn tick<D: DriveGroup<AXES> + ?Sized>(
        &mut self,
        drives: &mut D,
        inputs: &TickInputs,
    ) -> TickReport<'_, AXES> {
        self.tick = self.tick.wrapping_add(1);
        self.sent_path_ticks = self.path.ticks();
        if let Err(cause) = self.watch(inputs) {
            self.fail(cause);
        }
        if self.state.is_energised() {
            if let Err(cause) = self.drive(drives) {
                drives.safe();
                self.fail(cause);
            }
        } else {
            drives.safe();
            if self.reset_drives {
                drives.reset_faults();
            }
            self.observe(drives);
        }
        self.reset_drives = false;
        self.record();
        self.report()
    }

    /// Emergency stop, the loop's own timing, and the host.
    fn watch(&mut self, inputs: &TickInputs) -> Result<(), FaultCause> {
        self.stop_pressed = inputs.emergency_stop;
        if inputs.emergency_stop {
            return Err(FaultCause::EmergencyStop);
        }
        if self.state.is_under_way() {
            self.monitor
                .check_loop(&self.allowed, inputs.busy_ticks, inputs.missed_ticks)?;
        }
        self.watch_host();
        Ok(())
    }

    /// What the policy says when the host has been silent for too long; see [`CommsPolicy`].
    fn watch_host(&mut self) {
        let Some(silence) = self.comms.silence(self.tick) else {
            return;
        };
        match (silence.policy, self.state) {
            (CommsPolicy::Hold, State::Running) => {
                self.state = State::Holding;
                self.held_by_silence = true;
            }
            (
                CommsPolicy::QuickStop,
                State::Running | State::Holding | State::Held | State::Done,
            ) => self.stop(FaultCause::CommsLost {
                silent_ticks: silence.silent_ticks,
                limit_ticks: silence.limit_ticks,
            }),
            _ => {}
        }
    }

    fn drive<D: DriveGroup<AXES> + ?Sized>(&mut self, drives: &mut D) -> Result<(), FaultCause> {
        let playing = self.state != State::Armed;
        let wanted = if playing {
            self.along_path()
        } else {
            self.approach()
        };
        let wanted = wanted.ok_or(FaultCause::NothingLoaded)?;
        let axes = self
            .commanded
            .iter_mut()
            .zip(&wanted)
            .zip(&self.limiters)
            .zip(&mut self.limited)
            .zip(&mut self.ever_limited);
        for ((((commanded, wanted), limiter), limited), ever_limited) in axes {
            (*commanded, *limited) = limiter::limit(limiter, commanded, wanted);
            *ever_limited |= *limited;
        }

        let answer = if self.dry_run {
            drives.safe();
            drives.observe()
        } else {
            drives.exchange(&self.commanded)
        };
        let feedback = self
            .feedback
            .keep(answer)
            .ok_or(FaultCause::ExchangeFailed)?;
        self.monitor
            .check(&self.allowed, &self.commanded, feedback, &self.enabled)?;
        if !playing {
            self.watch_enabling()?;
        }
        self.proceed()
    }

    /// An axis that is not enabled yet still stands near the first node, and does not take too long.
    fn watch_enabling(&mut self) -> Result<(), FaultCause> {
        let period_ticks = self.config.period_ticks;
        let limit_ticks = ENABLING_TIME_TICKS
            .checked_div(period_ticks)
            .unwrap_or_default();
        let waited_ticks = self.tick.wrapping_sub(self.armed_tick) as u32;
        let tolerance_rad = self.config.accept.start_tolerance_rad;
        let first = Sample::<AXES>::first(self.buffers.playing());
        let first = first.ok_or(FaultCause::NothingLoaded)?;
        let feedback = self.feedback.get().ok_or(FaultCause::ExchangeFailed)?;
        let axes = self.enabled.iter_mut().zip(feedback);
        for (axis, ((enabled, feedback), first_rad)) in (0..).zip(axes.zip(first.position_rad)) {
            if *enabled {
                continue;
            }
            let distance_rad = first_rad - feedback.position_rad;
            if distance_rad.abs() > tolerance_rad {
                return Err(FaultCause::LeftStart {
                    axis,
                    distance_rad,
                    tolerance_rad,
                });
            }
            *enabled = feedback.status == DriveStatus::Enabled;
            if !*enabled && waited_ticks > limit_ticks {
                return Err(FaultCause::NotEnabled {
                    axis,
                    waited_ticks,
                    limit_ticks,
                });
            }
        }
        Ok(())
    }

    /// Set-points on the path at the path speed of this tick: q(s), σ q′(s) and, as
    /// [`pace`](crate::pace) has it, A σ² + B σ̇ + G. At full speed, and at the end at any speed,
    /// they are the trajectory's values to the bit.
    fn along_path(&mut self) -> Option<[Setpoint; AXES]> {
        let ticks = self.path.ticks();
        let mut wanted = setpoints(self.buffers.sample(ticks)?);
        if ticks >= self.trajectory().duration_ticks() {
            return Some(wanted);
        }
        let wanted_speed = if self.state == State::Running {
            self.wanted_speed()
        } else {
            0
        };
        if self.ramp.is_at(wanted_speed) && wanted_speed == FULL_SPEED {
            return Some(wanted);
        }
        let loads = self.loads(ticks, &wanted);
        let change_per_s = if self.ramp.is_at(wanted_speed) {
            0.0
        } else {
            let limits = if self.state == State::Stopping {
                &self.pace.stop
            } else {
                &self.pace.limits
            };
            self.ramp.step(wanted_speed, limits, self.period_s, &loads)
        };
        let speed = speed_ratio(self.ramp.speed());
        for (wanted, load) in wanted.iter_mut().zip(&loads) {
            wanted.velocity_rad_per_s *= speed;
            wanted.torque_nm =
                load.planned_nm * speed * speed + load.momentum_nms * change_per_s + load.static_nm;
        }
        Some(wanted)
    }

    /// What each axis' torque is made of at path time `ticks`, and where it has to stay.
    fn loads(&self, ticks: u32, planned: &[Setpoint; AXES]) -> [AxisLoad; AXES] {
        let mut loads = [AxisLoad::NONE; AXES];
        let speed = speed_ratio(self.ramp.speed());
        let axes = loads
            .iter_mut()
            .zip(planned)
            .zip(&self.pace.axes)
            .zip(&self.limiters)
            .zip(&self.commanded);
        for ((((load, planned), pace), limiter), commanded) in axes {
            let static_nm = pace.static_nm + pace.static_nm_per_tick * ticks as f32;
            let velocity_rad_per_s = planned.velocity_rad_per_s;
            let (least_nm, most_nm) =
                limiter::torque_window(limiter, commanded.torque_nm, velocity_rad_per_s * speed);
            *load = AxisLoad {
                planned_nm: planned.torque_nm - static_nm,
                static_nm,
                momentum_nms: pace.inertia_kg_m2 * velocity_rad_per_s,
                least_nm,
                most_nm,
            };
        }
        loads
    }

    /// What follows from a tick of set-points: the end, standstill, or the next path time.
    fn proceed(&mut self) -> Result<(), FaultCause> {
        if !self.state.is_under_way() {
            return Ok(());
        }
        let end_ticks = self.trajectory().duration_ticks();
        let at_end = self.path.ticks() >= end_ticks;
        let stands = self.ramp.is_at(0);
        match self.state {
            // The first cause is latched already.
            State::Stopping if at_end || stands => return Err(FaultCause::QuickStop),
            _ if at_end => {
                self.state = State::Done;
                return Ok(());
            }
            State::Holding if stands && self.is_standing() => self.state = State::Held,
            _ => {}
        }
        let speed = self.ramp.speed();
        let next = self.ramp.next_speed(self.period_s);
        self.path
            .advance(speed, next, self.config.period_ticks, end_ticks);
        Ok(())
    }

    /// Whether every axis stands by its measured speed.
    fn is_standing(&self) -> bool {
        let most = self.config.standstill_speed_rad_per_s;
        let mut feedback = self.feedback.get().into_iter().flatten();
        self.dry_run || feedback.all(|feedback| feedback.velocity_rad_per_s.abs() <= most)
    }

    /// Set-points of an armed tick: an enabled axis creeps to the first node, any other stays where
    /// it is measured.
    fn approach(&mut self) -> Option<[Setpoint; AXES]> {
        let mut wanted = setpoints(Sample::first(self.buffers.playing())?);
        for ((wanted, commanded), feedback) in wanted
            .iter_mut()
            .zip(&mut self.commanded)
            .zip(self.feedback.get()?)
        {
            if feedback.status == DriveStatus::Enabled {
                creep(wanted, commanded, self.approach_step_rad);
            } else {
                *commanded = at_rest(feedback, commanded);
                *wanted = *commanded;
            }
        }
        Some(wanted)
    }

    fn observe<D: DriveGroup<AXES> + ?Sized>(&mut self, drives: &mut D) {
        self.limited = [LimitFlags::NONE; AXES];
        let Some(feedback) = self.feedback.keep(drives.observe()) else {
            return;
        };
        for (commanded, feedback) in self.commanded.iter_mut().zip(feedback) {
            *commanded = at_rest(feedback, commanded);
        }
    }
}

/// Set-points axis by axis.
pub(super) fn setpoints<const AXES: usize>(sample: Sample<AXES>) -> [Setpoint; AXES] {
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

/// Brings a set-point within `step_rad` of the one sent before, without speed.
fn creep(wanted: &mut Setpoint, commanded: &Setpoint, step_rad: f32) {
    let distance_rad = wanted.position_rad - commanded.position_rad;
    // Far from zero the step may be less than f32 can tell: one rounding error at least.
    let mut step_rad = step_rad;
    let least_rad = commanded.position_rad.abs() * f32::EPSILON;
    if least_rad > step_rad {
        step_rad = least_rad;
    }
    if distance_rad > step_rad {
        wanted.position_rad = commanded.position_rad + step_rad;
    } else if distance_rad < -step_rad {
        wanted.position_rad = commanded.position_rad - step_rad;
    }
    wanted.velocity_rad_per_s = 0.0;
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
