//! Laws of the limiter: whatever goes in, what comes out is within the limits; what is within
//! passes unchanged.

mod common;

use common::axis_limits;
use proptest::prelude::*;
use stillpoint_firmware::limiter::{LimiterConfig, available_torque_nm, limit};
use stillpoint_firmware::{LimitFlags, Setpoint};
use stillpoint_shared::{AxisLimits, LIMIT_TOLERANCE};

const PERIOD_S: f32 = 250e-6;

fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -200.0f32..200.0,
        2 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0]),
    ]
}

fn any_setpoint() -> impl Strategy<Value = Setpoint> {
    (any_f32(), prop_oneof![Just(0.0), any_f32()], any_f32()).prop_map(
        |(position_rad, velocity_rad_per_s, torque_nm)| Setpoint {
            position_rad,
            velocity_rad_per_s,
            torque_nm,
        },
    )
}

fn any_limits() -> impl Strategy<Value = AxisLimits> {
    (
        0.1f32..500.0,
        1.0f32..1e5,
        0.01f32..100.0,
        0.0f32..100.0,
        0.0f32..50.0,
    )
        .prop_map(
            |(
                torque_nm,
                torque_rate_nm_per_s,
                speed_rad_per_s,
                knee_speed_rad_per_s,
                slope_nm_s_per_rad,
            )| AxisLimits {
                torque_nm,
                torque_rate_nm_per_s,
                speed_rad_per_s,
                knee_speed_rad_per_s,
                slope_nm_s_per_rad,
            },
        )
}

/// Largest step of a quantity that may change by `rate` per second, with two roundings of f32.
fn step(rate: f32, from: f32, to: f32) -> f64 {
    let exact = f64::from(rate) * (1.0 + f64::from(LIMIT_TOLERANCE)) * f64::from(PERIOD_S);
    exact * (1.0 + 1e-6) + 2.0 * f64::from(f32::EPSILON) * f64::from(from.abs().max(to.abs()))
}

fn distance(from: f32, to: f32) -> f64 {
    (f64::from(to) - f64::from(from)).abs()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn output_is_within_the_limits_for_any_sequence(
        limits in any_limits(),
        start_rad in -10.0f32..10.0,
        wanted in prop::collection::vec(any_setpoint(), 1..20),
    ) {
        let config = LimiterConfig::new(&limits, PERIOD_S);
        let mut previous = Setpoint { position_rad: start_rad, ..Setpoint::default() };
        for wanted in wanted {
            let (sent, flags) = limit(&config, &previous, &wanted);
            prop_assert!(sent.velocity_rad_per_s.abs() <= limits.speed_rad_per_s * (1.0 + LIMIT_TOLERANCE));
            let moved = distance(previous.position_rad, sent.position_rad);
            prop_assert!(moved <= step(limits.speed_rad_per_s, previous.position_rad, sent.position_rad));
            let available_nm = available_torque_nm(&limits, sent.velocity_rad_per_s);
            prop_assert!(sent.torque_nm.abs() <= available_nm);
            prop_assert!(sent.torque_nm.abs() <= limits.torque_nm * (1.0 + LIMIT_TOLERANCE));
            if previous.torque_nm.abs() <= available_nm {
                let changed = distance(previous.torque_nm, sent.torque_nm);
                prop_assert!(changed <= step(limits.torque_rate_nm_per_s, previous.torque_nm, sent.torque_nm));
            }
            prop_assert_eq!(flags.is_empty(), sent == wanted, "{:?} for {:?} sent as {:?}", flags, wanted, sent);
            previous = sent;
        }
    }

    #[test]
    fn what_is_within_the_limits_passes_unchanged(
        start in (-3.0f32..3.0, -1.0f32..1.0),
        step in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0),
    ) {
        let limits = axis_limits();
        let config = LimiterConfig::new(&limits, PERIOD_S);
        let previous = Setpoint { position_rad: start.0, velocity_rad_per_s: 0.0, torque_nm: start.1 * 98.0 };
        let wanted = Setpoint {
            position_rad: previous.position_rad + step.0 * limits.speed_rad_per_s * PERIOD_S,
            velocity_rad_per_s: step.1 * limits.knee_speed_rad_per_s,
            torque_nm: previous.torque_nm + step.2 * limits.torque_rate_nm_per_s * PERIOD_S,
        };
        prop_assume!(wanted.torque_nm.abs() <= limits.torque_nm);
        prop_assert_eq!(limit(&config, &previous, &wanted), (wanted, LimitFlags::NONE));
    }
}

#[test]
fn each_limit_raises_its_flag() {
    let config = LimiterConfig::new(&axis_limits(), PERIOD_S);
    let at = |position_rad, velocity_rad_per_s, torque_nm| Setpoint {
        position_rad,
        velocity_rad_per_s,
        torque_nm,
    };
    let still = Setpoint::default();
    let pushing = at(0.0, 0.0, 99.5);
    let nan = f32::NAN;
    for (previous, wanted, flags) in [
        (still, at(0.0, 20.1, 0.0), LimitFlags::SPEED),
        (still, at(-0.01, 0.0, 0.0), LimitFlags::SPEED),
        (still, at(0.0, 0.0, -5.01), LimitFlags::TORQUE_RATE),
        (pushing, at(0.0, 0.0, 100.1), LimitFlags::TORQUE),
        (
            still,
            at(0.0, 0.0, 1e6),
            LimitFlags::TORQUE | LimitFlags::TORQUE_RATE,
        ),
        (
            at(0.0, 16.0, 89.9),
            at(0.0, 16.0, 90.1),
            LimitFlags::TORQUE_SPEED,
        ),
        (
            pushing,
            at(0.0, 16.0, 99.0),
            LimitFlags::TORQUE_SPEED | LimitFlags::TORQUE_RATE,
        ),
        (still, at(nan, 0.0, 0.0), LimitFlags::NOT_FINITE),
        (still, at(0.0, f32::INFINITY, 0.0), LimitFlags::NOT_FINITE),
        (
            pushing,
            at(0.0, 0.0, nan),
            LimitFlags::NOT_FINITE | LimitFlags::TORQUE_RATE,
        ),
    ] {
        let (sent, found) = limit(&config, &previous, &wanted);
        assert_eq!(
            found, flags,
            "{wanted:?} after {previous:?}, sent as {sent:?}"
        );
    }
    assert_eq!(
        format!("{:?}", LimitFlags::TORQUE | LimitFlags::SPEED),
        r#"{"torque", "speed"}"#
    );
}
