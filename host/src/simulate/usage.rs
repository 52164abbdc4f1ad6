//! How much of the limits a recording uses.

use super::recording::{Frame, Recording};
use crate::machine::Plant;
use crate::movefile::Limits;

/// The limit that a recording uses most.
#[derive(Clone, Debug, PartialEq)]
pub struct Usage {
    /// Name of the limit.
    pub limit: String,
    /// When.
    pub time_s: f64,
    /// Largest value over bound: above 1 the limit is broken.
    pub ratio: f64,
}

impl Usage {
    /// The limit used most over the whole recording, ringing included.
    ///
    /// The torque rate is the change of torque between two frames.
    #[must_use]
    pub fn most(plant: &dyn Plant, limits: &Limits, recording: &Recording) -> Self {
        let ratio = plant.reducer_ratio();
        let speed_limit = limits.joint_speed_rad_per_s(ratio);
        let mut worst = Worst {
            ratio: 0.0,
            time_s: 0.0,
            what: What::Nothing,
        };
        let mut before: Option<&Frame> = None;
        for frame in &recording.frames {
            let time_s = frame.time_s;
            for (index, (value, bound)) in frame.outputs.iter().zip(&limits.outputs).enumerate() {
                if let Some(bound) = bound {
                    worst.see(value.abs() / bound, time_s, What::Output(index));
                }
            }
            let axes = frame.joint_rates_rad_per_s.iter().zip(&frame.torques_nm);
            for (axis, (rate, torque)) in axes.enumerate() {
                worst.see(rate.abs() / speed_limit, time_s, What::Speed(axis));
                let available = limits.torque_at_joint_speed(*rate, ratio);
                worst.see(torque.abs() / available, time_s, What::Torque(axis));
            }
            if let Some(before) = before {
                let torques = frame.torques_nm.iter().zip(&before.torques_nm);
                for (axis, (now, then)) in torques.enumerate() {
                    let rate = (now - then).abs() / (time_s - before.time_s);
                    let used = rate / limits.torque_rate_nm_per_s;
                    worst.see(used, time_s, What::TorqueRate(axis));
                }
            }
            before = Some(frame);
        }
        Self {
            limit: worst.what.name(plant),
            time_s: worst.time_s,
            ratio: worst.ratio,
        }
    }
}

#[derive(Clone, Copy)]
enum What {
    Nothing,
    Output(usize),
    Speed(usize),
    Torque(usize),
    TorqueRate(usize),
}

impl What {
    fn name(self, plant: &dyn Plant) -> String {
        match self {
            Self::Nothing => "nothing".to_owned(),
            Self::Output(index) => plant
                .outputs()
                .get(index)
                .map_or_else(String::new, |output| output.key.to_owned()),
            Self::Speed(axis) => format!("speed of axis {}", axis + 1),
            Self::Torque(axis) => format!("torque of axis {}", axis + 1),
            Self::TorqueRate(axis) => format!("torque rate of axis {}", axis + 1),
        }
    }
}

struct Worst {
    ratio: f64,
    time_s: f64,
    what: What,
}

impl Worst {
    fn see(&mut self, ratio: f64, time_s: f64, what: What) {
        if ratio > self.ratio {
            *self = Self {
                ratio,
                time_s,
                what,
            };
        }
    }
}
