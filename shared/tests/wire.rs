//! The trajectory's bytes: a round trip, every refusal with its numbers, and no panic on any bytes.

mod common;

use common::{AXES, limits, paper_shaped};
use proptest::prelude::*;
use stillpoint_shared::trajectory::{
    MAX_BASES, MAX_COEFFICIENTS, MAX_ENCODED_BYTES, MAX_INTERVALS, coefficient_count,
};
use stillpoint_shared::{
    AxisLimits, LimitName, Limits, LimitsError, Trajectory, TrajectoryBuilder, TrajectoryError,
};

fn encoded(trajectory: &Trajectory) -> Vec<u8> {
    let mut buffer = [0; MAX_ENCODED_BYTES];
    trajectory.encode(&mut buffer).unwrap().to_vec()
}

/// Offset of the interval list in the bytes of a trajectory: what postcard makes of the header
/// alone.
fn header_bytes(trajectory: &Trajectory) -> usize {
    let mut buffer = [0; 64];
    postcard::to_slice(trajectory.header(), &mut buffer)
        .unwrap()
        .len()
}

#[test]
fn the_papers_move_takes_2_6_kb_and_comes_back_equal() {
    let trajectory = paper_shaped();
    let bytes = encoded(&trajectory);
    assert!(bytes.len() <= 2_600, "{} bytes", bytes.len());
    assert_eq!(Trajectory::decode(&bytes), Ok(trajectory));
}

#[test]
fn any_postcard_reader_sees_the_documented_structure() {
    #[derive(serde::Deserialize)]
    struct Interval {
        duration_ticks: u32,
        points: u8,
        coefficients: Vec<f32>,
    }
    #[derive(serde::Deserialize)]
    struct Whole {
        header: stillpoint_shared::Header,
        intervals: Vec<Interval>,
    }
    let trajectory = paper_shaped();
    let whole: Whole = postcard::from_bytes(&encoded(&trajectory)).unwrap();
    assert_eq!(&whole.header, trajectory.header());
    assert_eq!(whole.header.limits_hash, limits().hash());
    assert_eq!(whole.intervals.len(), 6);
    for (wire, interval) in whole.intervals.iter().zip(trajectory.intervals()) {
        assert_eq!(wire.duration_ticks, interval.duration_ticks);
        assert_eq!(usize::from(wire.points), interval.points);
        assert_eq!(wire.coefficients, interval.coefficients);
    }
}

#[test]
fn the_largest_trajectory_fits_its_buffer() {
    let limits = limits();
    let mut builder = TrajectoryBuilder::new(u32::MAX, &limits);
    for _ in 0..MAX_INTERVALS {
        let values = vec![-1.5; coefficient_count(4, AXES)];
        builder.interval(6_000_000, 4, &values).unwrap();
    }
    let trajectory = builder.finish().unwrap();
    assert!(MAX_COEFFICIENTS - trajectory.coefficients().len() < 9 * MAX_INTERVALS);
    assert_eq!(
        Trajectory::decode(&encoded(&trajectory)),
        Ok(trajectory.clone())
    );
    let small = trajectory.encode(&mut [0; 100]).unwrap_err();
    assert_eq!(small, TrajectoryError::BufferTooSmall { available: 100 });
}

/// Bytes of a small trajectory with one place overwritten.
fn spoiled(offset: usize, bytes: &[u8]) -> TrajectoryError {
    let mut whole = encoded(&paper_shaped());
    whole[offset..offset + bytes.len()].copy_from_slice(bytes);
    Trajectory::decode(&whole).unwrap_err()
}

