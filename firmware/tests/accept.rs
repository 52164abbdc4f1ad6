//! Every reason to reject a trajectory, with place and numbers, and the tolerances.

mod common;

use common::{
    AXES, DURATION_TICKS, INTERVAL_TICKS, INTERVALS, Index, POINTS, REACH_RAD, axis_limits,
    changed, late_push, limits, start, trajectory,
};
use proptest::prelude::*;
use stillpoint_firmware::accept::{AcceptConfig, check};
use stillpoint_shared::status::{Limit, Place, Quantity, Rejection};
use stillpoint_shared::{
    AxisLimits, Header, LIMIT_TOLERANCE, Limits, Trajectory, TrajectoryBuilder, TrajectoryError,
    lgr,
};

fn judge(trajectory: &Trajectory) -> Result<(), Rejection> {
    check(
        trajectory,
        &limits(),
        &start().into(),
        &AcceptConfig::default(),
    )
}

/// Judges the move with one value replaced; at a shared node on both sides.
fn with_value(target: Index, value: f64) -> Result<(), Rejection> {
    let (interval, node, quantity, axis) = target;
    let twin = (node == 0 && interval > 0).then(|| (interval - 1, POINTS, quantity, axis));
    judge(&changed(&limits(), |index, planned| {
        if index == target || Some(index) == twin {
            value
        } else {
            planned
        }
    }))
}

/// Judges the move under other limits for all axes.
fn under(axis: AxisLimits) -> Result<(), Rejection> {
    let limits = Limits::new(&[axis; AXES]).unwrap();
    check(
        &changed(&limits, |_, value| value),
        &limits,
        &start().into(),
        &AcceptConfig::default(),
    )
}

/// By how much a polynomial may exceed its limit between the places that are looked at, tolerance included.
const GAP: f32 = 1.07e-2;

const POSITION: usize = 0;
const VELOCITY: usize = 1;
const TORQUE: usize = 2;

#[test]
fn a_good_move_is_accepted() {
    assert_eq!(judge(&trajectory()), Ok(()));
}

#[test]
fn another_machine_is_rejected() {
    let three = Limits::new(&[axis_limits(); 3]).unwrap();
    let found = check(&trajectory(), &three, &[0.0; 3], &AcceptConfig::default());
    assert_eq!(
        found,
        Err(Rejection::Axes {
            trajectory: 2,
            machine: 3
        })
    );
    let found = check(
        &trajectory(),
        &limits(),
        &[0.0; 3],
        &AcceptConfig::default(),
    );
    assert_eq!(
        found,
        Err(Rejection::Axes {
            trajectory: 2,
            machine: 2
        })
    );
    let found = check(
        &Trajectory::empty(),
        &limits(),
        &start().into(),
        &AcceptConfig::default(),
    );
    assert_eq!(
        found,
        Err(Rejection::Axes {
            trajectory: 0,
            machine: 2
        })
    );

    let weaker = Limits::new(
        &[AxisLimits {
            torque_nm: 99.0,
            ..axis_limits()
        }; AXES],
    )
    .unwrap();
    let found = check(
        &trajectory(),
        &weaker,
        &start().into(),
        &AcceptConfig::default(),
    );
    assert_eq!(
        found,
        Err(Rejection::LimitsHash {
            trajectory: limits().hash(),
            machine: weaker.hash()
        })
    );
}

/// The move with one coefficient replaced on the wire, sealed again as a malicious or broken
/// planner would.
fn forged(coefficient: usize, value: f32) -> Trajectory {
    let original = trajectory();
    let mut bytes = [0; 4096];
    let length = original.encode(&mut bytes).unwrap().len();
    let header_length = postcard::to_slice(original.header(), &mut [0; 64])
        .unwrap()
        .len();
    let per_interval = (POINTS + 1) * 3 * AXES;
    // Before the first coefficient: list length, duration (3 bytes), points, coefficient count.
    let offset = header_length + 1 + 5 + 4 * coefficient;
    assert!(coefficient < per_interval);
    bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
    let Err(TrajectoryError::ContentHash { computed, .. }) = Trajectory::decode(&bytes[..length])
    else {
        panic!("the seal holds against a changed coefficient")
    };
    let mut header: Header = *original.header();
    header.content_hash = computed;
    let mut forged = [0; 4096];
    let header_end = postcard::to_slice(&header, &mut forged).unwrap().len();
    let body = &bytes[header_length..length];
    forged[header_end..header_end + body.len()].copy_from_slice(body);
    Trajectory::decode(&forged[..header_end + body.len()]).unwrap()
}

