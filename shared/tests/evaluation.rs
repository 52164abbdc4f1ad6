//! f32 evaluation against f64: below 1e-6 of each channel's largest magnitude, anywhere.

mod common;

use common::{AXES, Smooth, limits};
use proptest::prelude::*;
use stillpoint_shared::trajectory::{FORMAT_VERSION, MAX_BASES};
use stillpoint_shared::{Player, Trajectory, TrajectoryBuilder, TrajectoryError, lgr};

/// Σ L_j(x) f_j in f64 by the second barycentric form: another formula than the one under test.
fn reference(nodes: &[f64], weights: &[f64], values: &[f64], x: f64) -> f64 {
    if let Some(hit) = nodes.iter().position(|&node| node == x) {
        return values[hit];
    }
    let (mut above, mut below) = (0.0, 0.0);
    for ((node, weight), value) in nodes.iter().zip(weights).zip(values) {
        above += weight / (x - node) * value;
        below += weight / (x - node);
    }
    above / below
}

struct Exact {
    start_ticks: u32,
    duration_ticks: u32,
    nodes: Vec<f64>,
    weights: Vec<f64>,
    rows: Vec<f64>,
}

fn build(smooth: &Smooth, mesh: &[(u32, usize)]) -> (Trajectory, Vec<Exact>) {
    let total_ticks: u32 = mesh.iter().map(|(duration_ticks, _)| duration_ticks).sum();
    let mut builder = TrajectoryBuilder::new(7, &limits());
    let mut exact = Vec::new();
    let mut start_ticks = 0;
    for &(duration_ticks, points) in mesh {
        let mut nodes = vec![0.0; points + 1];
        lgr::support_nodes(&mut nodes).unwrap();
        let mut weights = vec![0.0; points + 1];
        lgr::barycentric_weights(&nodes, &mut weights).unwrap();
        let rows = smooth.rows(
            &nodes,
            f64::from(start_ticks),
            f64::from(duration_ticks),
            f64::from(total_ticks),
        );
        builder.interval(duration_ticks, points, &rows).unwrap();
        exact.push(Exact {
            start_ticks,
            duration_ticks,
            nodes,
            weights,
            rows,
        });
        start_ticks += duration_ticks;
    }
    (builder.finish().unwrap(), exact)
}

/// Largest error of each channel at `ticks`, relative to the channel's largest magnitude.
fn worst_error(player: &Player<AXES>, exact: &[Exact], ticks: u32) -> f64 {
    let interval = exact
        .iter()
        .rfind(|interval| interval.start_ticks <= ticks)
        .unwrap();
    let elapsed = f64::from(ticks - interval.start_ticks);
    let x = (2.0 * elapsed / f64::from(interval.duration_ticks) - 1.0).min(1.0);
    let sample = player.sample(ticks).unwrap();
    let channels = [
        sample.position_rad,
        sample.velocity_rad_per_s,
        sample.torque_nm,
    ];
    let mut worst = 0.0f64;
    for (channel, found) in channels.as_flattened().iter().enumerate() {
        let values: Vec<f64> = interval
            .rows
            .iter()
            .skip(channel)
            .step_by(3 * AXES)
            .copied()
            .collect();
        let all = exact
            .iter()
            .flat_map(|interval| interval.rows.iter().skip(channel).step_by(3 * AXES));
        let largest = all.fold(0.0f64, |largest, value| largest.max(value.abs()));
        let expected = reference(&interval.nodes, &interval.weights, &values, x);
        worst = worst.max((f64::from(*found) - expected).abs() / largest);
    }
    worst
}