#[test]
fn every_damage_is_named() {
    let trajectory = paper_shaped();
    let bytes = encoded(&trajectory);
    let list = header_bytes(&trajectory);
    let (interval_count, first) = (list, list + 1);

    assert_eq!(
        spoiled(0, b"ELF!"),
        TrajectoryError::Magic { found: *b"ELF!" }
    );
    assert_eq!(spoiled(4, &[9]), TrajectoryError::Version { found: 9 });
    assert_eq!(spoiled(6, &[0]), TrajectoryError::Axes { axes: 0 });
    assert_eq!(spoiled(6, &[7]), TrajectoryError::Axes { axes: 7 });
    assert_eq!(spoiled(interval_count, &[0]), TrajectoryError::NoIntervals);
    assert_eq!(
        spoiled(interval_count, &[65]),
        TrajectoryError::TooManyIntervals { intervals: 65 }
    );
    assert_eq!(
        spoiled(first, &[0x80, 0x80, 0x80, 0x80, 0x80]),
        TrajectoryError::Malformed { offset: first }
    );
    assert_eq!(
        spoiled(first, &[0x80, 0x80, 0x00]),
        TrajectoryError::NoDuration { interval: 0 }
    );
    assert_eq!(
        spoiled(first + 3, &[1]),
        TrajectoryError::Points {
            interval: 0,
            points: 1
        }
    );
    assert_eq!(
        spoiled(first + 3, &[33]),
        TrajectoryError::Points {
            interval: 0,
            points: 33
        }
    );
    let fewer = TrajectoryError::Coefficients {
        interval: 0,
        found: 99,
        expected: 90,
    };
    assert_eq!(spoiled(first + 3, &[9]), fewer);
    let longer = TrajectoryError::Duration {
        header_ticks: 506_922,
        sum_ticks: 506_923,
    };
    let mut shifted = bytes.clone();
    shifted[first] += 1;
    assert_eq!(Trajectory::decode(&shifted), Err(longer));
    assert!(matches!(
        spoiled(1_000, &[1]),
        TrajectoryError::ContentHash { .. }
    ));

    let mut trailing = bytes.clone();
    trailing.extend([0, 0]);
    assert_eq!(
        Trajectory::decode(&trailing),
        Err(TrajectoryError::Trailing { bytes: 2 })
    );
    for length in 0..bytes.len() {
        assert_eq!(
            Trajectory::decode(&bytes[..length]),
            Err(TrajectoryError::Truncated { bytes: length })
        );
    }
}

#[test]
fn a_failed_decode_leaves_nothing_behind() {
    let mut place = paper_shaped();
    let bytes = encoded(&place);
    assert!(place.decode_from(&bytes[..2_000]).is_err());
    assert_eq!(place, Trajectory::empty());
}

#[test]
fn the_builder_refuses_what_the_board_could_not_hold() {
    let mut builder = TrajectoryBuilder::new(1, &limits());
    let values = [0.0; coefficient_count(5, AXES)];
    assert_eq!(builder.clone().finish(), Err(TrajectoryError::NoIntervals));
    assert_eq!(
        builder.interval(0, 5, &values).unwrap_err(),
        TrajectoryError::NoDuration { interval: 0 }
    );
    let fewer = TrajectoryError::Coefficients {
        interval: 0,
        found: 53,
        expected: 54,
    };
    assert_eq!(builder.interval(1, 5, &values[1..]).unwrap_err(), fewer);
    let mut large = values;
    large[4] = 1e39;
    let overflow = TrajectoryError::NotFinite {
        interval: 0,
        index: 4,
        value: 1e39,
    };
    assert_eq!(builder.interval(1, 5, &large).unwrap_err(), overflow);

    builder.interval(u32::MAX, 5, &values).unwrap();
    assert_eq!(
        builder.interval(1, 5, &values).unwrap_err(),
        TrajectoryError::TooLong { interval: 1 }
    );

    let mut builder = TrajectoryBuilder::new(1, &limits());
    for points in 2..2 + MAX_BASES {
        builder
            .interval(1, points, &vec![0.0; coefficient_count(points, AXES)])
            .unwrap();
    }
    let one_more = builder
        .interval(1, 20, &vec![0.0; coefficient_count(20, AXES)])
        .unwrap_err();
    assert_eq!(
        one_more,
        TrajectoryError::TooManyBases {
            interval: MAX_BASES
        }
    );

    let mut builder = TrajectoryBuilder::new(1, &limits());
    let values = vec![0.0; coefficient_count(32, AXES)];
    let full = (0..MAX_INTERVALS).find_map(|_| builder.interval(1, 32, &values).err());
    assert_eq!(
        full,
        Some(TrajectoryError::TooManyCoefficients {
            interval: 10,
            needed: 11 * 297
        })
    );

    let mut builder = TrajectoryBuilder::new(1, &limits());
    let full = (0..=MAX_INTERVALS).find_map(|_| builder.interval(1, 2, &[0.0; 27]).err());
    assert_eq!(
        full,
        Some(TrajectoryError::TooManyIntervals {
            intervals: MAX_INTERVALS + 1
        })
    );
}

