//! An elastic axis: motor, torsional spring and damper, load. The machine that most of industry has.
//!
//! Coordinates q = (motor angle, twist), both at the reducer output; the load stands at motor angle + twist.

use super::describe::{
    Assumption, Coordinate, MachineError, Output, OutputForm, OutputKind, not_negative, positive,
};
use super::{Dynamics, Machine, Parameter};
use crate::autodiff::Scalar;
use serde::Deserialize;

/// Parameters of the axis, as in the move file's `[machine]` table; all seen from the reducer output.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwoMassAxis {
    /// Inertia of motor and reducer.
    pub motor_inertia_kg_m2: f64,
    /// Inertia of the load.
    pub load_inertia_kg_m2: f64,
    /// Stiffness between them.
    pub stiffness_nm_per_rad: f64,
    /// Viscous damping between them.
    pub damping_nm_s_per_rad: f64,
    /// Motor speed over joint speed.
    pub reducer_ratio: f64,
}

impl Machine for TwoMassAxis {
    const COORDINATES: usize = 2;
    const AXES: usize = 1;
    const ANGLES_WRAP: bool = false;
    const REGULARITIES: &'static [&'static str] = &[];
    const PAYLOAD: &'static str = "load_inertia_kg_m2";
    const STIFFNESS: &'static str = "stiffness_nm_per_rad";

    fn dynamics<S: Scalar>(&self, q: &[S], v: &[S], a: &[S], out: Dynamics<'_, S>) {
        let load = (a[0] + a[1]) * self.load_inertia_kg_m2;
        out.force[0] = a[0] * self.motor_inertia_kg_m2 + load;
        out.force[1] = load + q[1] * self.stiffness_nm_per_rad + v[1] * self.damping_nm_s_per_rad;
        out.joint_jacobian[0] = S::constant(1.0);
        out.joint_jacobian[1] = S::constant(0.0);
        out.joint_acceleration[0] = a[0];
    }

    fn joint_angles<S: Scalar>(&self, q: &[S], angles_rad: &mut [S]) {
        angles_rad[0] = q[0];
    }

    fn output_values<S: Scalar>(&self, q: &[S], out: &mut [S]) {
        out[0] = q[1];
    }

    fn outputs(&self) -> Vec<Output> {
        vec![Output {
            key: "twist_rad",
            label: "twist",
            unit: "rad",
            kind: OutputKind::ElasticDisplacement,
            form: OutputForm::Proportional {
                coordinate: 1,
                gain: 1.0,
            },
        }]
    }

    fn regularities<S: Scalar>(&self, _: &[S], _: &mut [S]) {}

    fn coordinates(&self) -> Vec<Coordinate> {
        let locked = (self.stiffness_nm_per_rad / self.load_inertia_kg_m2).sqrt();
        vec![
            Coordinate {
                name: "motor_angle_rad",
                unit: "rad",
                magnitude: 1.0,
                rate_magnitude: locked,
                elastic: false,
            },
            Coordinate {
                name: "twist_rad",
                unit: "rad",
                magnitude: 0.1,
                rate_magnitude: 0.1 * locked,
                elastic: true,
            },
        ]
    }

    fn pose_names(&self) -> &'static [&'static str] {
        &["angle_rad"]
    }

    fn rest(&self, pose: &[f64]) -> Vec<f64> {
        vec![pose[0], 0.0]
    }

    fn check_pose(&self, _pose: &[f64]) -> Result<(), MachineError> {
        Ok(())
    }

    fn reducer_ratio(&self) -> f64 {
        self.reducer_ratio
    }

    fn with_elastic_damping(&self, ratio: f64) -> Self {
        let critical = 2.0 * (self.stiffness_nm_per_rad * self.load_inertia_kg_m2).sqrt();
        Self {
            damping_nm_s_per_rad: self.damping_nm_s_per_rad + ratio * critical,
            ..self.clone()
        }
    }

    fn parameters(&mut self) -> Vec<Parameter<'_>> {
        vec![
            Parameter::alone("motor_inertia_kg_m2", &mut self.motor_inertia_kg_m2),
            Parameter::alone("load_inertia_kg_m2", &mut self.load_inertia_kg_m2),
            Parameter::alone("stiffness_nm_per_rad", &mut self.stiffness_nm_per_rad),
            Parameter::alone("damping_nm_s_per_rad", &mut self.damping_nm_s_per_rad),
            Parameter::alone("reducer_ratio", &mut self.reducer_ratio),
        ]
    }

    fn validate(&self) -> Result<(), MachineError> {
        positive("motor_inertia_kg_m2", self.motor_inertia_kg_m2)?;
        positive("load_inertia_kg_m2", self.load_inertia_kg_m2)?;
        positive("stiffness_nm_per_rad", self.stiffness_nm_per_rad)?;
        not_negative("damping_nm_s_per_rad", self.damping_nm_s_per_rad)?;
        positive("reducer_ratio", self.reducer_ratio)
    }

    fn assumptions(&self) -> Vec<Assumption> {
        Vec::new()
    }
}
