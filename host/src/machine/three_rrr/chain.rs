//! One chain of the 3-RRR: base joint O, flexible driven link to the elbow A, rigid link to the platform joint B.
//!
//! The driven link bends as ψ(s)m with ψ(s) = s²/2 − s³/(6l), so its tip is at p = A − O = l e + w n with the
//! deflection w = m l²/3, e along the clamped root and n across it.

use super::ThreeRrr;
use crate::autodiff::Scalar;

/// Position of a chain and its first derivatives.
pub(super) struct Chain<S> {
    /// p = A − O.
    arm: [S; 2],
    /// e, along the root of the driven link.
    along: [S; 2],
    /// n, across it.
    pub(super) normal: [S; 2],
    /// w = m l²/3.
    pub(super) deflection: S,
    curvature: S,
    /// u = (B − A)/l, unit vector along the passive link.
    pub(super) passive_link: [S; 2],
    /// ∂θ/∂B.
    pub(super) angle_by_joint: [S; 2],
    /// ∂θ/∂m.
    pub(super) angle_by_curvature: S,
    deflection_per_curvature: f64,
    link_length_m: f64,
}

/// Rates and accelerations of a chain.
pub(super) struct Motion<S> {
    angle_rate: S,
    /// θ̈.
    pub(super) angle_acceleration: S,
    curvature_rate: S,
    curvature_acceleration: S,
    elbow_acceleration: [S; 2],
    platform_joint_acceleration: [S; 2],
}

/// Generalised forces that a chain's inertia and stiffness ask for.
pub(super) struct Load<S> {
    /// Force at B, and what the joint angle's share of the load does through ∂θ/∂B.
    pub(super) platform_joint: [S; 2],
    /// Generalised force of the curvature.
    pub(super) curvature: S,
}

fn dot<S: Scalar>(a: [S; 2], b: [S; 2]) -> S {
    a[0] * b[0] + a[1] * b[1]
}

/// Turns a vector by +90°.
fn turned<S: Scalar>(a: [S; 2]) -> [S; 2] {
    [-a[1], a[0]]
}

impl<S: Scalar> Chain<S> {
    /// Solves the closure for the elbow; NaN where the links do not reach.
    pub(super) fn assemble(machine: &ThreeRrr, index: usize, joint: [S; 2], curvature: S) -> Self {
        let l = machine.link_length_m;
        let per_curvature = l * l / 3.0;
        let base = machine.base_joint(index);
        let w = curvature * per_curvature;
        let rho2 = w * w + l * l;
        let d = [joint[0] - base[0], joint[1] - base[1]];
        // p = g d + h d⊥ with |p| = ρ and |d − p| = l.
        let inverse = dot(d, d).recip();
        let g = (rho2 - l * l) * inverse * 0.5 + 0.5;
        let h = (rho2 * inverse - g * g).sqrt() * machine.elbow.sign();
        let arm = [g * d[0] - h * d[1], g * d[1] + h * d[0]];
        // As complex numbers p = (l + iw) e, so e = p (l − iw)/ρ².
        let scale = rho2.recip();
        let along = [
            (arm[0] * l + w * arm[1]) * scale,
            (arm[1] * l - w * arm[0]) * scale,
        ];
        let normal = turned(along);
        let u = [(d[0] - arm[0]) * (1.0 / l), (d[1] - arm[1]) * (1.0 / l)];
        // u·(dB − dp) = 0 with dp = p⊥ dθ + n dw.
        let lever = dot(u, turned(arm)).recip();
        let angle_by_joint = [u[0] * lever, u[1] * lever];
        Self {
            arm,
            along,
            normal,
            deflection: w,
            curvature,
            passive_link: u,
            angle_by_joint,
            angle_by_curvature: -(dot(angle_by_joint, normal) * per_curvature),
            deflection_per_curvature: per_curvature,
            link_length_m: l,
        }
    }

    /// Joint angle θ = α ± acos((ρ² + d² − l²)/(2ρd)) − atan2(w, l).
    pub(super) fn angle(machine: &ThreeRrr, index: usize, joint: [S; 2], curvature: S) -> S {
        let l = machine.link_length_m;
        let base = machine.base_joint(index);
        let w = curvature * (l * l / 3.0);
        let rho2 = w * w + l * l;
        let d = [joint[0] - base[0], joint[1] - base[1]];
        let d2 = dot(d, d);
        let cosine = (rho2 + d2 - l * l) / ((rho2 * d2).sqrt() * 2.0);
        d[1].atan2(d[0]) + cosine.acos() * machine.elbow.sign() - w.atan2(S::constant(l))
    }

