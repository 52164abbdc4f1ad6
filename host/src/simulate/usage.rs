//! How much of the limits a recording uses.

use super::recording::{Frame, Recording};
use crate::machine::{OutputKind, Plant};
use crate::movefile::Limits;

/// How much a recording uses of a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Usage {
    /// What is limited, of whatever axis or member.
    pub group: &'static str,
    /// Name of the limit.
    pub limit: String,
    /// When it is used most.
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
        let all = Self::all(plant, limits, recording).into_iter();
        let most = all.reduce(|most, next| if next.ratio > most.ratio { next } else { most });
        most.filter(|most| most.ratio > 0.0).unwrap_or(Self {
            group: "nothing",
            limit: "nothing".to_owned(),
            time_s: 0.0,
            ratio: 0.0,
        })
    }

    /// Every limit in turn: speed, torque and torque rate of the axis that uses it most, then those of the machine's outputs,
    /// stresses taken together.
    #[must_use]
    pub fn all(plant: &dyn Plant, limits: &Limits, recording: &Recording) -> Vec<Self> {
        let ratio = plant.reducer_ratio();
        let speed_limit = limits.joint_speed_rad_per_s(ratio);
        let mut all = ["speed", "torque", "torque rate"].map(Worst::new).to_vec();
        // Where each limited output is counted.
        let mut places = Vec::new();
        let outputs = plant.outputs();
        for (index, (output, bound)) in outputs.iter().zip(&limits.outputs).enumerate() {
            let Some(bound) = *bound else { continue };
            let group = match output.kind {
                OutputKind::Stress => "stress",
                _ => output.key,
            };
            let place = all.iter().position(|worst| worst.group == group);
            let place = place.unwrap_or_else(|| {
                all.push(Worst::new(group));
                all.len() - 1
            });
            places.push((index, bound, place));
        }
        let mut before: Option<&Frame> = None;
        for frame in &recording.frames {
            let time_s = frame.time_s;
            for &(index, bound, place) in &places {
                all[place].see(frame.outputs[index].abs() / bound, time_s, index);
            }
            let axes = frame.joint_rates_rad_per_s.iter().zip(&frame.torques_nm);
            for (axis, (rate, torque)) in axes.enumerate() {
                all[0].see(rate.abs() / speed_limit, time_s, axis);
                let available = limits.torque_at_joint_speed(*rate, ratio);
                all[1].see(torque.abs() / available, time_s, axis);
            }
            if let Some(before) = before {
                let torques = frame.torques_nm.iter().zip(&before.torques_nm);
                for (axis, (now, then)) in torques.enumerate() {
                    let rate = (now - then).abs() / (time_s - before.time_s);
                    all[2].see(rate / limits.torque_rate_nm_per_s, time_s, axis);
                }
            }
            before = Some(frame);
        }
        let named = all.into_iter().enumerate();
        named
            .map(|(place, worst)| Self {
                group: worst.group,
                limit: match outputs.get(worst.which) {
                    _ if place < 3 => format!("{} of axis {}", worst.group, worst.which + 1),
                    output => output.map_or_else(String::new, |output| output.key.to_owned()),
                },
                time_s: worst.time_s,
                ratio: worst.ratio,
            })
            .collect()
    }
}

#[derive(Clone, Copy)]
struct Worst {
    group: &'static str,
    ratio: f64,
    time_s: f64,
    /// Axis or output.
    which: usize,
}

impl Worst {
    fn new(group: &'static str) -> Self {
        Self {
            group,
            ratio: 0.0,
            time_s: 0.0,
            which: 0,
        }
    }

    fn see(&mut self, ratio: f64, time_s: f64, which: usize) {
        if ratio > self.ratio {
            *self = Self {
                ratio,
                time_s,
                which,
                ..*self
            };
        }
    }
}
