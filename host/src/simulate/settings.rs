//! Settings of the simulated drives: the `[drive]` table of a move file.

use crate::movefile::MachineKind;
use serde::Deserialize;

/// Simulated servo drives and what the machine has that the plan does not know.
///
/// The loops' gains are given as bandwidths; with the inertia that each motor feels they become N·m per rad and per
/// rad/s. So the defaults fit machines of any size.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriveSettings {
    /// Bandwidth of the position loop: velocity asked for per position error, over 2π.
    pub position_bandwidth_hz: f64,
    /// Bandwidth of the velocity loop: acceleration asked for per velocity error, over 2π.
    pub velocity_bandwidth_hz: f64,
    /// Rate at which the drives close their loops.
    pub loop_rate_hz: f64,
    /// Resolution of the position measurement, at the joint; without it the measurement is exact.
    pub encoder_resolution_rad: Option<f64>,
    /// Time from measurement and set-point to torque.
    pub delay_s: f64,
    /// Payload that the machine really carries, over the payload planned for.
    pub payload_factor: f64,
    /// Damping that the elastic members really have, as ratio of critical; the plan has none.
    pub elastic_damping_ratio: f64,
    /// Viscous friction that every joint really has; the plan has none.
    pub joint_friction_nm_s_per_rad: f64,
}

impl Default for DriveSettings {
    /// Loops at 50 and 200 Hz closed 16,000 times a second, as servo drives of this size reach; nothing unknown.
    fn default() -> Self {
        Self {
            position_bandwidth_hz: 50.0,
            velocity_bandwidth_hz: 200.0,
            loop_rate_hz: 16_000.0,
            encoder_resolution_rad: None,
            delay_s: 0.0,
            payload_factor: 1.0,
            elastic_damping_ratio: 0.0,
            joint_friction_nm_s_per_rad: 0.0,
        }
    }
}

/// A setting that no drive has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value}: {rule}")]
pub struct DriveSettingsError {
    /// Key in the move file's `[drive]` table.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What it must satisfy.
    pub rule: &'static str,
}

impl DriveSettings {
    /// Checks that the settings describe drives.
    ///
    /// # Errors
    /// [`DriveSettingsError`] with the key.
    pub fn validate(&self) -> Result<(), DriveSettingsError> {
        let between = |key, value: f64, least: f64, most: f64, rule| {
            // Written so that NaN fails too.
            let fine = (least..=most).contains(&value);
            fine.then_some(())
                .ok_or(DriveSettingsError { key, value, rule })
        };
        let rate_hz = self.loop_rate_hz;
        between(
            "loop_rate_hz",
            rate_hz,
            1e3,
            1e6,
            "must lie between 1 kHz and 1 MHz",
        )?;
        let slow = "must be positive and below a tenth of loop_rate_hz";
        let least_hz = f64::MIN_POSITIVE;
        let most_hz = 0.1 * rate_hz;
        let (position_hz, velocity_hz) = (self.position_bandwidth_hz, self.velocity_bandwidth_hz);
        between(
            "position_bandwidth_hz",
            position_hz,
            least_hz,
            most_hz,
            slow,
        )?;
        between(
            "velocity_bandwidth_hz",
            velocity_hz,
            least_hz,
            most_hz,
            slow,
        )?;
        if let Some(resolution_rad) = self.encoder_resolution_rad {
            let rule = "must be positive and below 0.1 rad";
            between(
                "encoder_resolution_rad",
                resolution_rad,
                f64::MIN_POSITIVE,
                0.1,
                rule,
            )?;
        }
        let short = "must lie between 0 and 10 ms";
        between("delay_s", self.delay_s, 0.0, 0.01, short)?;
        let payload = "must lie between 0.01 and 100";
        between("payload_factor", self.payload_factor, 0.01, 100.0, payload)?;
        let damping = "must lie between 0 and 1";
        between(
            "elastic_damping_ratio",
            self.elastic_damping_ratio,
            0.0,
            1.0,
            damping,
        )?;
        let friction = "must be zero or a positive number up to 1e6";
        let most = 1e6;
        between(
            "joint_friction_nm_s_per_rad",
            self.joint_friction_nm_s_per_rad,
            0.0,
            most,
            friction,
        )
    }

    /// The machine that the drives really move.
    #[must_use]
    pub fn real_machine(&self, planned: &MachineKind) -> MachineKind {
        planned
            .with_payload_factor(self.payload_factor)
            .with_elastic_damping(self.elastic_damping_ratio)
    }
}
