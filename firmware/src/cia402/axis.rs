//! One axis: sets its drive up, listens to it, and says what it is told in each bus cycle.

use stillpoint_shared::drive_config::Cycle;
use stillpoint_shared::drive_error::seen;
use stillpoint_shared::time::{self, TIME_TICKS_PER_SECOND};
use stillpoint_shared::{AxisDrive, BusConfig};

use super::error_code::{ErrorCode, LAST_FAULT};
use super::frame::Service;
use super::measured::{Measured, Message};
use super::nmt::{Heartbeat, NmtCommand, NmtState};
use super::report::{AxisReport, Stage};
use super::reset::FaultReset;
use super::sdo::{Answer, Client, Object};
use super::setup::{self, Step};
use super::state::{Command, DriveState};
use super::target::Target;
use super::trouble::Trouble;
use crate::{DriveStatus, Feedback, Setpoint};

/// Time in ms after which an SDO request counts as not answered.
const SDO_TIMEOUT_MS: u32 = 100;

/// Requests in a row without answer after which the set-up begins anew.
const MOST_SILENCES: u8 = 3;

/// Time in ms a started drive has to send feedback in the right mode, and the longest it may be
/// silent afterwards until it counts as not sending any.
const START_TIMEOUT_MS: u32 = 500;

/// Messages in a row that may be lost before what the drive last said no longer counts. The
/// executor's monitor is stricter; this is the group's own limit.
const MOST_LOST: u16 = 3;

/// Messages waiting to be sent to one drive. A newer one takes an older one's place, so that they
/// never pile up.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outbox {
    pub(super) nmt: Option<[u8; 2]>,
    pub(super) setpoint: Option<[u8; 8]>,
    pub(super) sdo: Option<[u8; 8]>,
}

/// Times in ticks of the executor.
#[derive(Debug, Clone, Copy)]
struct Times {
    tick_s: f32,
    sdo_ticks: u16,
    start_ticks: u16,
    heartbeat_ticks: u32,
    oldest_ticks: u16,
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) drive: AxisDrive,
    pub(super) outbox: Outbox,
    bus: BusConfig,
    times: Times,
    stage: Stage,
    started_ticks: u16,
    client: Client,
    silences: u8,
    silent_at: Option<Object>,
    heartbeat: Heartbeat,
    measured: Option<Measured>,
    target: Target,
    trouble: Option<Trouble>,
    error: ErrorCode,
    reset: FaultReset,
}

impl Axis {
    pub(super) fn new(drive: AxisDrive, bus: BusConfig, cycle: &Cycle, tick_ticks: u32) -> Self {
        let ticks = |ms: u32| {
            let time_ticks = ms.saturating_mul(TIME_TICKS_PER_SECOND / 1000);
            time_ticks.div_ceil(tick_ticks.max(1))
        };
        let few_ticks = |ms: u32| u16::try_from(ticks(ms)).unwrap_or(u16::MAX);
        Self {
            drive,
            outbox: Outbox::default(),
            bus,
            times: Times {
                tick_s: time::seconds(tick_ticks) as f32,
                sdo_ticks: few_ticks(SDO_TIMEOUT_MS),
                start_ticks: few_ticks(START_TIMEOUT_MS),
                heartbeat_ticks: ticks(u32::from(bus.heartbeat_timeout_ms)),
                oldest_ticks: cycle.feedback_age_ticks(MOST_LOST),
            },
            stage: Stage::Setup { step: 0 },
            started_ticks: 0,
            client: Client::default(),
            silences: 0,
            silent_at: None,
            heartbeat: Heartbeat::new(),
            measured: None,
            target: Target::new(&drive),
            trouble: None,
            error: ErrorCode::default(),
            reset: FaultReset::default(),
        }
    }

    /// Takes a message of the drive. `sync` is the tick of the last SYNC and how many ticks ago it
    /// was; `None` if there was none.
    pub(super) fn receive(&mut self, service: Service, data: &[u8], sync: Option<(u32, u16)>) {
        match service {
            Service::Emergency => self.error.emergency(data, self.in_fault()),
            Service::Feedback => self.feedback_message(data, sync),
            Service::SdoAnswer => {
                if let Some(answer) = self.client.receive(data) {
                    self.answered(answer);
                }
            }
            Service::Heartbeat => {
                if let &[byte] = data {
                    self.heartbeat_message(NmtState::from_heartbeat(byte));
                }
            }
        }
    }

