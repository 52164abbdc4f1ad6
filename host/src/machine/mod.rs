//! Machines: the equations of motion of a mechanism, written once over the scalar.
//!
//! A machine has generalised coordinates `q`, rates `v` and accelerations `a` (each of length
//! [`Machine::COORDINATES`]) and [`Machine::AXES`] driven joints. Motor torques τ (at the reducer output) do work on
//! the joint angles θ(q), so its motion obeys
//!
//! ```text
//! M(q) a + c(q, v) + ∂V/∂q = J(q)ᵀ τ,    J = ∂θ/∂q
//! ```
//!
//! [`Machine::dynamics`] returns the left-hand side, J and θ̈. Planner, simulator and report use nothing else.

mod describe;
mod equations;
mod parameters;
mod rigid_body;
pub mod three_rrr;
pub mod two_mass_axis;

pub use describe::{Assumption, Coordinate, MachineError, Output, OutputForm, OutputKind};
pub use equations::Equations;
pub use parameters::{Change, Parameter};
pub use rigid_body::{ForwardDynamics, Plant};
pub use three_rrr::ThreeRrr;
pub use two_mass_axis::TwoMassAxis;

use crate::autodiff::Scalar;

/// Where [`Machine::dynamics`] writes.
#[derive(Debug)]
pub struct Dynamics<'a, S> {
    /// M(q)a + c(q,v) + ∂V/∂q, length `COORDINATES`.
    pub force: &'a mut [S],
    /// J = ∂θ/∂q, `AXES` × `COORDINATES`, row-major.
    pub joint_jacobian: &'a mut [S],
    /// θ̈ = J a + J̇v, length `AXES`.
    pub joint_acceleration: &'a mut [S],
}

/// A mechanism with driven joints, elastic or not.
pub trait Machine: Clone + Send + Sync + 'static {
    /// Number of generalised coordinates.
    const COORDINATES: usize;
    /// Number of driven joints.
    const AXES: usize;
    /// Whether [`Machine::joint_angles`] gives angles within one turn, which jump by 2π; otherwise they count turns.
    const ANGLES_WRAP: bool;
    /// Names of [`Machine::regularities`].
    const REGULARITIES: &'static [&'static str];
    /// Key of the parameter that is the payload.
    const PAYLOAD: &'static str;
    /// Key of the parameter that all stiffness is proportional to.
    const STIFFNESS: &'static str;

    /// Left-hand side of the equations of motion, and how the joints move.
    ///
    /// Fills M(q)a + c(q,v) + ∂V/∂q, ∂θ/∂q and θ̈. Affine in `a`, quadratic in `v`.
    fn dynamics<S: Scalar>(&self, q: &[S], v: &[S], a: &[S], out: Dynamics<'_, S>);

    /// Joint angles θ(q) in rad, length `AXES`; see [`Machine::ANGLES_WRAP`].
    fn joint_angles<S: Scalar>(&self, q: &[S], angles_rad: &mut [S]);

    /// Quantities that people watch and limit, in the order of [`Machine::outputs`].
    fn output_values<S: Scalar>(&self, q: &[S], out: &mut [S]);

    /// Names, units and meaning of [`Machine::output_values`].
    fn outputs(&self) -> Vec<Output>;

    /// Numbers of which one is zero at every singular pose, without unit: a motion that keeps their signs passes none.
    fn regularities<S: Scalar>(&self, q: &[S], out: &mut [S]);

    /// Names, units and typical magnitudes of the coordinates.
    fn coordinates(&self) -> Vec<Coordinate>;

    /// Names of the pose's components, with units, as the move file writes them.
    fn pose_names(&self) -> &'static [&'static str];

    /// Coordinates of the undeformed machine at a pose (length [`Machine::pose_names`]). Linear in the pose.
    fn rest(&self, pose: &[f64]) -> Vec<f64>;

    /// Whether the machine can stand at a pose; names the chain and the distance missing if not.
    ///
    /// # Errors
    /// [`MachineError::Unreachable`].
    fn check_pose(&self, pose: &[f64]) -> Result<(), MachineError>;

    /// Reducer ratio (motor speed over joint speed), for figures in motor units.
    fn reducer_ratio(&self) -> f64;

    /// Viscous damping of the elastic coordinates as ratio of critical, added by the simulator only.
    #[must_use]
    fn with_elastic_damping(&self, ratio: f64) -> Self;

    /// Every parameter that is a number.
    fn parameters(&mut self) -> Vec<Parameter<'_>>;

    /// Checks that the parameters describe a machine.
    ///
    /// # Errors
    /// [`MachineError::Parameter`] with the key.
    fn validate(&self) -> Result<(), MachineError>;

    /// The same machine with one parameter changed, and by the same factor those that grow with it.
    ///
    /// # Errors
    /// [`MachineError::UnknownParameter`]; [`MachineError::Parameter`] where no machine has the new value.
    fn changed(&self, key: &str, change: Change) -> Result<Self, MachineError> {
        let copy = parameters::changed(self, key, change).ok_or_else(|| {
            MachineError::UnknownParameter {
                key: key.to_owned(),
                known: self.clone().parameters().iter().map(|p| p.key).collect(),
            }
        })?;
        copy.validate().map(|()| copy)
    }

    /// The same machine carrying a payload heavier or lighter by a factor.
    #[must_use]
    fn with_payload_factor(&self, factor: f64) -> Self {
        parameters::changed(self, Self::PAYLOAD, Change::Factor(factor))
            .unwrap_or_else(|| self.clone())
    }

    /// Parameters that are assumed or calibrated, not measured; the report marks them.
    fn assumptions(&self) -> Vec<Assumption>;
}
