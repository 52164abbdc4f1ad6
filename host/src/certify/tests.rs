//! Bounds against dense sampling, known extremes, broken trajectories and the executor itself.

use super::bernstein::Pieces;
use super::peak::peak;
use super::{Certificate, Coordinates, Limited, Proof, certify, playing};
use crate::machine::Plant;
use crate::movefile::{Limits, MoveFile, PAPER_MOVE};
use crate::simulate::trajectory::board_limits;
use proptest::prelude::*;
use stillpoint_firmware::accept::{self, AcceptConfig};
use stillpoint_shared::basis::{Basis, MAX_POINTS, MAX_SUPPORT};
use stillpoint_shared::status::Rejection;
use stillpoint_shared::{Player, Trajectory, TrajectoryBuilder, lgr, time};

/// The elastic axis with the torque–speed curve in force.
const AXIS: &str = include_str!("../../moves/axis.toml");

fn axis_file() -> MoveFile {
    let text = AXIS
        .replace("knee_rpm = 6000.0", "knee_rpm = 1000.0")
        .replace("nm_per_rpm = 0.0", "nm_per_rpm = 0.004");
    MoveFile::parse(&text, "axis.toml").expect("a move")
}

/// The board's nodes, and weights of their own.
struct Oracle {
    nodes: Vec<f64>,
    weights: Vec<f64>,
}

impl Oracle {
    fn new(points: usize) -> Self {
        let basis = Basis::new(points).unwrap();
        let nodes: Vec<f64> = basis.nodes().iter().map(|&x| f64::from(x)).collect();
        let mut weights = vec![0.0; nodes.len()];
        lgr::barycentric_weights(&nodes, &mut weights).unwrap();
        Self { nodes, weights }
    }
}

/// The exact polynomial through values at the board's nodes, by the second barycentric formula.
fn exact(oracle: &Oracle, values: &[f64], x: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for ((node, weight), value) in oracle.nodes.iter().zip(&oracle.weights).zip(values) {
        if x == *node {
            return *value;
        }
        above += weight / (x - node) * value;
        below += weight / (x - node);
    }
    above / below
}

/// T_n(x).
fn chebyshev(n: usize, x: f64) -> f64 {
    (n as f64 * x.clamp(-1.0, 1.0).acos()).cos()
}

fn values_at_nodes(points: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let basis = Basis::new(points).unwrap();
    basis.nodes().iter().map(|&x| f(f64::from(x))).collect()
}

#[test]
fn extremes_of_chebyshev_polynomials_are_found() {
    for points in 2..=MAX_POINTS {
        let values = values_at_nodes(points, |x| chebyshev(points, x));
        let channel = Pieces::new(points).unwrap().channel(&values);
        // |T_n| ≤ 1, reached between the nodes as well as at the ends.
        let found = peak(channel.pieces.iter().cloned(), 1e-9);
        assert!(found.bound >= 1.0 - 1e-15, "N = {points}: {found:?}");
        assert!(found.bound <= 1.0 + 1e-7, "N = {points}: {found:?}");
        assert!(found.reached <= found.bound && found.reached > 1.0 - 1e-7);
        // |T_n′| ≤ n², reached at the ends alone (Markov).
        let square = (points * points) as f64;
        let slopes = channel.pieces.iter().map(|piece| piece.derivative());
        let found = peak(slopes, 1e-9);
        assert!(
            found.bound >= square * (1.0 - 1e-13),
            "N = {points}: {found:?}"
        );
        assert!(
            found.bound <= square * (1.0 + 1e-6),
            "N = {points}: {found:?}"
        );
        assert!(found.local.abs() > 1.0 - 1e-12, "N = {points}: {found:?}");
    }
}