#[test]
fn values_that_are_no_numbers_are_rejected() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        // Node 0, velocity of axis 1.
        let at = Place {
            axis: 1,
            interval: 0,
            ticks: 0,
        };
        assert_eq!(
            judge(&forged(3, value)),
            Err(Rejection::NotFinite {
                at,
                quantity: Quantity::Velocity
            })
        );
        // Node 8, torque of axis 0.
        let at = Place {
            axis: 0,
            interval: 0,
            ticks: INTERVAL_TICKS,
        };
        let found = judge(&forged(8 * 6 + 4, value));
        assert_eq!(
            found,
            Err(Rejection::NotFinite {
                at,
                quantity: Quantity::Torque
            })
        );
    }
}

#[test]
fn jumps_where_intervals_meet_are_rejected() {
    let at = Place {
        axis: 1,
        interval: 2,
        ticks: 2 * INTERVAL_TICKS,
    };
    for (quantity, name, jump) in [
        (POSITION, Quantity::Position, 2e-6),
        (VELOCITY, Quantity::Velocity, 2e-5),
        (TORQUE, Quantity::Torque, 2e-5),
    ] {
        let jumped = |jump: f64| {
            judge(&changed(&limits(), |index, value| {
                if index == (2, 0, quantity, 1) {
                    value + jump
                } else {
                    value
                }
            }))
        };
        match jumped(jump) {
            Err(Rejection::Jump {
                at: found,
                quantity,
                before,
                after,
                tolerance,
            }) => {
                assert_eq!((found, quantity), (at, name));
                assert!(
                    f64::from((after - before).abs()) > jump / 2.0
                        && tolerance < (after - before).abs()
                );
            }
            other => panic!("{name:?}: {other:?}"),
        }
        assert_eq!(jumped(jump / 100.0), Ok(()), "{name:?} within rounding");
    }
}

#[test]
fn a_start_elsewhere_is_rejected() {
    let mut measured = start();
    measured[1] += 0.002;
    let found = check(
        &trajectory(),
        &limits(),
        &measured.into(),
        &AcceptConfig::default(),
    );
    let at = Place {
        axis: 1,
        interval: 0,
        ticks: 0,
    };
    let (planned_rad, measured_rad) = (start()[1], measured[1]);
    assert_eq!(
        found,
        Err(Rejection::StartsElsewhere {
            at,
            planned_rad,
            measured_rad,
            tolerance_rad: 1e-3
        })
    );

    let wide = AcceptConfig {
        start_tolerance_rad: 3e-3,
        ..AcceptConfig::default()
    };
    assert_eq!(
        check(&trajectory(), &limits(), &measured.into(), &wide),
        Ok(())
    );
    measured[1] = f32::NAN;
    assert!(check(&trajectory(), &limits(), &measured.into(), &wide).is_err());
}

