//! Limits of a move, and how much of them a recording uses.

use super::recording::Recording;
use crate::machine::Plant;
use stillpoint_shared::{AxisLimits, Limits};

/// A limit on the magnitude of one output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputBound {
    /// Index among the plant's outputs.
    pub output: usize,
    /// Largest magnitude allowed.
    pub bound: f64,
}

/// All limits of a move.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Limits of the axes.
    pub axes: Limits,
    /// Limits of outputs.
    pub outputs: Vec<OutputBound>,
}

/// The limit that a recording uses most.
#[derive(Clone, Debug, PartialEq)]
pub struct Use {
    /// Name of the limit.
    pub limit: String,
    /// When.
    pub time_s: f64,
    /// Largest value over bound: above 1 the limit is broken.
    pub ratio: f64,
}

impl Bounds {
    /// The limit used most over the whole recording, ringing included.
    ///
    /// The torque rate is the change of torque between two frames.
    #[must_use]
    pub fn most_used(&self, plant: &dyn Plant, recording: &Recording) -> Use {
        let mut worst = Worst { ratio: 0.0, time_s: 0.0, what: What::Output(0) };
        let mut before: Option<&super::recording::Frame> = None;
        for frame in &recording.frames {
            for bound in &self.outputs {
                let value = frame.outputs.get(bound.output).map_or(0.0, |x| x.abs());
                worst.see(value / bound.bound, frame.time_s, What::Output(bound.output));
            }
            let axes = frame.joint_rates_rad_per_s.iter().zip(&frame.torques_nm);
            for (axis, ((rate, torque), limits)) in axes.zip(self.axes.axes()).enumerate() {
                let speed = rate.abs() / f64::from(limits.speed_rad_per_s);
                worst.see(speed, frame.time_s, What::Speed(axis));
                let available = available_torque_nm(limits, *rate);
                worst.see(torque.abs() / available, frame.time_s, What::Torque(axis));
                if let Some(before) = before {
                    let change = (torque - before.torques_nm[axis]).abs();
                    let per_time = change / (frame.time_s - before.time_s);
                    let bound = f64::from(limits.torque_rate_nm_per_s);
                    worst.see(per_time / bound, frame.time_s, What::TorqueRate(axis));
                }
            }
            before = Some(frame);
        }
        Use {
            limit: match worst.what {
                What::Output(index) => plant
                    .outputs()
                    .get(index)
                    .map_or_else(String::new, |output| output.key.to_owned()),
                What::Speed(axis) => format!("speed of axis {}", axis + 1),
                What::Torque(axis) => format!("torque of axis {}", axis + 1),
                What::TorqueRate(axis) => format!("torque rate of axis {}", axis + 1),
            },
            time_s: worst.time_s,
            ratio: worst.ratio,
        }
    }
}

/// The torque–speed curve in f64.
fn available_torque_nm(limits: &AxisLimits, rate_rad_per_s: f64) -> f64 {
    let beyond = (rate_rad_per_s.abs() - f64::from(limits.knee_speed_rad_per_s)).max(0.0);
    (f64::from(limits.torque_nm) - f64::from(limits.slope_nm_s_per_rad) * beyond).max(0.0)
}

#[derive(Clone, Copy)]
enum What {
    Output(usize),
    Speed(usize),
    Torque(usize),
    TorqueRate(usize),
}

struct Worst {
    ratio: f64,
    time_s: f64,
    what: What,
}

impl Worst {
    fn see(&mut self, ratio: f64, time_s: f64, what: What) {
        if ratio > self.ratio {
            *self = Self { ratio, time_s, what };
        }
    }
}
