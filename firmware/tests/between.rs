//! Between the nodes: what keeps its limits there is accepted, what exceeds them by more than the stated gap is not.

use proptest::prelude::*;
use stillpoint_firmware::accept::{AcceptConfig, check};
use stillpoint_shared::status::{Limit, Rejection};
use stillpoint_shared::{AxisLimits, Basis, Limits, Trajectory, TrajectoryBuilder, lgr};

const DURATION_TICKS: u32 = 1_000_000;
const DURATION_S: f64 = 0.1;

/// 1 / cos(√3/12), and the tolerance of acceptance.
const GAP: f64 = 1.0107;

const WIDE: AxisLimits = AxisLimits {
    torque_nm: 1e3,
    torque_rate_nm_per_s: 1e6,
    speed_rad_per_s: 1e3,
    knee_speed_rad_per_s: 1e3,
    slope_nm_s_per_rad: 0.0,
};

fn judged(trajectory: &Trajectory, limits: &Limits) -> Result<(), Rejection> {
    let config = AcceptConfig {
        torque_free_ends: false,
        ..AcceptConfig::default()
    };
    check(trajectory, limits, &[trajectory.coefficients()[0]], &config)
}

/// One interval with position, velocity and torque of one axis as functions of x.
fn one(limits: &Limits, points: usize, rows: impl Fn(f64) -> [f64; 3]) -> Trajectory {
    let basis = Basis::new(points).unwrap();
    let values: Vec<f64> = (basis.nodes().iter())
        .flat_map(|&x| rows(f64::from(x)))
        .collect();
    let mut builder = TrajectoryBuilder::new(1, limits);
    builder.interval(DURATION_TICKS, points, &values).unwrap();
    builder.finish().unwrap()
}

fn chebyshev(n: usize, x: f64) -> f64 {
    (n as f64 * x.clamp(-1.0, 1.0).acos()).cos()
}

#[test]
fn a_speed_beyond_its_limit_between_the_nodes_is_found() {
    // v = 1.02 v_max (1 − x²) is beyond its limit within 0.14 of the middle, where N = 3 has no node.
    let axis = AxisLimits {
        speed_rad_per_s: 10.0,
        ..WIDE
    };
    let limits = Limits::new(&[axis]).unwrap();
    let mut nodes = [0.0; 4];
    lgr::support_nodes(&mut nodes).unwrap();
    let speed = |x: f64| 10.2 * (1.0 - x * x);
    assert!(nodes.iter().all(|&x| speed(x) < 9.4));
    let found = judged(&one(&limits, 3, |x| [0.0, speed(x), 0.0]), &limits);
    let Err(Rejection::Exceeds {
        at,
        limit: Limit::Speed,
        value,
        allowed,
    }) = found
    else {
        panic!("{found:?}")
    };
    assert_eq!((at.axis, at.interval, allowed), (0, 0, 10.0));
    assert!(value > 10.0 && value < 10.2001, "{value}");
    let from_middle = (f64::from(at.ticks) / f64::from(DURATION_TICKS) - 0.5).abs();
    assert!(from_middle < 0.07, "{at:?}");
}

#[test]
fn the_torque_speed_curve_holds_between_the_nodes() {
    // |τ| + 5 (|v| − 10) ≤ 100 is exceeded where both are large, in the middle.
    let axis = AxisLimits {
        torque_nm: 100.0,
        knee_speed_rad_per_s: 10.0,
        slope_nm_s_per_rad: 5.0,
        ..WIDE
    };
    let limits = Limits::new(&[axis]).unwrap();
    let bell = |x: f64| (1.0 - x * x).powi(2);
    let at = |torque: f64| {
        judged(
            &one(&limits, 8, |x| [0.0, 20.0 * bell(x), torque * bell(x)]),
            &limits,
        )
    };
    // At x = 0: τ + 5 (20 − 10) = 100.
    assert_eq!(at(50.0), Ok(()));
    assert!(matches!(
        at(50.0 * GAP * 1.002),
        Err(Rejection::Exceeds {
            limit: Limit::TorqueSpeed,
            ..
        })
    ));
}

#[test]
fn a_position_faster_than_its_limit_is_found_whatever_the_velocity_says() {
    let axis = AxisLimits {
        speed_rad_per_s: 10.0,
        ..WIDE
    };
    let limits = Limits::new(&[axis]).unwrap();
    // p = a T₉(x) has |dp/dx| ≤ 81 a.
    let a = 10.0 * DURATION_S / 2.0 / 81.0;
    let at = |a: f64| {
        judged(
            &one(&limits, 10, |x| [2.0 + a * chebyshev(9, x), 0.0, 0.0]),
            &limits,
        )
    };
    assert_eq!(at(a * 0.9999), Ok(()));
    assert!(matches!(
        at(a * GAP),
        Err(Rejection::Exceeds {
            limit: Limit::Speed,
            ..
        })
    ));
}

