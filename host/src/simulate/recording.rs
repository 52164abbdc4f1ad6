//! What a simulated machine did, sample by sample.

use crate::machine::Plant;
use stillpoint_firmware::{LimitFlags, Setpoint};

/// Everything at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Time since the start of the move.
    pub time_s: f64,
    /// Generalised coordinates.
    pub coordinates: Vec<f64>,
    /// Their rates.
    pub rates: Vec<f64>,
    /// Joint angles, without jumps.
    pub joint_angles_rad: Vec<f64>,
    /// Joint rates.
    pub joint_rates_rad_per_s: Vec<f64>,
    /// Motor torques at the reducer output.
    pub torques_nm: Vec<f64>,
    /// Output values, in the order of the plant's outputs.
    pub outputs: Vec<f64>,
}

impl Frame {
    /// A frame of a plant in a state; `before` is the previous one, whose joint angles are continued.
    #[must_use]
    pub fn of(
        plant: &dyn Plant,
        time_s: f64,
        coordinates: &[f64],
        rates: &[f64],
        torques_nm: &[f64],
        before: Option<&Self>,
    ) -> Self {
        let mut joint_angles_rad = plant.joint_angles(coordinates);
        if let Some(before) = before {
            for (angle, near) in joint_angles_rad.iter_mut().zip(&before.joint_angles_rad) {
                *angle = plant.continued(*angle, *near);
            }
        }
        Self {
            time_s,
            coordinates: coordinates.to_vec(),
            rates: rates.to_vec(),
            joint_angles_rad,
            joint_rates_rad_per_s: plant.joint_rates(coordinates, rates),
            torques_nm: torques_nm.to_vec(),
            outputs: plant.output_values(coordinates),
        }
    }
}

/// A simulated move and what came after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Duration of the move as planned.
    pub duration_s: f64,
    /// From here on the motors are told to stand still, so what moves is vibration: the end of the move, or later by
    /// what the drives delay.
    pub rest_from_s: f64,
    /// Samples, ascending in time.
    pub frames: Vec<Frame>,
    /// What the executor sent, one per frame; empty with ideal drives.
    pub commands: Vec<Command>,
}

impl Recording {
    /// Ticks in which the executor's limiter acted on any axis.
    #[must_use]
    pub fn limited_ticks(&self) -> usize {
        let limited = |command: &&Command| command.limited.iter().any(|flags| !flags.is_empty());
        self.commands.iter().filter(limited).count()
    }
}

/// What the executor sent to the drives in one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Command {
    /// Set-points, axis by axis.
    pub setpoints: Vec<Setpoint>,
    /// Limits in force, axis by axis.
    pub limited: Vec<LimitFlags>,
}
