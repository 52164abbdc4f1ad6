//! What the host can ask for, beside trajectories.

use stillpoint_shared::Sample;
use stillpoint_shared::status::{CommsPolicy, StartRequest};

use super::Executor;
use super::tick::setpoints;
use crate::comms::CommsWatch;
use crate::monitor::{self, Monitor};
use crate::path_time::{PathTime, speed_of_percent};
use crate::ramp::Ramp;
use crate::{Command, DriveStatus, FaultCause, Feedback, LimitFlags, Refusal, State};

impl<const AXES: usize> Executor<AXES> {
    /// Lets the next tick energise the drives, where they stand; they then creep to the first node,
    /// from which they may be no further than the start tolerance, now and until they are enabled.
    /// That must be so within [`ENABLING_TIME_TICKS`](super::ENABLING_TIME_TICKS), and stay so.
    pub fn arm(&mut self) -> Result<(), Refusal> {
        self.allows(Command::Arm)?;
        self.near_first_node(Command::Arm)?;
        self.path = PathTime::START;
        self.state = State::Armed;
        self.enabled = [false; AXES];
        self.armed_tick = self.tick;
        self.begin_record();
        Ok(())
    }

    /// A request to start what is loaded, without supervision of the host.
    pub fn start_request(&self) -> StartRequest {
        StartRequest {
            trajectory_hash: self.trajectory().header().content_hash,
            limits_hash: self.limits_hash,
            comms: CommsPolicy::Continue,
            comms_timeout_ticks: 0,
            dry_run: false,
        }
    }

    /// Plays from the next tick on, if the request means what is loaded, the drives are enabled and
    /// stand at the first node by fresh feedback.
    ///
    /// A dry run is the same with the drives off, from `Ready`: the same checks but that of enabled
    /// drives, and all that follows, set-points, monitors and record, but the following error; the
    /// drives are observed only. The path speed begins at the override, for the path begins at
    /// rest.
    pub fn start(&mut self, request: &StartRequest) -> Result<(), Refusal> {
        let command = if request.dry_run {
            Command::DryRun
        } else {
            Command::Start
        };
        self.allows(command)?;
        request.check(self.trajectory().header().content_hash, self.limits_hash)?;
        let (feedback, first) = self.near_first_node(command)?;
        if request.dry_run {
            self.commanded = setpoints(first);
        }
        let axes = self.commanded.iter().zip(&feedback).zip(first.position_rad);
        for (axis, ((commanded, feedback), first_rad)) in (0u8..).zip(axes) {
            if !request.dry_run && feedback.status != DriveStatus::Enabled {
                return Err(Refusal::NotEnabled { axis });
            }
            let distance_rad = first_rad - commanded.position_rad;
            if distance_rad != 0.0 {
                return Err(Refusal::Approaching { axis, distance_rad });
            }
        }
        self.path = PathTime::START;
        self.ramp = Ramp::at(self.wanted_speed());
        self.ever_limited = [LimitFlags::NONE; AXES];
        self.monitor = Monitor::NEW;
        self.held_by_silence = false;
        self.dry_run = request.dry_run;
        self.enabled = [!request.dry_run; AXES];
        self.comms = CommsWatch::begin(request.comms, request.comms_timeout_ticks, self.tick);
        self.state = State::Running;
        self.begin_record();
        Ok(())
    }

    /// Switches the drives off at rest, before or after a move.
    pub fn disarm(&mut self) -> Result<(), Refusal> {
        self.allows(Command::Disarm)?;
        self.state = State::Ready;
        self.dry_run = false;
        self.end_record();
        Ok(())
    }

    /// Slows down along the path from the next tick on; `Held` when the motion has stopped. Once
    /// held or on the way there, nothing changes.
    pub fn hold(&mut self) -> Result<(), Refusal> {
        self.allows(Command::Hold)?;
        if self.state == State::Running {
            self.state = State::Holding;
            self.held_by_silence = false;
        }
        Ok(())
    }

    /// Goes on along the path after a hold, at the override, from the next tick on.
    pub fn resume(&mut self) -> Result<(), Refusal> {
        self.allows(Command::Resume)?;
        self.state = State::Running;
        // Whoever resumes is there.
        self.comms.heard(self.tick);
        Ok(())
    }

    /// Sets the path speed to `percent` of the planned one from the next tick on, for this move and
    /// the following ones.
    ///
    /// 0 % stops as a hold does, but the state stays `Running`: another override goes on. While
    /// held, it is what the move is resumed at.
    pub fn set_override(&mut self, percent: u8) -> Result<(), Refusal> {
        self.slower_percent = 100u8
            .checked_sub(percent)
            .ok_or(Refusal::Override { percent })?;
        Ok(())
    }

    /// The path speed that the override asks for.
    #[inline]
    pub(super) fn wanted_speed(&self) -> u32 {
        speed_of_percent(self.override_percent())
    }

    /// Slows down along the path as a hold does, then takes the torque away; `clear` is needed to
    /// go on. Where nothing moves the torque goes with the next tick.
    pub fn quick_stop(&mut self) {
        self.stop(FaultCause::QuickStop);
        self.record_failure();
    }

    /// A quick stop for a reason.
    pub(super) fn stop(&mut self, cause: FaultCause) {
        match self.state {
            State::Stopping | State::Fault => {}
            State::Running | State::Holding | State::Held => {
                self.latch(cause);
                self.state = State::Stopping;
            }
            _ => self.fail(cause),
        }
    }

    /// Takes the torque away at the next tick and latches the fault, in any state.
    pub fn emergency_stop(&mut self) {
        self.fail(FaultCause::EmergencyStop);
        self.record_failure();
    }

    /// Leaves `Fault`, and lets the next tick reset the faults that the drives have latched: also
    /// where the executor is in no fault itself, for a drive may have come up in one. What is
    /// loaded or loading stays so, and the record stays.
    pub fn clear(&mut self) -> Result<(), Refusal> {
        self.allows(Command::Clear)?;
        if self.stop_pressed {
            return Err(Refusal::EmergencyStop);
        }
        self.reset_drives = true;
        if self.state == State::Fault {
            self.fault.empty_out();
            self.dry_run = false;
            self.state = self.rest();
        }
        Ok(())
    }

    /// Something was heard from the host at this tick.
    pub fn heard_from_host(&mut self, tick: u64) {
        self.comms.heard(tick);
    }

    /// Feedback and first node, if the feedback can be believed and every axis stands at the node.
    fn near_first_node(
        &self,
        command: Command,
    ) -> Result<([Feedback; AXES], Sample<AXES>), Refusal> {
        let feedback = self.feedback.get().ok_or(Refusal::NoFeedback)?;
        let first = Sample::first(self.trajectory()).ok_or(Refusal::WrongState {
            command,
            state: self.state,
        })?;
        let tolerance_rad = self.config.accept.start_tolerance_rad;
        for (axis, (feedback, first_rad)) in (0u8..).zip(feedback.iter().zip(first.position_rad)) {
            monitor::alive(&self.allowed, axis, feedback).map_err(Refusal::Feedback)?;
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
        Ok((*feedback, first))
    }
}