    /// Differentiates the closure twice: u·(v_B − v_A) = 0 and |v_B − v_A|²/l + u·(a_B − a_A) = 0.
    pub(super) fn motion(
        &self,
        joint_rate: [S; 2],
        joint_acceleration: [S; 2],
        curvature_rate: S,
        curvature_acceleration: S,
    ) -> Motion<S> {
        let (p_turned, n) = (turned(self.arm), self.normal);
        let w_rate = curvature_rate * self.deflection_per_curvature;
        let w_acceleration = curvature_acceleration * self.deflection_per_curvature;
        let angle_rate =
            dot(self.angle_by_joint, joint_rate) + self.angle_by_curvature * curvature_rate;
        let elbow_rate: [S; 2] = std::array::from_fn(|k| p_turned[k] * angle_rate + n[k] * w_rate);
        let relative = [joint_rate[0] - elbow_rate[0], joint_rate[1] - elbow_rate[1]];
        // Elbow acceleration without the share of θ̈: ẅ n − 2ẇθ̇ e − θ̇² p.
        let rate2 = angle_rate * angle_rate;
        let coriolis = w_rate * angle_rate * 2.0;
        let partial: [S; 2] = std::array::from_fn(|k| {
            n[k] * w_acceleration - coriolis * self.along[k] - rate2 * self.arm[k]
        });
        let lever = dot(self.passive_link, p_turned);
        let rest = [
            joint_acceleration[0] - partial[0],
            joint_acceleration[1] - partial[1],
        ];
        let angle_acceleration = dot(self.angle_by_joint, rest)
            + dot(relative, relative) * (1.0 / self.link_length_m) / lever;
        Motion {
            angle_rate,
            angle_acceleration,
            curvature_rate,
            curvature_acceleration,
            elbow_acceleration: std::array::from_fn(|k| {
                partial[k] + p_turned[k] * angle_acceleration
            }),
            platform_joint_acceleration: joint_acceleration,
        }
    }

    /// Inertia and elastic forces of motor, driven link, joints and passive link, by virtual work.
    ///
    /// Driven link: ½μ[l³/3 θ̇² + 2(11l⁴/120) θ̇ṁ + (11l⁵/420)(ṁ² + m²θ̇²)]; passive link:
    /// (m₂/6)(v_A² + v_A·v_B + v_B²).
    pub(super) fn load(&self, machine: &ThreeRrr, motion: &Motion<S>) -> Load<S> {
        let l = machine.link_length_m;
        let mu = machine.density_kg_per_m3 * machine.link_thickness_m * machine.link_height_m;
        let rotary =
            machine.motor_inertia_kg_m2 * machine.reducer_ratio.powi(2) + mu * l.powi(3) / 3.0;
        let mixed = mu * 11.0 * l.powi(4) / 120.0;
        let bending = mu * 11.0 * l.powi(5) / 420.0;
        let m = self.curvature;
        let rate = motion.angle_rate;

        let sixth = machine.passive_link_mass_kg / 6.0;
        let force = |own: [S; 2], other: [S; 2], mass: f64| -> [S; 2] {
            std::array::from_fn(|k| own[k] * (mass + 2.0 * sixth) + other[k] * sixth)
        };
        let (at_elbow, at_joint) = (
            motion.elbow_acceleration,
            motion.platform_joint_acceleration,
        );
        let elbow = force(at_elbow, at_joint, machine.elbow_joint_mass_kg);
        let joint = force(at_joint, at_elbow, machine.platform_joint_mass_kg);

        let angle = motion.angle_acceleration * (m * m * bending + rotary)
            + motion.curvature_acceleration * mixed
            + m * motion.curvature_rate * rate * (2.0 * bending)
            + dot(elbow, turned(self.arm));
        let curvature = motion.angle_acceleration * mixed + motion.curvature_acceleration * bending
            - m * (rate * rate) * bending
            + m * machine.curvature_stiffness()
            + motion.curvature_rate * machine.elastic_damping()
            + dot(elbow, self.normal) * self.deflection_per_curvature;
        Load {
            platform_joint: std::array::from_fn(|k| joint[k] + self.angle_by_joint[k] * angle),
            curvature: curvature + self.angle_by_curvature * angle,
        }
    }
}
