//! Telemetry's way from the drive loop to the link: every n-th tick, as far as there is room.

use heapless::{Deque, Vec};
use stillpoint_shared::protocol::{Channels, Telemetry, TelemetryConfig};

use super::answers::gathered;
use crate::path_time::speed_ratio;
use crate::{Feedback, Setpoint, TickReport};

/// Samples that wait to be sent.
const QUEUE: usize = 8;

/// Samples the drive loop. All bytes of a new one are zero.
#[derive(Debug)]
pub struct Tap {
    config: TelemetryConfig,
    in_ticks: u16,
    dropped: u32,
    queue: Deque<Telemetry, QUEUE>,
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
            queue: Deque::new(),
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

    fn push<const AXES: usize>(&mut self, report: &TickReport<AXES>) {
        if self.queue.is_full() {
            self.dropped = self.dropped.saturating_add(1);
            return;
        }
        let channels = self.config.channels;
        let mut values = Vec::new();
        let mut channel = |channel, value: fn(&Setpoint, Option<&Feedback>) -> f32| {
            if channels.contains(channel) {
                let feedback = report.feedback.as_ref();
                for (axis, setpoint) in report.setpoints.iter().enumerate() {
                    let feedback = feedback.and_then(|feedback| feedback.get(axis));
                    // There is room for all channels of all axes.
                    let _ = values.push(value(setpoint, feedback));
                }
            }
        };
        channel(Channels::SETPOINT_POSITION, |s, _| s.position_rad);
        channel(Channels::SETPOINT_VELOCITY, |s, _| s.velocity_rad_per_s);
        channel(Channels::SETPOINT_TORQUE, |s, _| s.torque_nm);
        channel(Channels::MEASURED_POSITION, |_, f| {
            f.map_or(f32::NAN, |f| f.position_rad)
        });
        channel(Channels::MEASURED_VELOCITY, |_, f| {
            f.map_or(f32::NAN, |f| f.velocity_rad_per_s)
        });
        let limited = channels
            .contains(Channels::LIMITS)
            .then_some(report.limited);
        // There is room: this cannot fail.
        let _ = self.queue.push_back(Telemetry {
            tick: report.tick,
            dropped: self.dropped,
            state: report.state,
            path_ticks: report.path_ticks,
            path_speed: speed_ratio(report.path_speed),
            channels,
            values,
            limited: gathered(limited.into_iter().flatten().copied()),
        });
    }

    /// The oldest sample that waits.
    pub fn pop(&mut self) -> Option<Telemetry> {
        self.queue.pop_front()
    }

    /// Samples dropped since telemetry was set.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
