//! The planar 3-RRR parallel manipulator with flexible driven links of Kong, Chen and Ji,
//! "Optimal Point-to-Point Motion Planning of Flexible Parallel Manipulator with Multi-Interval
//! Radau Pseudospectral Method", MATEC Web of Conferences 42, 03011 (2016).
//!
//! Coordinates q = (x, y, φ, m1, m2, m3): true pose of the platform and the root curvature of each driven link.
//! Chain i runs from the base joint O over the driven link (flexible, clamped to the reducer) to the elbow A and
//! over the passive link (rigid) to the platform joint B. The closure is solved in closed form: A lies on the
//! circle of radius ρ = √(l² + w²) about O and on that of radius l about B.

use super::describe::{
    Assumption, Coordinate, MachineError, Output, OutputForm, OutputKind, not_negative, positive,
};
use super::{Dynamics, Machine, Parameter};
use crate::autodiff::Scalar;
use serde::Deserialize;

mod chain;
use chain::Chain;

const CHAINS: usize = 3;
/// Platform corners seen from its centre, and base joints: an equilateral triangle each.
const CORNER_DEG: [f64; CHAINS] = [210.0, -30.0, 90.0];

/// On which side of the line from base joint to platform joint the elbows are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Elbow {
    /// θ = α + acos(…).
    Plus,
    /// θ = α − acos(…).
    Minus,
}

impl Elbow {
    fn sign(self) -> f64 {
        match self {
            Self::Plus => 1.0,
            Self::Minus => -1.0,
        }
    }
}

/// Parameters of the manipulator, as in the move file's `[machine]` table.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThreeRrr {
    /// Side R of the base triangle.
    pub base_side_m: f64,
    /// Length l of driven and passive links.
    pub link_length_m: f64,
    /// Side h of the platform triangle.
    pub platform_side_m: f64,
    /// Driven links: thickness in the bending direction.
    pub link_thickness_m: f64,
    /// Driven links: height across it.
    pub link_height_m: f64,
    /// Young's modulus E of the driven links.
    pub youngs_modulus_pa: f64,
    /// Density of the driven links.
    pub density_kg_per_m3: f64,
    /// Mass m_2 of a passive link.
    pub passive_link_mass_kg: f64,
    /// Point mass m_A at each elbow.
    pub elbow_joint_mass_kg: f64,
    /// Point mass m_B at each platform joint.
    pub platform_joint_mass_kg: f64,
    /// Mass m_p of platform and payload.
    pub platform_mass_kg: f64,
    /// Moment of inertia I_p of platform and payload about the centre.
    pub platform_inertia_kg_m2: f64,
    /// Motor and reducer inertia, motor side.
    pub motor_inertia_kg_m2: f64,
    /// Motor speed over joint speed.
    pub reducer_ratio: f64,
    /// Assembly mode.
    pub elbow: Elbow,
    /// Strain gauges: position along the driven link from 0 (root) to 1 (tip).
    pub gauge_position: f64,
    /// Viscous damping of the curvatures as ratio of critical, relative to the clamped link alone; no key of the move file.
    #[serde(skip)]
    elastic_damping_ratio: f64,
}

impl ThreeRrr {
    /// k_s = E I l / 3 of one driven link, generalised force per curvature.
    fn curvature_stiffness(&self) -> f64 {
        let second_moment = self.link_height_m * self.link_thickness_m.powi(3) / 12.0;
        self.youngs_modulus_pa * second_moment * self.link_length_m / 3.0
    }

    /// d = 2ζ√(k_s · modal mass) of one driven link, generalised force per curvature rate.
    fn elastic_damping(&self) -> f64 {
        if self.elastic_damping_ratio == 0.0 {
            return 0.0;
        }
        let mu = self.density_kg_per_m3 * self.link_thickness_m * self.link_height_m;
        let l = self.link_length_m;
        let tip = l * l / 3.0;
        let modal_mass = mu * 11.0 * l.powi(5) / 420.0
            + (self.elbow_joint_mass_kg + self.passive_link_mass_kg / 3.0) * tip * tip;
        2.0 * self.elastic_damping_ratio * (self.curvature_stiffness() * modal_mass).sqrt()
    }