proptest! {
    #[test]
    fn a_bound_holds_and_is_close(
        points in 2..=16_usize,
        values in prop::collection::vec(-10.0f32..10.0, 17),
    ) {
        let oracle = Oracle::new(points);
        let values: Vec<f64> = values[..=points].iter().map(|&v| f64::from(v)).collect();
        let channel = Pieces::new(points).unwrap().channel(&values);
        let found = peak(channel.pieces.iter().cloned(), 1e-7);
        let sampled = (0..=4000)
            .map(|k| exact(&oracle, &values, f64::from(k) / 2000.0 - 1.0).abs())
            .fold(0.0, f64::max);
        prop_assert!(found.bound >= sampled * (1.0 - 1e-12), "{} below {}", found.bound, sampled);
        prop_assert!(found.bound <= sampled * 1.001 + 1e-6, "{} far above {}", found.bound, sampled);
        let there = exact(&oracle, &values, found.local).abs();
        prop_assert!((there - found.reached).abs() < 1e-6 * (1.0 + there));
    }

    #[test]
    fn the_boards_evaluation_is_as_near_as_said(
        points in 2..=MAX_POINTS,
        values in prop::collection::vec(-100.0f32..100.0, MAX_POINTS + 1),
        at in prop::collection::vec(-1.0f32..=1.0, 50),
    ) {
        let oracle = Oracle::new(points);
        let own = &values[..=points];
        let exact_values: Vec<f64> = own.iter().map(|&v| f64::from(v)).collect();
        let rows: Vec<[[f32; 1]; 1]> = own.iter().map(|&v| [[v]]).collect();
        let basis = Basis::new(points).unwrap();
        let most = playing::rounding(points, Pieces::new(points).unwrap().channel(&exact_values).absolute);
        for x in at {
            let [[computed]] = basis.evaluate(x, &rows, &mut [0.0; MAX_SUPPORT]);
            let error = (f64::from(computed) - exact(&oracle, &exact_values, f64::from(x))).abs();
            prop_assert!(error <= most + 1e-11, "{error} of {most} at {x}, N = {points}");
        }
    }
}

/// A trajectory of the elastic axis: torque, speed and position from their own random values, in two intervals.
fn noisy(
    file: &MoveFile,
    points: usize,
    duration_ticks: u32,
    values: &[f32],
) -> (Trajectory, Coordinates) {
    let board = board_limits(&file.limits, file.machine.plant()).unwrap();
    let mut builder = TrajectoryBuilder::new(1, &board);
    let at = |interval: usize, node: usize, quantity: usize| {
        // The last node of an interval is the first of the next.
        f64::from(values[((interval * points + node) * 3 + quantity) % values.len()])
    };
    for interval in 0..2 {
        let rows: Vec<f64> = (0..=points)
            .flat_map(|node| (0..3).map(move |quantity| at(interval, node, quantity)))
            .collect();
        builder.interval(duration_ticks, points, &rows).unwrap();
    }
    let coordinates = Coordinates {
        count: 2,
        values: vec![0.01; 4 * (points + 1)],
    };
    (builder.finish().unwrap(), coordinates)
}