#[test]
fn ends_that_move_or_push_are_rejected() {
    let (first, last) = ((0, 0), (INTERVALS - 1, POINTS));
    for (number, quantity, tolerance) in [
        (VELOCITY, Quantity::Velocity, LIMIT_TOLERANCE * 20.0),
        (TORQUE, Quantity::Torque, LIMIT_TOLERANCE * 100.0),
    ] {
        for ((interval, node), ticks) in [(first, 0), (last, DURATION_TICKS)] {
            let at = Place {
                axis: 0,
                interval: interval as u8,
                ticks,
            };
            let value = -1.5 * tolerance;
            let found = with_value((interval, node, number, 0), f64::from(value));
            assert_eq!(
                found,
                Err(Rejection::NotStill {
                    at,
                    quantity,
                    value,
                    tolerance
                })
            );
            assert_eq!(
                with_value((interval, node, number, 0), 0.5 * f64::from(tolerance)),
                Ok(())
            );
        }
    }
    let loaded = changed(&limits(), |(_, _, quantity, _), value| {
        if quantity == TORQUE {
            value + 5.0
        } else {
            value
        }
    });
    assert!(matches!(
        judge(&loaded),
        Err(Rejection::NotStill {
            quantity: Quantity::Torque,
            ..
        })
    ));
    let holding = AcceptConfig {
        torque_free_ends: false,
        ..AcceptConfig::default()
    };
    assert_eq!(check(&loaded, &limits(), &start().into(), &holding), Ok(()));
}

#[test]
fn limits_at_the_nodes_are_kept_and_named() {
    let exceeds = |found, limit, value: f64, allowed: f32| match found {
        Err(Rejection::Exceeds {
            at,
            limit: named,
            value: found,
            allowed: bound,
        }) => {
            assert_eq!((named, bound), (limit, allowed));
            assert!(
                (f64::from(found) - value).abs() < 1e-3 * value.abs(),
                "{found} instead of {value}"
            );
            at
        }
        other => panic!("{limit:?}: {other:?}"),
    };
    let at = exceeds(
        with_value((1, 3, VELOCITY, 1), -20.01),
        Limit::Speed,
        -20.01,
        20.0,
    );
    assert_eq!((at.axis, at.interval), (1, 1));
    assert!(at.ticks > INTERVAL_TICKS && at.ticks < 2 * INTERVAL_TICKS);
    exceeds(
        with_value((1, 3, TORQUE, 0), 100.02),
        Limit::Torque,
        100.02,
        100.0,
    );
    exceeds(
        with_value((2, 0, TORQUE, 0), -100.02),
        Limit::Torque,
        -100.02,
        100.0,
    );

    // 18 rad/s is 3 beyond the knee: 70 N·m are left.
    let fast = |torque: f64| {
        judge(&changed(
            &limits(),
            |(interval, node, quantity, axis), value| match (interval, node, quantity, axis) {
                (1, 4, VELOCITY, 1) => 18.0,
                (1, 4, TORQUE, 1) => torque,
                _ => value,
            },
        ))
    };
    exceeds(fast(70.2), Limit::TorqueSpeed, 70.2, 70.0);

    // The quintic's largest torque rate is at its ends: 60 J Δ / T³.
    let rate = 60.0 * common::INERTIA * REACH_RAD[0] / (f64::from(DURATION_TICKS) * 1e-7).powi(3);
    let bounded = |rate: f64| {
        under(AxisLimits {
            torque_rate_nm_per_s: rate as f32,
            ..axis_limits()
        })
    };
    let at = exceeds(
        bounded(rate * 0.99),
        Limit::TorqueRate,
        rate,
        (rate * 0.99) as f32,
    );
    assert_eq!(
        at,
        Place {
            axis: 0,
            interval: 0,
            ticks: 0
        }
    );
}

#[test]
fn a_move_that_touches_its_limits_is_accepted() {
    let duration_s = f64::from(DURATION_TICKS) * 1e-7;
    let rate = 60.0 * common::INERTIA * REACH_RAD[0] / duration_s.powi(3);
    assert_eq!(
        under(AxisLimits {
            torque_rate_nm_per_s: rate as f32,
            ..axis_limits()
        }),
        Ok(())
    );
    // The quintic's own extremes, between the nodes: 10/√3 J Δ / T² and 15/8 Δ / T.
    let torque_nm =
        (10.0 / 3.0f64.sqrt() * common::INERTIA * REACH_RAD[0] / duration_s.powi(2)) as f32;
    let speed_rad_per_s = (1.875 * REACH_RAD[0] / duration_s) as f32;
    let touched = AxisLimits {
        torque_nm: torque_nm * (1.0 - 0.9e-4),
        speed_rad_per_s: speed_rad_per_s * (1.0 - 0.9e-4),
        ..axis_limits()
    };
    assert_eq!(under(touched), Ok(()));
    // What is beyond the gap of the places looked at is not let through.
    let torque = AxisLimits {
        torque_nm: torque_nm * (1.0 - GAP),
        ..axis_limits()
    };
    assert!(matches!(
        under(torque),
        Err(Rejection::Exceeds {
            limit: Limit::Torque,
            ..
        })
    ));
    let speed = AxisLimits {
        speed_rad_per_s: speed_rad_per_s * (1.0 - GAP),
        ..axis_limits()
    };
    assert!(matches!(
        under(speed),
        Err(Rejection::Exceeds {
            limit: Limit::Speed,
            ..
        })
    ));
}