    /// Strain at the gauge, (thickness/2)(1 − s/l) m.
    fn strain_per_curvature(&self) -> f64 {
        self.link_thickness_m / 2.0 * (1.0 - self.gauge_position)
    }

    /// Stress at the root, eq. 10: E (thickness/2) m.
    fn stress_per_curvature(&self) -> f64 {
        self.youngs_modulus_pa * self.link_thickness_m / 2.0
    }

    fn base_joint(&self, chain: usize) -> [f64; 2] {
        let r = self.base_side_m;
        [[0.0, 0.0], [r, 0.0], [r / 2.0, r * 3.0_f64.sqrt() / 2.0]][chain]
    }

    /// Platform joint B_i relative to the centre, as a vector turned by φ.
    fn corner<S: Scalar>(&self, chain: usize, (sin, cos): (S, S)) -> [S; 2] {
        let (s, c) = CORNER_DEG[chain].to_radians().sin_cos();
        let r = self.platform_side_m / 3.0_f64.sqrt();
        [cos * (r * c) - sin * (r * s), sin * (r * c) + cos * (r * s)]
    }

    /// The parts of eq. 22.
    fn platform_rows<S: Scalar>(&self, q: &[S]) -> PlatformRows<S> {
        let turn = q[2].sin_cos();
        let zero = S::constant(0.0);
        let mut rows = PlatformRows {
            levers: [[zero; 3]; CHAINS],
            bends: [zero; CHAINS],
            deflections: [zero; CHAINS],
        };
        for i in 0..CHAINS {
            let r = self.corner(i, turn);
            let chain = Chain::assemble(self, i, [q[0] + r[0], q[1] + r[1]], q[3 + i]);
            let u = chain.passive_link;
            rows.levers[i] = [u[0], u[1], u[1] * r[0] - u[0] * r[1]];
            rows.bends[i] = u[0] * chain.normal[0] + u[1] * chain.normal[1];
            rows.deflections[i] = chain.deflection;
        }
        rows
    }

    /// Elastic displacement (δx, δy, δφ) of the platform, eq. 22 to first order: J δ = diag(uᵢ·nᵢ) w.
    fn elastic_displacement<S: Scalar>(&self, q: &[S]) -> [S; 3] {
        let rows = self.platform_rows(q);
        let right = std::array::from_fn(|i| rows.bends[i] * rows.deflections[i]);
        solve3(&rows.levers, &right)
    }
}

/// J, uᵢ·nᵢ and w of eq. 22.
struct PlatformRows<S> {
    levers: [[S; 3]; CHAINS],
    bends: [S; CHAINS],
    deflections: [S; CHAINS],
}