fn proof(certificate: &Certificate, limited: Limited, index: u8) -> &Proof {
    let mut proofs = certificate.proofs.iter();
    proofs
        .find(|proof| (proof.limited, proof.index) == (limited, index))
        .expect("proved")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_executor_stays_below_what_is_said_of_it(
        points in 2..=12_usize,
        duration_ticks in 20_000..200_000u32,
        values in prop::collection::vec(-5.0f32..5.0, 97),
    ) {
        let file = axis_file();
        let plant = file.machine.plant();
        let (trajectory, coordinates) = noisy(&file, points, duration_ticks, &values);
        let certificate = certify(&trajectory, &coordinates, &file.limits, plant).unwrap();
        let played = |limited| proof(&certificate, limited, 0).played.unwrap();
        let player = Player::<1>::new(&trajectory).unwrap();
        let period_s = time::seconds(time::DRIVE_PERIOD_TICKS);
        let mut before = player.sample(0).unwrap();
        let board = board_limits(&file.limits, plant).unwrap();
        let (k, knee) = (
            f64::from(board.axes()[0].slope_nm_s_per_rad),
            f64::from(board.axes()[0].knee_speed_rad_per_s),
        );
        for tick in 1.. {
            let now = player.sample(tick * time::DRIVE_PERIOD_TICKS).unwrap();
            let (speed, torque) = (
                f64::from(now.velocity_rad_per_s[0]).abs(),
                f64::from(now.torque_nm[0]),
            );
            prop_assert!(speed <= played(Limited::Speed));
            prop_assert!(torque.abs() <= played(Limited::Torque));
            prop_assert!(torque.abs() + k * (speed - knee) <= played(Limited::TorqueSpeed));
            let step = |now: f32, before: f32| (f64::from(now) - f64::from(before)).abs() / period_s;
            prop_assert!(step(now.position_rad[0], before.position_rad[0]) <= played(Limited::PositionRate));
            prop_assert!(step(now.torque_nm[0], before.torque_nm[0]) <= played(Limited::TorqueRate));
            before = now;
            if tick * time::DRIVE_PERIOD_TICKS > trajectory.duration_ticks() {
                break;
            }
        }
    }
}

/// The move file with limits at a factor of what a trajectory needs.
fn tightened(file: &MoveFile, certificate: &Certificate, factor: f64) -> MoveFile {
    let bound = |limited| proof(certificate, limited, 0).bound * factor;
    let ratio = file.machine.plant().reducer_ratio();
    let mut tight = file.clone();
    tight.limits.torque_nm = bound(Limited::Torque).max(bound(Limited::TorqueSpeed));
    tight.limits.torque_rate_nm_per_s = bound(Limited::TorqueRate);
    let speed = bound(Limited::Speed).max(bound(Limited::PositionRate));
    tight.limits.motor_speed_rpm = speed * ratio * 60.0 / std::f64::consts::TAU;
    tight
}

proptest! {
    #[test]
    fn what_is_certified_is_accepted_by_the_board(
        points in 2..=16_usize,
        duration_ticks in 1_000..2_000_000u32,
        mut values in prop::collection::vec(-5.0f32..5.0, 3 * 33),
    ) {
        let file = axis_file();
        let rows = 2 * points + 1;
        values.truncate(3 * rows);
        // Still at both ends.
        values[1] = 0.0;
        values[3 * (rows - 1) + 1] = 0.0;
        let judge = |file: &MoveFile| {
            let (trajectory, coordinates) = noisy(file, points, duration_ticks, &values);
            let limits = board_limits(&file.limits, file.machine.plant()).unwrap();
            let config = AcceptConfig { torque_free_ends: false, ..AcceptConfig::default() };
            let accepted = accept::check(&trajectory, &limits, &[values[0]], &config);
            (certified(file, (trajectory, coordinates)), accepted)
        };
        let (wide, _) = judge(&file);
        let (certificate, accepted) = judge(&tightened(&file, &wide, 1.0 + 1e-6));
        prop_assert!(certificate.is_certified(), "{}", certificate.text());
        prop_assert_eq!(accepted, Ok(()));
        // All limits 3 % too low: beyond the gap of the board's check.
        let (certificate, accepted) = judge(&tightened(&file, &wide, 0.97));
        prop_assert!(!certificate.is_certified());
        let exceeds = matches!(accepted, Err(Rejection::Exceeds { .. }));
        prop_assert!(exceeds, "{:?}", accepted);
    }
}

