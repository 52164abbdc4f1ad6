//! Smooth random moves for the tests.
#![allow(dead_code)] // Each test file uses its part.

use proptest::prelude::*;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder, lgr};

pub(crate) const AXES: usize = 3;

pub(crate) fn limits() -> Limits {
    let axis = AxisLimits {
        torque_nm: 150.0,
        torque_rate_nm_per_s: 2e4,
        speed_rad_per_s: 31.4,
        knee_speed_rad_per_s: 24.9,
        slope_nm_s_per_rad: 22.9,
    };
    Limits::new(&[axis; AXES]).unwrap()
}

/// One wave per channel over an interval.
#[derive(Debug, Clone)]
pub(crate) struct Smooth {
    pub(crate) phase: [f64; 3 * AXES],
    pub(crate) waves: [f64; 3 * AXES],
    pub(crate) offset: [f64; 3 * AXES],
}

impl Default for Smooth {
    fn default() -> Self {
        Self {
            phase: [0.4; 3 * AXES],
            waves: [1.0; 3 * AXES],
            offset: [0.1; 3 * AXES],
        }
    }
}

pub(crate) fn smooth() -> impl Strategy<Value = Smooth> {
    let each = |range: core::ops::Range<f64>| prop::array::uniform9(range);
    (each(0.0..6.3), each(0.1..2.0), each(-2.0..2.0)).prop_map(|(phase, waves, offset)| Smooth {
        phase,
        waves,
        offset,
    })
}

impl Smooth {
    /// Node-major rows of an interval that starts at `start` and lasts `duration` out of `total`.
    pub(crate) fn rows(&self, nodes: &[f64], start: f64, duration: f64, total: f64) -> Vec<f64> {
        let mut rows = Vec::new();
        for node in nodes {
            let time = (start + (node + 1.0) / 2.0 * duration) / total;
            for channel in 0..3 * AXES {
                let scale = [1.0, 10.0, 150.0][channel / AXES];
                let wave = (self.phase[channel] + 6.3 * self.waves[channel] * time).sin();
                rows.push(scale * (self.offset[channel] + wave));
            }
        }
        rows
    }
}

/// A move shaped like the paper's: 6 intervals of 10 points on 3 axes.
pub(crate) fn paper_shaped() -> Trajectory {
    let mut builder = TrajectoryBuilder::new(1, &limits());
    let mut nodes = vec![0.0; 11];
    lgr::support_nodes(&mut nodes).unwrap();
    for interval in 0..6 {
        let rows = Smooth::default().rows(
            &nodes,
            84_487.0 * f64::from(interval),
            84_487.0,
            6.0 * 84_487.0,
        );
        builder.interval(84_487, 10, &rows).unwrap();
    }
    builder.finish().unwrap()
}