    fn feedback_message(&mut self, data: &[u8], sync: Option<(u32, u16)>) {
        let (Stage::Starting | Stage::Operational, Some((at_tick, age_ticks))) = (self.stage, sync)
        else {
            return;
        };
        let Some(message) = Message::parse(data) else {
            let bytes = data.len() as u8;
            return self.latch(Trouble::FeedbackLength { bytes });
        };
        let was_fault = self.in_fault();
        let measured = Measured::next(
            self.measured.as_ref(),
            message,
            at_tick,
            age_ticks,
            &self.target.units,
            self.times.tick_s,
        );
        self.measured = Some(measured);
        if was_fault && !self.in_fault() {
            self.error = ErrorCode::default();
        }
        if self.stage == Stage::Starting && measured.in_mode() {
            self.stage = Stage::Operational;
        }
    }

    fn heartbeat_message(&mut self, state: NmtState) {
        let is_first = self.heartbeat.told.is_none();
        self.heartbeat.receive(state);
        match (self.stage, state) {
            // A drive that has just started knows nothing of what it was told before.
            (Stage::Setup { .. }, NmtState::BootUp) if self.trouble.is_none() => self.set_up(),
            (Stage::Starting | Stage::Operational, NmtState::BootUp) => {
                self.latch(Trouble::Restarted);
            }
            // The first one may be from before the start.
            (Stage::Operational, state) if state != NmtState::Operational && !is_first => {
                self.latch(Trouble::NotOperational { state });
            }
            _ => {}
        }
    }

    /// One tick: waits that end, and the next step of the set-up.
    pub(super) fn tick(&mut self) {
        if let Some(measured) = &mut self.measured {
            measured.age_ticks = measured.age_ticks.saturating_add(1);
        }
        let asked = self.client.pending();
        if let Some(answer) = self.client.tick(self.times.sdo_ticks) {
            if matches!(self.stage, Stage::Setup { .. }) {
                self.silent_at = asked;
            }
            self.answered(answer);
        }
        if self.trouble.is_some() {
            return;
        }
        match self.stage {
            Stage::Setup { step } => self.next_step(step),
            Stage::Starting => {
                self.started_ticks = self.started_ticks.saturating_add(1);
                // Network management is not answered: the command may have been lost.
                let again = self
                    .started_ticks
                    .is_multiple_of(self.times.sdo_ticks.max(1));
                if again {
                    self.outbox.nmt = Some(NmtCommand::Start.bytes(self.drive.node));
                }
                if self.started_ticks > self.times.start_ticks {
                    self.latch(self.measured.map_or(Trouble::NoFeedback, |measured| {
                        let shown = measured.message.mode;
                        Trouble::Mode { shown }
                    }));
                }
            }
            Stage::Operational => self.watch(),
        }
    }

    /// A drive in operation is still there; and its error code is known.
    fn watch(&mut self) {
        let timeout_ms = self.bus.heartbeat_timeout_ms;
        let is_silent = |measured: Measured| measured.age_ticks > self.times.start_ticks;
        if self.heartbeat.tick(self.times.heartbeat_ticks) {
            self.latch(Trouble::HeartbeatLost { timeout_ms });
        } else if self.measured.is_none_or(is_silent) {
            self.latch(Trouble::NoFeedback);
        } else if self.in_fault() && !self.client.is_busy() && self.error.must_ask() {
            self.outbox.sdo = Some(self.client.read(LAST_FAULT));
        }
    }

    fn next_step(&mut self, number: u8) {
        if self.client.is_busy() || self.outbox.nmt.is_some() {
            return;
        }
        let mut following = number + 1;
        match setup::step(number, &self.drive, &self.bus) {
            Some(Step::Nmt(command)) => self.outbox.nmt = Some(command.bytes(self.drive.node)),
            Some(Step::Skip) => {}
            Some(Step::Read(object)) => {
                self.outbox.sdo = Some(self.client.read(object));
                following = number;
            }
            Some(Step::Write(object, value)) => {
                self.outbox.sdo = Some(self.client.write(object, value));
                following = number;
            }
            None => {
                self.stage = Stage::Starting;
                self.started_ticks = 0;
                self.heartbeat.restart();
                return;
            }
        }
        self.stage = Stage::Setup { step: following };
    }

