//! Joint motion of the undeformed machine along a straight line of poses: the path that motors are told to follow when
//! nobody thinks of elasticity.

use super::profile::Profile;
use crate::machine::{Equations, Plant};

/// What every motor does at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointMotion {
    /// Joint angles; continuous only up to jumps by 2π.
    pub angles_rad: Vec<f64>,
    /// Joint rates.
    pub rates_rad_per_s: Vec<f64>,
    /// Joint accelerations.
    pub accelerations_rad_per_s2: Vec<f64>,
}

/// A motion of all joints in time: what drives follow.
pub trait JointPath {
    /// Coordinates of the machine at rest at the start.
    fn start(&self) -> Vec<f64>;
    /// Motion of the motors at a time, working in `equations`; NaN where the machine cannot be assembled.
    fn motion(&self, time_s: f64, equations: &mut Equations) -> JointMotion;
    /// Time after which the motors stand still.
    fn duration_s(&self) -> f64;
    /// Times between which everything is smooth, ascending.
    fn breaks_s(&self) -> Vec<f64>;
}

/// A straight line of poses, travelled with a [`Profile`].
#[derive(Clone)]
pub struct RigidPath<'a> {
    plant: &'a dyn Plant,
    profile: &'a Profile,
    start: Vec<f64>,
    /// From start to end in the coordinates of the undeformed machine, which are linear in the pose.
    direction: Vec<f64>,
}

impl<'a> RigidPath<'a> {
    /// From pose to pose.
    #[must_use]
    pub fn new(plant: &'a dyn Plant, from: &[f64], to: &[f64], profile: &'a Profile) -> Self {
        let start = plant.rest(from);
        let direction = plant
            .rest(to)
            .iter()
            .zip(&start)
            .map(|(e, s)| e - s)
            .collect();
        Self {
            plant,
            profile,
            start,
            direction,
        }
    }

    /// The profile.
    #[must_use]
    pub fn profile(&self) -> &'a Profile {
        self.profile
    }

    /// Coordinates of the undeformed machine at a time.
    #[must_use]
    pub fn coordinates(&self, time_s: f64) -> Vec<f64> {
        let along = self.profile.at(time_s)[0];
        let line = self.start.iter().zip(&self.direction);
        line.map(|(start, direction)| start + along * direction)
            .collect()
    }

    /// Coordinates, rates and accelerations of the undeformed machine at a time.
    #[must_use]
    pub fn rigid_motion(&self, time_s: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let [_, rate, acceleration, _] = self.profile.at(time_s);
        let along = |factor: f64| self.direction.iter().map(|d| d * factor).collect();
        (self.coordinates(time_s), along(rate), along(acceleration))
    }
}

impl JointPath for RigidPath<'_> {
    fn start(&self) -> Vec<f64> {
        self.coordinates(0.0)
    }

    fn duration_s(&self) -> f64 {
        self.profile.duration_s()
    }

    fn breaks_s(&self) -> Vec<f64> {
        self.profile.breaks_s()
    }

    /// Motion of the motors. With θ' = J q' along the line, θ̇ = θ' ṡ and θ̈ = θ' s̈ + (J̇q') ṡ².
    fn motion(&self, time_s: f64, equations: &mut Equations) -> JointMotion {
        let [_, rate, acceleration, _] = self.profile.at(time_s);
        let q = self.coordinates(time_s);
        if rate == 0.0 && acceleration == 0.0 {
            // Most of a simulation is watching the machine ring at rest.
            let axes = self.plant.axis_count();
            return JointMotion {
                angles_rad: self.plant.joint_angles(&q),
                rates_rad_per_s: vec![0.0; axes],
                accelerations_rad_per_s2: vec![0.0; axes],
            };
        }
        self.plant.equations(&q, &self.direction, equations);
        let (mut rates_rad_per_s, mut accelerations_rad_per_s2) = (Vec::new(), Vec::new());
        let rows = equations.joint_jacobian.chunks_exact(q.len());
        for (row, bend) in rows.zip(&equations.joint_bias) {
            let slope: f64 = row.iter().zip(&self.direction).map(|(j, d)| j * d).sum();
            rates_rad_per_s.push(slope * rate);
            accelerations_rad_per_s2.push(slope * acceleration + bend * rate * rate);
        }
        JointMotion {
            angles_rad: self.plant.joint_angles(&q),
            rates_rad_per_s,
            accelerations_rad_per_s2,
        }
    }
}