/// Times of all nodes, rounded to ticks, the neighbouring ticks and the boundaries.
fn node_ticks(exact: &[Exact]) -> Vec<u32> {
    let mut ticks = Vec::new();
    for interval in exact {
        for node in &interval.nodes {
            let at = f64::from(interval.start_ticks)
                + (node + 1.0) / 2.0 * f64::from(interval.duration_ticks);
            let at = at.round() as u32;
            ticks.extend([at.saturating_sub(1), at, at + 1]);
        }
    }
    ticks
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn f32_is_within_1e_6_of_f64_anywhere(
        smooth in common::smooth(),
        mesh in prop::collection::vec((200u32..400_000, 2usize..=20), 1..=8),
        times in prop::collection::vec(0.0f64..1.0, 200),
    ) {
        let (trajectory, exact) = build(&smooth, &mesh);
        let player = Player::<AXES>::new(&trajectory).unwrap();
        let duration = f64::from(trajectory.duration_ticks());
        let random = times.iter().map(|time| (time * duration) as u32);
        for ticks in random.chain(node_ticks(&exact)).filter(|&ticks| ticks <= trajectory.duration_ticks()) {
            let worst = worst_error(&player, &exact, ticks);
            prop_assert!(worst < 1e-6, "error {worst:e} at tick {ticks} of mesh {mesh:?}");
        }
    }
}

#[test]
fn twenty_points_keep_the_bound_at_every_tick_of_a_dense_scan() {
    let smooth = Smooth {
        phase: [0.3; 3 * AXES],
        waves: [1.0; 3 * AXES],
        offset: [0.5; 3 * AXES],
    };
    for points in 2..=20 {
        let (trajectory, exact) = build(&smooth, &[(84_487, points)]);
        let player = Player::<AXES>::new(&trajectory).unwrap();
        let worst = (0..=84_487)
            .step_by(7)
            .map(|ticks| worst_error(&player, &exact, ticks))
            .fold(0.0, f64::max);
        assert!(worst < 1e-6, "{points} points: {worst:e}");
    }
}

#[test]
fn after_the_end_the_last_node_is_held_exactly() {
    let (trajectory, exact) = build(&Smooth::default(), &[(90_000, 10), (80_001, 7)]);
    let player = Player::<AXES>::new(&trajectory).unwrap();
    let last: Vec<f32> = exact[1]
        .rows
        .iter()
        .rev()
        .take(3 * AXES)
        .rev()
        .map(|value| *value as f32)
        .collect();
    for ticks in [170_001, 170_002, u32::MAX] {
        let sample = player.sample(ticks).unwrap();
        assert_eq!(sample.position_rad, last[..AXES]);
        assert_eq!(sample.velocity_rad_per_s, last[AXES..2 * AXES]);
        assert_eq!(sample.torque_nm, last[2 * AXES..]);
    }
    assert_eq!(
        player.first().unwrap().torque_nm[0],
        exact[0].rows[2 * AXES] as f32
    );
}

#[test]
fn a_player_takes_only_its_number_of_axes_and_keeps_what_it_had() {
    let (trajectory, _) = build(&Smooth::default(), &[(90_000, 10)]);
    let wrong = Player::<2>::new(&trajectory).unwrap_err();
    assert_eq!(
        wrong,
        TrajectoryError::OtherAxes {
            found: AXES,
            expected: 2
        }
    );
    assert_eq!(Player::<AXES>::empty().sample(0), None);
    assert_eq!(Player::<AXES>::empty().first(), None);
}

#[test]
fn eight_different_bases_fit_and_a_player_reloads() {
    let mesh: Vec<_> = (2..2 + MAX_BASES).map(|points| (10_000, points)).collect();
    let (trajectory, exact) = build(&Smooth::default(), &mesh);
    let mut player = Player::<AXES>::new(&trajectory).unwrap();
    for ticks in node_ticks(&exact)
        .into_iter()
        .filter(|&ticks| ticks <= 80_000)
    {
        assert!(worst_error(&player, &exact, ticks) < 1e-6);
    }
    let (other, exact) = build(&Smooth::default(), &[(50_000, 3)]);
    player.load(&other).unwrap();
    assert_eq!(player.trajectory(), &other);
    assert!(worst_error(&player, &exact, 20_000) < 1e-6);
    assert_eq!(player.trajectory().header().version, FORMAT_VERSION);
}
