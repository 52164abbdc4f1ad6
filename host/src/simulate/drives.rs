//! Simulated servo drives on the flexible machine, behind the firmware's own [`DriveGroup`].
//!
//! Each drive moves its reference from the previous set-point to the newest one during the tick that follows, as drives
//! in a cyclic synchronous mode do: position along the cubic that meets both ends' positions and velocities, velocity and
//! torque along straight lines (the cubic's slope would turn f32's last digit of position into torque). So the machine runs one tick behind the set-points. Per axis, with the inertia I that the motor
//! feels and ω = 2π · bandwidth,
//!
//! ```text
//! τ = τ_ff + I ω_v (θ̇_ref + ω_p (θ_ref − θ) − θ̇),   |τ| ≤ torque–speed curve
//! ```
//!
//! computed `loop_rate_hz` times a second and held in between, `delay_s` late. There is no integral part: the machines
//! here hold no load at rest, and the feed-forward knows the move.

use super::modes::ModesError;
use super::recording::Frame;
use super::settings::DriveSettings;
use super::stepper::Stepper;
use crate::machine::{Equations, Plant};
use crate::movefile::Limits;
use nalgebra::{Cholesky, DMatrix};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::f64::consts::TAU;
use stillpoint_firmware::{DriveGroup, DriveStatus, Feedback, Setpoint};

/// Low-pass on the velocity from an encoder, over the velocity loop's bandwidth.
const VELOCITY_FILTER: f64 = 5.0;

/// One axis as its drive sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    inertia_kg_m2: f64,
    measured_rad: f64,
    measured_rad_per_s: f64,
    previous: Setpoint,
    target: Setpoint,
}

/// N simulated drives and the machine they move. Time passes in [`SimulatedDrives::advance`] only.
pub struct SimulatedDrives<'a, const N: usize> {
    plant: &'a dyn Plant,
    limits: &'a Limits,
    settings: DriveSettings,
    stepper: Stepper<'a>,
    state: Vec<f64>,
    axes: [Axis; N],
    enabled: bool,
    /// Torques on their way, oldest first; the first acts.
    torques_nm: VecDeque<[f64; N]>,
}

impl<'a, const N: usize> SimulatedDrives<'a, N> {
    /// Disabled drives; the machine stands undeformed at `q`. The plant has N axes.
    ///
    /// # Errors
    /// [`ModesError`] where the machine is singular.
    pub fn new(
        plant: &'a dyn Plant,
        limits: &'a Limits,
        settings: &DriveSettings,
        q: &[f64],
    ) -> Result<Self, ModesError> {
        let mut state = q.to_vec();
        state.resize(2 * plant.coordinate_count(), 0.0);
        let late = (settings.delay_s * settings.loop_rate_hz).round() as usize;
        let mut drives = Self {
            plant,
            limits,
            settings: *settings,
            stepper: Stepper::new(plant, q)?,
            state,
            axes: [Axis::default(); N],
            enabled: false,
            torques_nm: VecDeque::from(vec![[0.0; N]; late + 1]),
        };
        let angles = plant.joint_angles(q);
        let inertias = joint_inertias(plant, q)?;
        for ((axis, angle), inertia) in drives.axes.iter_mut().zip(angles).zip(inertias) {
            axis.inertia_kg_m2 = inertia;
            axis.measured_rad = quantised(angle, settings.encoder_resolution_rad);
        }
        Ok(drives)
    }

    /// The machine and the torques that act, at the present time.
    #[must_use]
    pub fn frame(&self, time_s: f64, before: Option<&Frame>) -> Frame {
        let (q, v) = self.state.split_at(self.plant.coordinate_count());
        Frame::of(self.plant, time_s, q, v, &self.acting_nm(), before)
    }

    fn acting_nm(&self) -> [f64; N] {
        self.torques_nm.front().copied().unwrap_or([0.0; N])
    }

    /// Lets `duration_s` pass: one tick. `None` where the mechanism falls apart.
    pub fn advance(&mut self, duration_s: f64) -> Option<()> {
        let turns = (duration_s * self.settings.loop_rate_hz).round().max(1.0);
        let turn_s = duration_s / turns;
        for turn in 0..turns as usize {
            self.close_loops(turn as f64 / turns, turn_s, duration_s);
            let effective_nm = self.after_friction_nm(turn_s);
            self.stepper
                .advance(&mut self.state, &effective_nm, turn_s)?;
            self.measure(turn_s);
        }
        Some(())
    }

    /// What friction leaves of the torques that act. It is held over a turn, as they are; b/(1 + b Δt/I) instead of b lets no
    /// friction turn a joint back.
    fn after_friction_nm(&self, turn_s: f64) -> [f64; N] {
        let mut torques_nm = self.acting_nm();
        let friction = self.settings.joint_friction_nm_s_per_rad;
        if friction > 0.0 {
            let (q, v) = self.state.split_at(self.plant.coordinate_count());
            let rates = self.plant.joint_rates(q, v);
            for ((torque, axis), rate) in torques_nm.iter_mut().zip(&self.axes).zip(rates) {
                *torque -= friction * rate / (1.0 + friction * turn_s / axis.inertia_kg_m2);
            }
        }
        torques_nm
    }

