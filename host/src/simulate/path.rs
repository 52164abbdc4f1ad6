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

/// A straight line of poses, travelled with a [`Profile`].
#[derive(Clone, Copy)]
pub struct RigidPath<'a> {
    plant: &'a dyn Plant,
    from: &'a [f64],
    to: &'a [f64],
    profile: &'a Profile,
}

impl<'a> RigidPath<'a> {
    /// From pose to pose.
    #[must_use]
    pub fn new(plant: &'a dyn Plant, from: &'a [f64], to: &'a [f64], profile: &'a Profile) -> Self {
        Self {
            plant,
            from,
            to,
            profile,
        }
    }

    /// The profile.
    #[must_use]
    pub fn profile(&self) -> &'a Profile {
        self.profile
    }

    /// Undeformed coordinates at a time, their direction of travel, and the profile there.
    fn along(&self, time_s: f64) -> (Vec<f64>, Vec<f64>, [f64; 4]) {
        let (start, end) = (self.plant.rest(self.from), self.plant.rest(self.to));
        let profile = self.profile.at(time_s);
        let direction: Vec<f64> = end.iter().zip(&start).map(|(e, s)| e - s).collect();
        let q = start
            .iter()
            .zip(&direction)
            .map(|(s, d)| s + d * profile[0])
            .collect();
        (q, direction, profile)
    }

    /// Coordinates of the undeformed machine at a time.
    #[must_use]
    pub fn coordinates(&self, time_s: f64) -> Vec<f64> {
        self.along(time_s).0
    }

    /// Motion of the motors. With θ' = J q' along the line, θ̇ = θ' ṡ and θ̈ = θ' s̈ + (J̇q') ṡ².
    ///
    /// NaN where the machine cannot be assembled.
    #[must_use]
    pub fn motion(&self, time_s: f64, equations: &mut Equations) -> JointMotion {
        let (q, direction, [_, rate, acceleration, _]) = self.along(time_s);
        self.plant.equations(&q, &direction, equations);
        let slopes: Vec<f64> = equations
            .joint_jacobian
            .chunks_exact(q.len())
            .map(|row| row.iter().zip(&direction).map(|(j, d)| j * d).sum())
            .collect();
        let bends = &equations.joint_bias;
        JointMotion {
            angles_rad: self.plant.joint_angles(&q),
            rates_rad_per_s: slopes.iter().map(|slope| slope * rate).collect(),
            accelerations_rad_per_s2: slopes
                .iter()
                .zip(bends)
                .map(|(slope, bend)| slope * acceleration + bend * rate * rate)
                .collect(),
        }
    }
}

/// The angle equal to `angle_rad` up to full turns that is nearest to `near_rad`.
#[must_use]
pub fn unwrapped(angle_rad: f64, near_rad: f64) -> f64 {
    use std::f64::consts::TAU;
    angle_rad - TAU * ((angle_rad - near_rad) / TAU).round()
}
