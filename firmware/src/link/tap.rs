//! Telemetry's way from the drive loop to the link: every n-th tick, as far as there is room.

use heapless::Vec;
use stillpoint_shared::protocol::{Channels, Telemetry, TelemetryConfig};

use crate::path_time::speed_ratio;
use crate::{Feedback, State, TickReport};

/// Samples that wait to be sent.
const QUEUE: usize = 8;

const EMPTY: Telemetry = Telemetry {
    tick: 0,
    dropped: 0,
    state: State::Idle,
    path_ticks: 0,
    path_speed: 0.0,
    channels: Channels::NONE,
    values: Vec::new(),
    limited: Vec::new(),
};

/// Samples the drive loop. All bytes of a new one are zero.
#[derive(Debug)]
pub struct Tap {
    config: TelemetryConfig,
    in_ticks: u16,
    dropped: u32,
    /// A ring whose samples are filled where they lie: to be moved costs the drive loop as much as
    /// to be made.
    ring: [Telemetry; QUEUE],
    oldest: usize,
    waiting: usize,
}

impl Default for Tap {
    fn default() -> Self {
        Self::off()
    }
}

impl Tap {
    /// Samples nothing.
    pub const fn off() -> Self {
        Self {
            config: TelemetryConfig::OFF,
            in_ticks: 0,
            dropped: 0,
            ring: [const { EMPTY }; QUEUE],
            oldest: 0,
            waiting: 0,
        }
    }

    /// Samples anew; what was waiting is forgotten.
    pub fn set(&mut self, config: TelemetryConfig) {
        *self = Self {
            config,
            ..Self::off()
        };
    }

    /// Looks at a tick. Costs one comparison where no sample is due.
    #[inline]
    pub fn record<const AXES: usize>(&mut self, report: &TickReport<AXES>) {
        if self.config.every_ticks == 0 {
            return;
        }
        self.in_ticks = self.in_ticks.saturating_sub(1);
        if self.in_ticks == 0 {
            self.in_ticks = self.config.every_ticks;
            self.push(report);
        }
    }

    #[inline]
    fn push<const AXES: usize>(&mut self, report: &TickReport<AXES>) {
        let place = (self.oldest + self.waiting) % QUEUE;
        let sample = match self.ring.get_mut(place) {
            Some(sample) if self.waiting < QUEUE => sample,
            _ => {
                self.dropped = self.dropped.saturating_add(1);
                return;
            }
        };
        self.waiting += 1;
        let channels = self.config.channels;
        sample.tick = report.tick;
        sample.dropped = self.dropped;
        sample.state = report.state;
        sample.path_ticks = report.path_ticks;
        sample.path_speed = speed_ratio(report.path_speed);
        sample.channels = channels;
        sample.values.clear();
        let mut channel = |channel, values: [f32; AXES]| {
            if channels.contains(channel) {
                // There is room for all channels of all axes.
                let _ = sample.values.extend_from_slice(&values);
            }
        };
        let setpoints = report.setpoints;
        let measured = |value: fn(&Feedback) -> f32| match report.feedback {
            Some(feedback) => feedback.each_ref().map(value),
            None => [f32::NAN; AXES],
        };
        channel(
            Channels::SETPOINT_POSITION,
            setpoints.each_ref().map(|s| s.position_rad),
        );
        channel(
            Channels::SETPOINT_VELOCITY,
            setpoints.each_ref().map(|s| s.velocity_rad_per_s),
        );
        channel(
            Channels::SETPOINT_TORQUE,
            setpoints.each_ref().map(|s| s.torque_nm),
        );
        channel(Channels::MEASURED_POSITION, measured(|f| f.position_rad));
        channel(
            Channels::MEASURED_VELOCITY,
            measured(|f| f.velocity_rad_per_s),
        );
        sample.limited.clear();
        if channels.contains(Channels::LIMITS) {
            // There is room for all axes.
            let _ = sample.limited.extend_from_slice(report.limited);
        }
    }

    /// The oldest sample that waits.
    pub fn pop(&mut self) -> Option<Telemetry> {
        self.waiting = self.waiting.checked_sub(1)?;
        let sample = self.ring.get(self.oldest)?.clone();
        self.oldest = (self.oldest + 1) % QUEUE;
        Some(sample)
    }

    /// Samples dropped since telemetry was set.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