    /// Computes the torques at `share` of a tick of `tick_s`.
    fn close_loops(&mut self, share: f64, turn_s: f64, tick_s: f64) {
        let position_gain = TAU * self.settings.position_bandwidth_hz;
        let velocity_gain = TAU * self.settings.velocity_bandwidth_hz;
        let torques = self.axes.map(|axis| {
            let reference = Reference::between(&axis.previous, &axis.target, share, tick_s);
            // The torque is held: its middle is what should agree with the feed-forward.
            let middle = share + 0.5 * turn_s / tick_s;
            let [from_nm, to_nm] = [axis.previous, axis.target].map(|s| f64::from(s.torque_nm));
            let feedforward_nm = from_nm + (to_nm - from_nm) * middle;
            let rate = reference.rate_rad_per_s
                + position_gain * (reference.angle_rad - axis.measured_rad);
            let feedback = velocity_gain * (rate - axis.measured_rad_per_s);
            let most_nm = self
                .limits
                .torque_at_joint_speed(axis.measured_rad_per_s, self.plant.reducer_ratio());
            (feedforward_nm + axis.inertia_kg_m2 * feedback).clamp(-most_nm, most_nm)
        });
        self.torques_nm.pop_front();
        let torques = if self.enabled { torques } else { [0.0; N] };
        self.torques_nm.push_back(torques);
    }

    fn measure(&mut self, turn_s: f64) {
        let (q, v) = self.state.split_at(self.plant.coordinate_count());
        let angles = self.plant.joint_angles(q);
        let rates = self.plant.joint_rates(q, v);
        let filter = TAU * VELOCITY_FILTER * self.settings.velocity_bandwidth_hz * turn_s;
        for ((axis, angle), rate) in self.axes.iter_mut().zip(angles).zip(rates) {
            let angle = self.plant.continued(angle, axis.measured_rad);
            let measured_rad = quantised(angle, self.settings.encoder_resolution_rad);
            axis.measured_rad_per_s = match self.settings.encoder_resolution_rad {
                None => rate,
                Some(_) => {
                    let difference = (measured_rad - axis.measured_rad) / turn_s;
                    axis.measured_rad_per_s
                        + (difference - axis.measured_rad_per_s) * filter / (1.0 + filter)
                }
            };
            axis.measured_rad = measured_rad;
        }
    }

    fn feedback(&self) -> [Feedback; N] {
        let status = if self.enabled {
            DriveStatus::Enabled
        } else {
            DriveStatus::Disabled
        };
        self.axes.map(|axis| Feedback {
            position_rad: axis.measured_rad as f32,
            velocity_rad_per_s: axis.measured_rad_per_s as f32,
            age_ticks: 0,
            status,
        })
    }
}

impl<const N: usize> DriveGroup<N> for SimulatedDrives<'_, N> {
    type Error = Infallible;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], Infallible> {
        for (axis, setpoint) in self.axes.iter_mut().zip(setpoints) {
            axis.previous = if self.enabled { axis.target } else { *setpoint };
            axis.target = *setpoint;
        }
        self.enabled = true;
        Ok(self.feedback())
    }

    fn observe(&mut self) -> Result<[Feedback; N], Infallible> {
        Ok(self.feedback())
    }

    fn safe(&mut self) {
        self.enabled = false;
    }
}

/// Where a drive wants its motor.
struct Reference {
    angle_rad: f64,
    rate_rad_per_s: f64,
}

impl Reference {
    /// Between two set-points a tick apart, at a share s of it.
    fn between(from: &Setpoint, to: &Setpoint, s: f64, tick_s: f64) -> Self {
        let start_rad = f64::from(from.position_rad);
        let rise = f64::from(to.position_rad) - start_rad;
        let [start, end] = [from, to].map(|p| f64::from(p.velocity_rad_per_s) * tick_s);
        // p(s) = start_rad + start s + b s² + c s³ with p(1) and p′(1) as wanted.
        let b = 3.0 * rise - 2.0 * start - end;
        let c = start + end - 2.0 * rise;
        Self {
            angle_rad: start_rad + s * (start + s * (b + s * c)),
            rate_rad_per_s: (start + (end - start) * s) / tick_s,
        }
    }
}

fn quantised(angle_rad: f64, resolution_rad: Option<f64>) -> f64 {
    resolution_rad.map_or(angle_rad, |step| (angle_rad / step).round() * step)
}

/// Inertia that each motor feels at once, before anything elastic has given way: 1 / (J M⁻¹ Jᵀ)ᵢᵢ.
fn joint_inertias(plant: &dyn Plant, q: &[f64]) -> Result<Vec<f64>, ModesError> {
    let (n, axes) = (plant.coordinate_count(), plant.axis_count());
    let mut equations = Equations::new(plant);
    plant.equations(q, &vec![0.0; n], &mut equations);
    let jacobian = DMatrix::from_row_slice(axes, n, &equations.joint_jacobian);
    let mass = DMatrix::from_row_slice(n, n, &equations.mass_matrix);
    let mass = Cholesky::new(mass).ok_or(ModesError::Singular)?;
    let mobility = &jacobian * mass.solve(&jacobian.transpose());
    Ok(mobility.diagonal().iter().map(|m| 1.0 / m).collect())
}
