//! The plant under constant torques for a short time: fixed steps that are cheap to restart.
//!
//! Servo drives change the torque thousands of times a second, and an adaptive method would look for its step each time.
//! The classical Runge–Kutta method needs nothing from the past. Its error per step is about (ωh)⁵/120 of the fastest
//! vibration's amplitude, so steps of ωh ≤ 1/8 keep a move's error some 1e-7 of its vibration.

use super::linear;
use super::modes::{self, ModesError};
use crate::machine::{Equations, Plant};
use std::f64::consts::TAU;

/// Largest ωh.
const STEP_RAD: f64 = 0.125;

/// Advances one plant; owns the working space.
pub struct Stepper<'a> {
    plant: &'a dyn Plant,
    longest_step_s: f64,
    equations: Equations,
    slope: Vec<f64>,
    stage: Vec<f64>,
    sum: Vec<f64>,
}

impl<'a> Stepper<'a> {
    /// A stepper with steps for the fastest vibration about the undeformed machine at `q`.
    ///
    /// # Errors
    /// [`ModesError`] at a singular pose.
    pub fn new(plant: &'a dyn Plant, q: &[f64]) -> Result<Self, ModesError> {
        let size = 2 * plant.coordinate_count();
        let fastest_hz = modes::free(plant, q)?
            .last()
            .map_or(0.0, |mode| mode.frequency_hz);
        Ok(Self {
            plant,
            longest_step_s: STEP_RAD / (TAU * fastest_hz),
            equations: Equations::new(plant),
            slope: vec![0.0; size],
            stage: vec![0.0; size],
            sum: vec![0.0; size],
        })
    }

    /// Advances `state` (coordinates, then rates) by `duration_s`; `None` where the mechanism falls apart.
    pub fn advance(
        &mut self,
        state: &mut [f64],
        torques_nm: &[f64],
        duration_s: f64,
    ) -> Option<()> {
        let steps = (duration_s / self.longest_step_s).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.step(state, torques_nm, duration_s / steps)?;
        }
        Some(())
    }

    fn step(&mut self, state: &mut [f64], torques_nm: &[f64], h: f64) -> Option<()> {
        self.stage.copy_from_slice(state);
        self.sum.fill(0.0);
        for (weight, reach) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)] {
            self.evaluate(torques_nm)?;
            for (((sum, slope), stage), start) in self
                .sum
                .iter_mut()
                .zip(&self.slope)
                .zip(&mut self.stage)
                .zip(state.iter())
            {
                *sum += weight * slope;
                *stage = start + reach * h * slope;
            }
        }
        for (x, sum) in state.iter_mut().zip(&self.sum) {
            *x += h / 6.0 * sum;
        }
        Some(())
    }

    /// Slope at `stage`: M a = Jᵀτ − bias.
    fn evaluate(&mut self, torques_nm: &[f64]) -> Option<()> {
        let n = self.plant.coordinate_count();
        let (q, v) = self.stage.split_at(n);
        self.plant.equations(q, v, &mut self.equations);
        let (rates, accelerations) = self.slope.split_at_mut(n);
        rates.copy_from_slice(v);
        let e = &mut self.equations;
        for (i, right) in accelerations.iter_mut().enumerate() {
            let motors = e.joint_jacobian.iter().skip(i).step_by(n).zip(torques_nm);
            *right = motors.map(|(j, torque)| j * torque).sum::<f64>() - e.bias[i];
        }
        linear::solve(&mut e.mass_matrix, accelerations)
    }
}