fn cross<S: Scalar>(u: [S; 3], v: [S; 3]) -> [S; 3] {
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

fn determinant<S: Scalar>(a: &[[S; 3]; 3]) -> S {
    let c0 = cross(a[1], a[2]);
    a[0][0] * c0[0] + a[0][1] * c0[1] + a[0][2] * c0[2]
}

/// Cramer's rule: no pivoting, so the same for values and derivatives.
fn solve3<S: Scalar>(a: &[[S; 3]; 3], b: &[S; 3]) -> [S; 3] {
    let (c0, c1, c2) = (cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
    let inverse = determinant(a).recip();
    std::array::from_fn(|k| (b[0] * c0[k] + b[1] * c1[k] + b[2] * c2[k]) * inverse)
}

impl Machine for ThreeRrr {
    const COORDINATES: usize = 6;
    const AXES: usize = CHAINS;
    const ANGLES_WRAP: bool = true;
    const REGULARITIES: &'static [&'static str] = &[
        "distance from poses that the motors do not hold",
        "bend of chain 1",
        "bend of chain 2",
        "bend of chain 3",
    ];
    const PAYLOAD: &'static str = "platform_mass_kg";
    const STIFFNESS: &'static str = "youngs_modulus_pa";

    fn dynamics<S: Scalar>(&self, q: &[S], v: &[S], a: &[S], out: Dynamics<'_, S>) {
        let Dynamics {
            force,
            joint_jacobian,
            joint_acceleration: angle_acceleration,
        } = out;
        let turn = q[2].sin_cos();
        force[0] = a[0] * self.platform_mass_kg;
        force[1] = a[1] * self.platform_mass_kg;
        force[2] = a[2] * self.platform_inertia_kg_m2;
        for entry in joint_jacobian.iter_mut() {
            *entry = S::constant(0.0);
        }
        for i in 0..CHAINS {
            let m = 3 + i;
            let r = self.corner(i, turn);
            let chain = Chain::assemble(self, i, [q[0] + r[0], q[1] + r[1]], q[m]);
            let spin2 = v[2] * v[2];
            let joint_rate = [v[0] - v[2] * r[1], v[1] + v[2] * r[0]];
            let joint_acceleration = [
                a[0] - a[2] * r[1] - spin2 * r[0],
                a[1] + a[2] * r[0] - spin2 * r[1],
            ];
            let motion = chain.motion(joint_rate, joint_acceleration, v[m], a[m]);
            let load = chain.load(self, &motion);
            angle_acceleration[i] = motion.angle_acceleration;
            // Virtual work on the platform's three coordinates and on this link's curvature.
            force[0] += load.platform_joint[0];
            force[1] += load.platform_joint[1];
            force[2] += load.platform_joint[1] * r[0] - load.platform_joint[0] * r[1];
            force[m] = load.curvature;
            let row = &mut joint_jacobian[6 * i..6 * (i + 1)];
            row[0] = chain.angle_by_joint[0];
            row[1] = chain.angle_by_joint[1];
            row[2] = chain.angle_by_joint[1] * r[0] - chain.angle_by_joint[0] * r[1];
            row[m] = chain.angle_by_curvature;
        }
    }

    fn joint_angles<S: Scalar>(&self, q: &[S], angles_rad: &mut [S]) {
        let turn = q[2].sin_cos();
        for (i, angle) in angles_rad.iter_mut().enumerate() {
            let r = self.corner(i, turn);
            *angle = Chain::angle(self, i, [q[0] + r[0], q[1] + r[1]], q[3 + i]);
        }
    }

    fn output_values<S: Scalar>(&self, q: &[S], out: &mut [S]) {
        let (strain, stress) = (self.strain_per_curvature(), self.stress_per_curvature());
        out[..3].copy_from_slice(&self.elastic_displacement(q));
        for i in 0..CHAINS {
            out[3 + i] = q[3 + i] * strain;
            out[6 + i] = q[3 + i] * stress;
        }
    }

    fn outputs(&self) -> Vec<Output> {
        let displacement = |key, label, unit| Output {
            key,
            label,
            unit,
            kind: OutputKind::ElasticDisplacement,
            form: OutputForm::General,
        };
        let (strain, stress) = (self.strain_per_curvature(), self.stress_per_curvature());
        let link = |i: usize, key, label, kind, unit, gain| Output {
            key,
            label,
            unit,
            kind,
            form: OutputForm::Proportional {
                coordinate: 3 + i,
                gain,
            },
        };
        use OutputKind::{Strain, Stress};
        vec![
            displacement("elastic_displacement_x_m", "δx", "m"),
            displacement("elastic_displacement_y_m", "δy", "m"),
            displacement("elastic_rotation_rad", "δφ", "rad"),
            link(0, "strain_1", "link 1", Strain, "", strain),
            link(1, "strain_2", "link 2", Strain, "", strain),
            link(2, "strain_3", "link 3", Strain, "", strain),
            link(0, "stress_1_pa", "link 1", Stress, "Pa", stress),
            link(1, "stress_2_pa", "link 2", Stress, "Pa", stress),
            link(2, "stress_3_pa", "link 3", Stress, "Pa", stress),
        ]
    }

    /// The determinant of J, levers in those of the platform's corners: zero where the lines of the passive links meet in one
    /// point or are parallel, and the motors do not hold the platform. Then uᵢ·nᵢ: zero where a chain is stretched or folded.
    fn regularities<S: Scalar>(&self, q: &[S], out: &mut [S]) {
        let rows = self.platform_rows(q);
        let lever = self.platform_side_m / 3.0_f64.sqrt();
        out[0] = determinant(&rows.levers) * lever.recip();
        out[1..].copy_from_slice(&rows.bends);
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        // A tenth of the link for the pose; a curvature that bends the tip by a hundredth of its length.
        let l = self.link_length_m;
        let pose = |name, unit, magnitude| Coordinate {
            name,
            unit,
            magnitude,
            rate_magnitude: magnitude * 30.0,
            elastic: false,
        };
        let curvature = |name| Coordinate {
            name,
            unit: "1/m",
            magnitude: 0.06 / l,
            rate_magnitude: 12.0 / l,
            elastic: true,
        };
        vec![
            pose("x_m", "m", 0.25 * l),
            pose("y_m", "m", 0.25 * l),
            pose("phi_rad", "rad", 0.1),
            curvature("curvature_1"),
            curvature("curvature_2"),
            curvature("curvature_3"),
        ]
    }

    fn pose_names(&self) -> &'static [&'static str] {
        &["x_m", "y_m", "phi_rad"]
    }

    fn rest(&self, pose: &[f64]) -> Vec<f64> {
        vec![pose[0], pose[1], pose[2], 0.0, 0.0, 0.0]
    }

    fn check_pose(&self, pose: &[f64]) -> Result<(), MachineError> {
        let reach = 2.0 * self.link_length_m;
        for i in 0..CHAINS {
            let r = self.corner(i, pose[2].sin_cos());
            let o = self.base_joint(i);
            let distance_m = (pose[0] + r[0] - o[0]).hypot(pose[1] + r[1] - o[1]);
            // Equal links reach every distance up to 2l; at 0 the driven link's direction is undefined.
            let nearest_m = distance_m.clamp(1e-3 * reach, reach * (1.0 - 1e-6));
            if nearest_m != distance_m {
                return Err(MachineError::Unreachable {
                    chain: i + 1,
                    distance_m,
                    nearest_m,
                    missing_m: (distance_m - nearest_m).abs(),
                    direction: if distance_m > nearest_m {
                        "more"
                    } else {
                        "less"
                    },
                });
            }
        }
        Ok(())
    }

    fn reducer_ratio(&self) -> f64 {
        self.reducer_ratio
    }

    fn with_elastic_damping(&self, ratio: f64) -> Self {
        Self {
            elastic_damping_ratio: ratio,
            ..self.clone()
        }
    }

    fn parameters(&mut self) -> Vec<Parameter<'_>> {
        let alone = Parameter::alone;
        vec![
            alone("base_side_m", &mut self.base_side_m),
            alone("link_length_m", &mut self.link_length_m),
            alone("platform_side_m", &mut self.platform_side_m),
            alone("link_thickness_m", &mut self.link_thickness_m),
            alone("link_height_m", &mut self.link_height_m),
            alone("youngs_modulus_pa", &mut self.youngs_modulus_pa),
            alone("density_kg_per_m3", &mut self.density_kg_per_m3),
            alone("passive_link_mass_kg", &mut self.passive_link_mass_kg),
            alone("elbow_joint_mass_kg", &mut self.elbow_joint_mass_kg),
            alone("platform_joint_mass_kg", &mut self.platform_joint_mass_kg),
            Parameter {
                key: "platform_mass_kg",
                value: &mut self.platform_mass_kg,
                with: &["platform_inertia_kg_m2"],
            },
            alone("platform_inertia_kg_m2", &mut self.platform_inertia_kg_m2),
            alone("motor_inertia_kg_m2", &mut self.motor_inertia_kg_m2),
            alone("reducer_ratio", &mut self.reducer_ratio),
            alone("gauge_position", &mut self.gauge_position),
            alone("elastic_damping_ratio", &mut self.elastic_damping_ratio),
        ]
    }

    fn validate(&self) -> Result<(), MachineError> {
        positive("base_side_m", self.base_side_m)?;
        positive("link_length_m", self.link_length_m)?;
        positive("platform_side_m", self.platform_side_m)?;
        positive("link_thickness_m", self.link_thickness_m)?;
        positive("link_height_m", self.link_height_m)?;
        positive("youngs_modulus_pa", self.youngs_modulus_pa)?;
        positive("density_kg_per_m3", self.density_kg_per_m3)?;
        not_negative("passive_link_mass_kg", self.passive_link_mass_kg)?;
        not_negative("elbow_joint_mass_kg", self.elbow_joint_mass_kg)?;
        not_negative("platform_joint_mass_kg", self.platform_joint_mass_kg)?;
        positive("platform_mass_kg", self.platform_mass_kg)?;
        positive("platform_inertia_kg_m2", self.platform_inertia_kg_m2)?;
        not_negative("motor_inertia_kg_m2", self.motor_inertia_kg_m2)?;
        positive("reducer_ratio", self.reducer_ratio)?;
        not_negative("elastic_damping_ratio", self.elastic_damping_ratio)?;
        if !(0.0..1.0).contains(&self.gauge_position) {
            return Err(MachineError::Parameter {
                key: "gauge_position",
                value: self.gauge_position,
                rule: "must lie between 0 (root) and below 1 (tip, where there is no strain)",
            });
        }
        Ok(())
    }

    fn assumptions(&self) -> Vec<Assumption> {
        let entry = |key, value: String, origin| Assumption { key, value, origin };
        let calibrated =
            "calibrated or assumed: the paper takes it from a source that could not be obtained";
        vec![
            entry(
                "base_side_m",
                format!("{} m", self.base_side_m),
                "derived: the paper's start is the base centroid",
            ),
            entry(
                "link_length_m",
                format!("{} m", self.link_length_m),
                calibrated,
            ),
            entry(
                "platform_side_m",
                format!("{} m", self.platform_side_m),
                calibrated,
            ),
            entry(
                "youngs_modulus_pa",
                format!("{:e} Pa", self.youngs_modulus_pa),
                calibrated,
            ),
            entry(
                "density_kg_per_m3",
                format!("{} kg/m³", self.density_kg_per_m3),
                calibrated,
            ),
            entry(
                "passive_link_mass_kg",
                format!("{} kg", self.passive_link_mass_kg),
                calibrated,
            ),
            entry(
                "elbow_joint_mass_kg",
                format!("{} kg", self.elbow_joint_mass_kg),
                calibrated,
            ),
            entry(
                "platform_joint_mass_kg",
                format!("{} kg", self.platform_joint_mass_kg),
                calibrated,
            ),
            entry(
                "platform_mass_kg",
                format!("{} kg", self.platform_mass_kg),
                "calibrated to the paper's duration",
            ),
            entry(
                "platform_inertia_kg_m2",
                format!("{} kg·m²", self.platform_inertia_kg_m2),
                "calibrated: m_p h²/12",
            ),
            entry(
                "elbow",
                format!("{:?}", self.elbow).to_lowercase(),
                calibrated,
            ),
            entry(
                "gauge_position",
                format!("{}", self.gauge_position),
                "assumed: mid-span",
            ),
        ]
    }
}

#[cfg(test)]
mod tests;
