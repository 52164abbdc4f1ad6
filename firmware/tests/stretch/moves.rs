//! Moves to stretch: the paper's, and random ones of rigid machines with coupled axes and a load.

use std::f64::consts::PI;

use proptest::prelude::*;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder, lgr};

pub(crate) const AXES: usize = 3;
const INTERVALS: usize = 6;
const POINTS: usize = 10;

pub(crate) fn axis_limits() -> AxisLimits {
    AxisLimits {
        torque_nm: 150.0,
        torque_rate_nm_per_s: 2e4,
        speed_rad_per_s: 31.4,
        knee_speed_rad_per_s: 24.9,
        slope_nm_s_per_rad: 22.9,
    }
}

pub(crate) fn limits() -> Limits {
    Limits::new(&[axis_limits(); AXES]).unwrap()
}

/// The paper's move as it was planned, with its bounds at the nodes only, played slower by
/// `stretch`: 138 N·m and, between the nodes, 28,700 N·m/s divided by its square and its cube.
pub(crate) fn paper(stretch: f64) -> Trajectory {
    let planned = Trajectory::decode(include_bytes!("../data/paper_move.spt")).unwrap();
    let mut builder = TrajectoryBuilder::new(1, &limits());
    for interval in planned.intervals() {
        let slower = |(place, &value): (usize, &f32)| {
            let quantity = place / AXES % 3;
            f64::from(value) / stretch.powi(quantity as i32)
        };
        let values: Vec<f64> = interval
            .coefficients
            .iter()
            .enumerate()
            .map(slower)
            .collect();
        let duration = (f64::from(interval.duration_ticks) * stretch).round();
        builder
            .interval(duration as u32, interval.points, &values)
            .unwrap();
    }
    builder.finish().unwrap()
}

/// A move of a rigid machine: v(s) = sin²(πs) times a wave, per axis; a constant mass matrix; a
/// load that changes along the path; and a part of the torque that no rigid axis explains.
#[derive(Debug, Clone)]
pub(crate) struct Rigid {
    pub(crate) reach: [f64; AXES],
    pub(crate) waves: [f64; AXES],
    pub(crate) phase: [f64; AXES],
    pub(crate) inertia: [f64; AXES],
    /// Off-diagonal entries of the mass matrix, per √(Jᵢ Jⱼ).
    pub(crate) coupling: f64,
    /// Static torque at both ends, in N·m.
    pub(crate) load: [[f64; 2]; AXES],
    /// Amplitude of the unexplained torque, per largest torque.
    pub(crate) other: f64,
    /// Share of the limits that the move uses.
    pub(crate) share: f64,
}

pub(crate) fn any_rigid() -> impl Strategy<Value = Rigid> {
    let each = |range: core::ops::Range<f64>| prop::array::uniform3(range);
    (
        each(-1.0..1.0),
        each(0.0..3.0),
        each(0.0..6.3),
        each(0.05..0.3),
        0.0..0.4,
        prop::array::uniform3(prop::array::uniform2(-20.0..20.0)),
        0.0..0.1,
        0.6..1.0,
    )
        .prop_map(
            |(reach, waves, phase, inertia, coupling, load, other, share)| Rigid {
                reach,
                waves,
                phase,
                inertia,
                coupling,
                load,
                other,
                share,
            },
        )
}

impl Rigid {
    /// Velocity per path of unit duration, before it is scaled to a duration.
    fn rate(&self, axis: usize, s: f64) -> f64 {
        let wave = 1.0 + 0.8 * (2.0 * PI * self.waves[axis] * s + self.phase[axis]).sin();
        self.reach[axis] * (PI * s).sin().powi(2) * wave
    }

    fn acceleration(&self, axis: usize, s: f64) -> f64 {
        let h = 1e-5;
        (self.rate(axis, s + h) - self.rate(axis, s - h)) / (2.0 * h)
    }

    fn mass(&self, i: usize, j: usize) -> f64 {
        let diagonal = (self.inertia[i] * self.inertia[j]).sqrt();
        if i == j {
            diagonal
        } else {
            self.coupling * diagonal
        }
    }

    /// Torque without the load, for a duration of 1 s.
    fn dynamic(&self, axis: usize, s: f64) -> f64 {
        let rigid: f64 = (0..AXES)
            .map(|other| self.mass(axis, other) * self.acceleration(other, s))
            .sum();
        let ripple = (PI * s).sin().powi(2) * (2.0 * PI * 4.0 * s + self.phase[axis]).sin();
        rigid + self.other * self.inertia[axis] * 6.0 * ripple
    }

    fn load(&self, axis: usize, s: f64) -> f64 {
        let [start, end] = self.load[axis];
        start + (end - start) * s
    }

    /// The shortest duration in s that keeps the share of the limits.
    fn duration_s(&self) -> f64 {
        let limits = axis_limits();
        let (torque_nm, rate) = (
            self.share * f64::from(limits.torque_nm),
            self.share * f64::from(limits.torque_rate_nm_per_s),
        );
        let fits = |duration: f64| {
            (0..AXES).all(|axis| {
                (0..400).all(|k| {
                    let s = f64::from(k) / 400.0;
                    let torque = |s| self.dynamic(axis, s) / duration.powi(2) + self.load(axis, s);
                    let slope = (torque(s + 1e-4) - torque(s)) / 1e-4 / duration;
                    let speed = self.rate(axis, s) / duration;
                    speed.abs() < 24.0 && torque(s).abs() < torque_nm && slope.abs() < rate
                })
            })
        };
        let mut duration = 0.02;
        while !fits(duration) {
            duration *= 1.02;
        }
        duration
    }

    pub(crate) fn trajectory(&self) -> Trajectory {
        let duration = self.duration_s();
        let mut nodes = [0.0; POINTS + 1];
        lgr::support_nodes(&mut nodes).unwrap();
        let mut builder = TrajectoryBuilder::new(2, &limits());
        let ticks = (duration * 1e7 / INTERVALS as f64).round() as u32;
        for interval in 0..INTERVALS {
            let mut rows = Vec::new();
            for x in nodes {
                let s = (interval as f64 + (x + 1.0) / 2.0) / INTERVALS as f64;
                rows.extend((0..AXES).map(|axis| self.position(axis, s)));
                rows.extend((0..AXES).map(|axis| self.rate(axis, s) / duration));
                rows.extend(
                    (0..AXES)
                        .map(|axis| self.dynamic(axis, s) / duration.powi(2) + self.load(axis, s)),
                );
            }
            builder.interval(ticks, POINTS, &rows).unwrap();
        }
        builder.finish().unwrap()
    }

    /// ∫ v, by Simpson's rule on panels that do not depend on s.
    fn position(&self, axis: usize, s: f64) -> f64 {
        let panels = 60;
        let h = s / f64::from(panels);
        (0..panels)
            .map(|k| {
                let a = f64::from(k) * h;
                let [f0, f1, f2] = [a, a + h / 2.0, a + h].map(|at| self.rate(axis, at));
                h / 6.0 * (f0 + 4.0 * f1 + f2)
            })
            .sum()
    }
}