#[test]
fn limits_refuse_impossible_numbers_also_from_the_wire() {
    let good = limits().axes()[0];
    assert_eq!(Limits::new(&[]), Err(LimitsError::Axes { axes: 0 }));
    assert_eq!(Limits::new(&[good; 7]), Err(LimitsError::Axes { axes: 7 }));
    let no_torque = AxisLimits {
        torque_nm: 0.0,
        ..good
    };
    let refused = LimitsError::Value {
        axis: 1,
        name: LimitName::Torque,
        value: 0.0,
    };
    assert_eq!(Limits::new(&[good, no_torque]), Err(refused));
    for value in [-1.0, f32::INFINITY, f32::NAN] {
        assert!(
            Limits::new(&[AxisLimits {
                slope_nm_s_per_rad: value,
                ..good
            }])
            .is_err(),
            "{value}"
        );
    }

    let mut buffer = [0; 256];
    let bytes = postcard::to_slice(&limits(), &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes(bytes), Ok(limits()));
    bytes[1..5].copy_from_slice(&(-1.0f32).to_le_bytes());
    assert!(postcard::from_bytes::<Limits>(bytes).is_err());

    let other = Limits::new(
        &[AxisLimits {
            torque_nm: 150.00002,
            ..good
        }; 3],
    )
    .unwrap();
    assert_ne!(other.hash(), limits().hash());
}

#[test]
fn the_torque_speed_curve_is_flat_then_falls_to_zero() {
    let axis = AxisLimits {
        torque_nm: 100.0,
        torque_rate_nm_per_s: 1.0,
        speed_rad_per_s: 30.0,
        knee_speed_rad_per_s: 10.0,
        slope_nm_s_per_rad: 8.0,
    };
    for (speed, torque) in [
        (0.0, 100.0),
        (10.0, 100.0),
        (-15.0, 60.0),
        (22.5, 0.0),
        (1e9, 0.0),
    ] {
        assert_eq!(axis.available_torque_nm(speed), torque, "at {speed}");
    }
}

proptest! {
    #[test]
    fn arbitrary_bytes_are_refused_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Trajectory::decode(&bytes).is_err());
    }

    #[test]
    fn damaged_trajectories_are_refused_without_panic(
        damage in prop::collection::vec((any::<prop::sample::Index>(), 1u8..=255), 1..4),
    ) {
        let mut bytes = encoded(&paper_shaped());
        let before = bytes.clone();
        for (offset, flip) in damage {
            let offset = offset.index(bytes.len());
            bytes[offset] ^= flip;
        }
        prop_assume!(bytes != before);
        prop_assert!(Trajectory::decode(&bytes).is_err());
    }

    #[test]
    fn sealed_trajectories_come_back(
        smooth in common::smooth(),
        mesh in prop::collection::vec((1u32..1_000_000, 2usize..=9), 1..=20),
    ) {
        let mut builder = TrajectoryBuilder::new(3, &limits());
        for &(duration_ticks, points) in &mesh {
            let nodes: Vec<f64> = (0..=points).map(|node| 2.0 * node as f64 / points as f64 - 1.0).collect();
            let values = smooth.rows(&nodes, 0.0, 1.0, 1.0);
            builder.interval(duration_ticks, points, &values).unwrap();
        }
        let trajectory = builder.finish().unwrap();
        prop_assert_eq!(Trajectory::decode(&encoded(&trajectory)), Ok(trajectory));
    }
}

#[test]
fn messages_say_what_to_do() {
    let says = |error: TrajectoryError, words: &str| {
        let message = error.to_string();
        assert!(message.contains(words), "{message}");
    };
    says(spoiled(0, b"ELF!"), "give a file written by");
    says(spoiled(4, &[9]), "version 9, this side reads version 1");
    says(spoiled(1_000, &[1]), "damaged, copy or send it again");
}