#[test]
fn the_torque_rate_counts_at_the_end_of_an_interval() {
    let c = 10.0;
    let judged = |rate_nm_per_s: f64| {
        let axis = AxisLimits {
            torque_rate_nm_per_s: rate_nm_per_s as f32,
            ..axis_limits()
        };
        let limits = Limits::new(&[axis; AXES]).unwrap();
        check(
            &late_push(&limits, c),
            &limits,
            &[0.0; AXES],
            &AcceptConfig::default(),
        )
    };
    // τ′ = c (1 + x) (1 − 3 x) is −4 c at the end, where LGR has no point; at the points it is less
    // than half of that.
    let rate = 4.0 * c * 200.0;
    assert_eq!(judged(rate), Ok(()));
    let Err(Rejection::Exceeds {
        at,
        limit: Limit::TorqueRate,
        value,
        ..
    }) = judged(rate * (1.0 - 1.2e-4))
    else {
        panic!("too fast at the end")
    };
    assert!(
        (f64::from(value) / -rate - 1.0).abs() < 1e-6,
        "{value} instead of {rate}"
    );
    assert_eq!(
        at,
        Place {
            axis: 0,
            interval: 1,
            ticks: 200_000
        }
    );
}

#[test]
fn rounding_of_a_large_torque_is_not_taken_for_a_rate() {
    // A ramp at the limit over 1 ms on top of 90 N·m: half an ulp of 90 N·m, differentiated, is far
    // more than 1e-4 of it.
    let rate_nm_per_s = 100.0;
    let axis = AxisLimits {
        torque_rate_nm_per_s: rate_nm_per_s as f32,
        ..axis_limits()
    };
    let limits = Limits::new(&[axis]).unwrap();
    let mut nodes = [0.0; 21];
    lgr::support_nodes(&mut nodes).unwrap();
    let config = AcceptConfig {
        torque_free_ends: false,
        ..AcceptConfig::default()
    };
    let ramp = |rate: f64| {
        let rows = nodes.map(|x| [0.0, 0.0, 90.0 + rate * 0.5e-3 * (x + 1.0)]);
        let mut builder = TrajectoryBuilder::new(1, &limits);
        builder.interval(10_000, 20, rows.as_flattened()).unwrap();
        check(&builder.finish().unwrap(), &limits, &[0.0], &config)
    };
    assert_eq!(ramp(rate_nm_per_s), Ok(()));
    assert!(ramp(rate_nm_per_s * 1.2).is_err());
}

#[test]
fn a_rejection_says_where_what_and_how_much() {
    let message = with_value((1, 0, TORQUE, 1), -123.5)
        .unwrap_err()
        .to_string();
    assert_eq!(
        message,
        "axis 2, interval 1, t = 0.0200000 s (tick 200000): the torque is -123.5 N·m, 100 N·m are allowed: \
         plan with the machine's limits"
    );
}

proptest! {
    #[test]
    fn whatever_the_coefficients_there_is_an_answer(coefficient in 0usize..54, bits in any::<u32>()) {
        let value = f32::from_bits(bits);
        prop_assume!(value.to_bits() != trajectory().coefficients()[coefficient].to_bits());
        let found = judge(&forged(coefficient, value));
        if !value.is_finite() {
            let named = matches!(found, Err(Rejection::NotFinite { .. }));
            prop_assert!(named, "{:?}", found);
        }
    }
}