#[test]
fn what_is_no_number_between_the_nodes_is_refused() {
    let limits = Limits::new(&[WIDE]).unwrap();
    // Differences of neighbouring values are beyond f32.
    let huge = one(&limits, 5, |x| [3e38 * (7.0 * x).sin(), 0.0, 0.0]);
    assert!(matches!(
        judged(&huge, &limits),
        Err(Rejection::Exceeds {
            limit: Limit::Speed,
            ..
        })
    ));
}

/// Extremes of a polynomial through the values, and of its slope, by dense sampling in f64.
fn extremes(points: usize, values: &[f64]) -> [f64; 2] {
    let basis = Basis::new(points).unwrap();
    let nodes: Vec<f64> = basis.nodes().iter().map(|&x| f64::from(x)).collect();
    let mut weights = vec![0.0; nodes.len()];
    lgr::barycentric_weights(&nodes, &mut weights).unwrap();
    let at = |values: &[f64], x: f64| {
        if let Some(hit) = nodes.iter().position(|&node| node == x) {
            return values[hit];
        }
        let terms = nodes
            .iter()
            .zip(&weights)
            .map(|(node, weight)| weight / (x - node));
        let (above, below) = terms
            .zip(values)
            .fold((0.0, 0.0), |(a, b), (t, v)| (a + t * v, b + t));
        above / below
    };
    let mut row = vec![0.0; nodes.len()];
    let slopes: Vec<f64> = (0..nodes.len())
        .map(|i| {
            lgr::differentiation_row(&nodes, &weights, i, &mut row).unwrap();
            row.iter().zip(values).map(|(d, v)| d * v).sum()
        })
        .collect();
    [values, &slopes].map(|own| {
        (0..=4_000)
            .map(|k| at(own, -(std::f64::consts::PI * f64::from(k) / 4_000.0).cos()).abs())
            .fold(0.0, f64::max)
    })
}

proptest! {
    #[test]
    fn inside_is_accepted_and_beyond_the_gap_is_not(
        points in 3..=14_usize,
        values in prop::collection::vec(-1.0..1.0_f64, 15),
    ) {
        let limits = Limits::new(&[WIDE]).unwrap();
        let mut left = values.iter();
        let rows = std::cell::RefCell::new(&mut left);
        let noise = one(&limits, points, |x| {
            let value = rows.borrow_mut().next().copied().unwrap_or(0.0);
            // Still at both ends.
            let speed = if x.abs() < 1.0 { 3.0 * value } else { 0.0 };
            [value, speed, value * 50.0]
        });
        let own = |quantity: usize| -> Vec<f64> {
            noise.coefficients().iter().skip(quantity).step_by(3).map(|&v| f64::from(v)).collect()
        };
        let per_s = 2.0 / DURATION_S;
        let [_, position_slope] = extremes(points, &own(0));
        let [speed, _] = extremes(points, &own(1));
        let [torque, torque_slope] = extremes(points, &own(2));
        prop_assume!(position_slope > 0.01 && torque_slope > 0.01);
        let speed = speed.max(position_slope * per_s);
        let exact = AxisLimits {
            torque_nm: torque as f32,
            torque_rate_nm_per_s: (torque_slope * per_s) as f32,
            speed_rad_per_s: speed as f32,
            ..WIDE
        };
        let again = |axis: AxisLimits| {
            let limits = Limits::new(&[axis]).unwrap();
            let mut left = values.iter();
            let rows = std::cell::RefCell::new(&mut left);
            let same = one(&limits, points, |x| {
                let value = rows.borrow_mut().next().copied().unwrap_or(0.0);
                // Still at both ends.
            let speed = if x.abs() < 1.0 { 3.0 * value } else { 0.0 };
            [value, speed, value * 50.0]
            });
            judged(&same, &limits)
        };
        prop_assert_eq!(again(exact), Ok(()));
        // Of slopes, rounding is let through on top: here less than two in a thousand.
        let (gap, slope_gap) = ((1.0 / GAP) as f32, (1.0 / (GAP + 2e-3)) as f32);
        for (limit, tight) in [
            (Limit::Torque, AxisLimits { torque_nm: exact.torque_nm * gap, ..exact }),
            (Limit::TorqueRate, AxisLimits { torque_rate_nm_per_s: exact.torque_rate_nm_per_s * slope_gap, ..exact }),
            (Limit::Speed, AxisLimits { speed_rad_per_s: exact.speed_rad_per_s * slope_gap, ..exact }),
        ] {
            let found = again(tight);
            let named = matches!(found, Err(Rejection::Exceeds { limit: found, .. }) if found == limit);
            prop_assert!(named, "{:?}: {:?}", limit, found);
        }
    }
}