/// The paper's machine in a move that bends its links: coordinates as sums of sines.
fn bent(file: &MoveFile, points: usize, size: f64) -> (Trajectory, Coordinates) {
    let plant = file.machine.plant();
    let board = board_limits(&file.limits, plant).unwrap();
    let mut builder = TrajectoryBuilder::new(7, &board);
    let mut values = Vec::new();
    for interval in 0..3 {
        builder
            .interval(90_000, points, &vec![0.0; 9 * (points + 1)])
            .unwrap();
        for x in values_at_nodes(points, |x| x) {
            let s = (f64::from(interval) + 0.5 * (x + 1.0)) / 3.0;
            let wave = |n: f64| (std::f64::consts::TAU * n * s).sin() * size;
            let q = [
                file.from[0] + 0.03 * s,
                file.from[1] + 1e-3 * wave(1.0),
                0.05 * wave(0.5),
                0.3 * wave(2.0),
                -0.4 * wave(1.5),
                0.2 * wave(2.5),
            ];
            values.extend(q.map(|q| q as f32));
        }
    }
    (builder.finish().unwrap(), Coordinates { count: 6, values })
}

/// Largest magnitude of an output among samples.
fn sampled_output(
    plant: &dyn Plant,
    coordinates: &Coordinates,
    points: usize,
    output: usize,
) -> f64 {
    let (rows, oracle) = (points + 1, Oracle::new(points));
    let mut largest = 0.0_f64;
    for block in coordinates.values.chunks(6 * rows) {
        for k in 0..=2000 {
            let x = f64::from(k) / 1000.0 - 1.0;
            let q: Vec<f64> = (0..6)
                .map(|i| {
                    let own: Vec<f64> = block
                        .iter()
                        .skip(i)
                        .step_by(6)
                        .map(|&v| f64::from(v))
                        .collect();
                    exact(&oracle, &own, x)
                })
                .collect();
            largest = largest.max(plant.output_values(&q)[output].abs());
        }
    }
    largest
}

#[test]
fn elastic_displacement_and_stress_against_sampling() {
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
    let plant = file.machine.plant();
    for (points, size) in [(6, 1.0), (10, 0.3), (12, 2.0)] {
        let (trajectory, coordinates) = bent(&file, points, size);
        let certificate = certify(&trajectory, &coordinates, &file.limits, plant).unwrap();
        for output in [0, 1, 6, 7, 8] {
            let proof = proof(&certificate, Limited::Output, output as u8);
            let sampled = sampled_output(plant, &coordinates, points, output);
            assert!(
                proof.bound >= sampled * (1.0 - 1e-12),
                "{}: {} below {sampled}",
                proof.name,
                proof.bound
            );
            let close = sampled * (1.0 + 1e-5) + 2e-5 * proof.limit;
            assert!(
                proof.bound <= close,
                "{}: {} far above {sampled}",
                proof.name,
                proof.bound
            );
        }
    }
}

#[test]
fn links_that_do_not_reach_are_not_certified() {
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
    let plant = file.machine.plant();
    let (trajectory, mut coordinates) = bent(&file, 6, 0.1);
    // One node half a metre away: the polynomial leaves the workspace on its way there.
    coordinates.values[6 * 3] += 0.5;
    let certificate = certify(&trajectory, &coordinates, &file.limits, plant).unwrap();
    assert_eq!(proof(&certificate, Limited::Output, 0).bound, f64::INFINITY);
    assert!(!certificate.is_certified());
}

/// A still trajectory of the elastic axis but for a torque of `size` T₅(x), with its limit at 20 N·m.
fn ripple(file: &MoveFile, size: f64, change: impl Fn(&mut Vec<f64>)) -> (Trajectory, Coordinates) {
    let board = board_limits(&file.limits, file.machine.plant()).unwrap();
    let mut builder = TrajectoryBuilder::new(1, &board);
    let mut rows: Vec<f64> = values_at_nodes(8, |x| size * chebyshev(5, x))
        .into_iter()
        .flat_map(|torque| [0.0, 0.0, torque])
        .collect();
    change(&mut rows);
    builder.interval(10_000_000, 8, &rows).unwrap();
    let coordinates = Coordinates {
        count: 2,
        values: vec![0.0; 2 * 9],
    };
    (builder.finish().unwrap(), coordinates)
}