    fn answered(&mut self, answer: Answer) {
        let Stage::Setup { step } = self.stage else {
            if let Answer::Read(code) = answer {
                self.error.code = code as u16;
            }
            return;
        };
        if answer == Answer::Silent {
            // Request or answer may have been lost: once more, and at last from the beginning.
            self.silences += 1;
            if self.silences >= MOST_SILENCES {
                self.set_up();
            }
            return;
        }
        self.silences = 0;
        self.silent_at = None;
        let asked = setup::step(step, &self.drive, &self.bus).unwrap_or(Step::Skip);
        match setup::judge(asked, answer, &self.drive) {
            Ok(()) => self.stage = Stage::Setup { step: step + 1 },
            Err(trouble) => self.latch(trouble),
        }
    }

    /// Begins anew; what the drive said before no longer counts.
    fn set_up(&mut self) {
        self.stage = Stage::Setup { step: 0 };
        self.silences = 0;
        self.client.abandon();
        self.outbox = Outbox::default();
        self.measured = None;
        self.error = ErrorCode::default();
    }

    fn latch(&mut self, trouble: Trouble) {
        self.trouble.get_or_insert(trouble);
    }

    /// State by the newest statusword.
    fn state(&self) -> Option<DriveState> {
        self.measured.and_then(|measured| measured.state)
    }

    fn in_fault(&self) -> bool {
        self.state().is_some_and(DriveState::is_fault)
    }

    /// Ends a trouble, or else the drive's fault, if it is in one now.
    pub(super) fn request_reset(&mut self) {
        if self.trouble.take().is_some() {
            self.silent_at = None;
            self.set_up();
        } else if self.state() == Some(DriveState::Fault) {
            self.reset.request();
        }
    }

    /// Whether a drive is in the mode, was heard of lately, and is in no trouble.
    fn is_usable(&self, measured: &Measured) -> bool {
        self.trouble.is_none()
            && measured.age_ticks <= self.times.oldest_ticks
            && measured.in_mode()
    }

    /// The message of this bus cycle: controlword (6040h), target position (607Ah), torque offset
    /// (60B2h); `wanted` is none while the drives are to be off. `None` if the drive has not said
    /// yet where it stands.
    ///
    /// The set-point is passed on only to a drive that has confirmed that it follows; any other is
    /// told to stay where it was measured, without torque offset.
    pub(super) fn message(&mut self, wanted: Option<&Setpoint>) -> Option<[u8; 8]> {
        let measured = self.measured?;
        let usable = self.is_usable(&measured);
        let (target_counts, torque_permille) = match wanted {
            Some(setpoint) if usable && measured.follows(self.drive.tells_following) => {
                self.target.follow(setpoint)
            }
            _ => self.target.stay(measured.message.counts),
        };
        let command = match (wanted, measured.state) {
            (None, state) => self.reset.next(state),
            (Some(_), Some(state)) if usable => state.towards_enabled(),
            (Some(_), _) => Command::DisableVoltage,
        };
        if wanted.is_some() {
            self.reset.cancel();
        }
        let [c0, c1] = command.controlword().to_le_bytes();
        let [p0, p1, p2, p3] = target_counts.to_le_bytes();
        let [t0, t1] = torque_permille.to_le_bytes();
        Some([c0, c1, p0, p1, p2, p3, t0, t1])
    }

    /// What the executor sees. Until the drive has said where it stands, the position is 0 and
    /// infinitely old.
    pub(super) fn feedback(&self) -> Feedback {
        let measured = self.measured.as_ref();
        Feedback {
            position_rad: measured.map_or(0.0, |measured| measured.position_rad),
            velocity_rad_per_s: measured.map_or(0.0, |measured| measured.velocity_rad_per_s),
            age_ticks: measured.map_or(u16::MAX, |measured| measured.age_ticks),
            status: self.status(),
        }
    }

    fn status(&self) -> DriveStatus {
        if let Some(trouble) = &self.trouble {
            let code = trouble.code();
            return DriveStatus::Fault { code };
        }
        match &self.measured {
            Some(_) if self.in_fault() => DriveStatus::Fault {
                code: self.error.of_fault(),
            },
            Some(measured)
                if self.is_usable(measured) && measured.follows(self.drive.tells_following) =>
            {
                DriveStatus::Enabled
            }
            None if self.silent_at.is_some() => DriveStatus::Fault {
                code: seen::NO_ANSWER,
            },
            _ => DriveStatus::Disabled,
        }
    }

    pub(super) fn report(&self) -> AxisReport {
        AxisReport {
            stage: self.stage,
            state: self.state(),
            nmt: self.heartbeat.told,
            trouble: self.trouble,
            error_code: self.error.code,
            silent_at: self.silent_at,
            torque_saturated: self.target.torque_saturated,
            position_saturated: self.target.position_saturated,
        }
    }
}