fn certified(file: &MoveFile, (trajectory, coordinates): (Trajectory, Coordinates)) -> Certificate {
    certify(
        &trajectory,
        &coordinates,
        &file.limits,
        file.machine.plant(),
    )
    .unwrap()
}

#[test]
fn a_limit_that_is_kept_at_the_nodes_alone_is_not_certified() {
    let file = axis_file();
    let inside = certified(&file, ripple(&file, 19.9999, |_| {}));
    assert!(inside.is_certified(), "{}", inside.text());
    // 20.01 T₅ is at most 20 at all nodes but the end, where it is cut to 19.9.
    let cut = certified(&file, ripple(&file, 20.01, |rows| rows[8 * 3 + 2] = 19.9));
    let torque = proof(&cut, Limited::Torque, 0);
    assert!(torque.is_violated() && !torque.holds());
    assert!(
        cut.verdict()
            .starts_with("Not certified: torque of axis 1 reaches 20.0"),
        "{}",
        cut.verdict()
    );
}

#[test]
fn one_ulp_counts() {
    let file = axis_file();
    // The end touches the limit exactly; one f32 up is beyond it.
    let end = |value: f32| move |rows: &mut Vec<f64>| rows[8 * 3 + 2] = f64::from(value);
    let bound = |value: f32| {
        let certificate = certified(&file, ripple(&file, 19.0, end(value)));
        proof(&certificate, Limited::Torque, 0).clone()
    };
    let (below, beyond) = (bound(20.0_f32.next_down()), bound(20.0_f32.next_up()));
    assert!(below.holds(), "{below:?}");
    assert!(!beyond.holds() && beyond.is_violated(), "{beyond:?}");
    assert!(beyond.bound > below.bound);
}

#[test]
fn degenerate_trajectories_have_certificates() {
    let file = axis_file();
    let board = board_limits(&file.limits, file.machine.plant()).unwrap();
    for (points, ticks, value) in [
        (2, 1, 0.0),
        (2, u32::MAX, 1.0),
        (MAX_POINTS, 1, 1e-30),
        (MAX_POINTS, 1_000, 1e30),
    ] {
        let mut builder = TrajectoryBuilder::new(1, &board);
        let rows = vec![value; 3 * (points + 1)];
        builder.interval(ticks, points, &rows).unwrap();
        let values = vec![0.0; 2 * (points + 1)];
        let coordinates = Coordinates { count: 2, values };
        let certificate = certified(&file, (builder.finish().unwrap(), coordinates));
        let torque = proof(&certificate, Limited::Torque, 0);
        assert!(
            torque.bound >= value && torque.bound <= value * (1.0 + 1e-6) + 1e-6,
            "{torque:?}"
        );
        assert_eq!(
            certificate.is_certified(),
            value < 10.0,
            "{}",
            certificate.text()
        );
    }
}

#[test]
fn no_number_is_not_certified() {
    let file = axis_file();
    let (trajectory, mut coordinates) = ripple(&file, 1.0, |_| {});
    coordinates.values[3] = f32::NAN;
    let certificate = certified(&file, (trajectory, coordinates));
    assert!(!certificate.is_certified());
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let file = axis_file();
    let paper = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
    let (trajectory, coordinates) = ripple(&file, 1.0, |_| {});
    let refused = |coordinates: &Coordinates, file: &MoveFile| {
        let limits: &Limits = &file.limits;
        certify(&trajectory, coordinates, limits, file.machine.plant())
            .unwrap_err()
            .to_string()
    };
    assert!(refused(&coordinates, &paper).contains("1 axes, the machine 3"));
    let fewer = Coordinates {
        count: 2,
        values: vec![0.0; 16],
    };
    assert!(refused(&fewer, &file).contains("16 values"));
    let other = Coordinates {
        count: 3,
        values: vec![0.0; 27],
    };
    assert!(refused(&other, &file).contains("3 coordinates"));
}
