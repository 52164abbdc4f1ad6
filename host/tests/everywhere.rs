//! Limits everywhere: for every kind a move that breaks it between the points when it is planned at the points only, and keeps
//! it when planned everywhere. The judge is the certificate, which knows nothing of the planning.

use stillpoint::certify::{Limited, Proof};
use stillpoint::movefile::{LimitsAt, MoveFile, PAPER_MOVE};
use stillpoint::nlp::{Monitor, NlpProblem, NlpSolver, Outcome, Pounce, Settings};
use stillpoint::plan::{Plan, PlanError, plan};
use stillpoint::study::random_moves;

const AXIS: &str = include_str!("../moves/axis.toml");

fn changed(text: &str, changes: &[(&str, &str)]) -> MoveFile {
    let mut text = text.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    MoveFile::parse(&text, "move.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn planned(file: &MoveFile, limits: LimitsAt) -> Plan {
    let mut file = file.clone();
    file.solver.limits = limits;
    plan(&file, &Pounce, Box::new(|_, _| true)).unwrap_or_else(|error| panic!("{error}"))
}

/// The largest excess over a limit of a kind that is really reached, as a share of it.
fn reached(plan: &Plan, limited: Limited, name: &str) -> f64 {
    let proofs = plan.section.certificate.proofs.iter();
    let of_kind = proofs.filter(|proof| proof.limited == limited && proof.name.contains(name));
    let excess = |proof: &Proof| proof.reached / proof.limit - 1.0;
    of_kind.map(excess).fold(f64::NEG_INFINITY, f64::max)
}

/// Plans both ways; the limits named are broken in the one and proved in the other.
fn assert_held(file: &MoveFile, broken: &[(Limited, &str)]) {
    let at_nodes = planned(file, LimitsAt::Nodes);
    for &(limited, name) in broken {
        let excess = reached(&at_nodes, limited, name);
        assert!(excess > 1e-4, "{limited:?} {name}: {excess}");
    }
    let everywhere = planned(file, LimitsAt::Everywhere);
    let certificate = &everywhere.section.certificate;
    assert!(certificate.is_certified(), "{}", certificate.verdict());
    for &(limited, name) in broken {
        // It is the limit that shapes the move, not a neighbour that keeps it away.
        let excess = reached(&everywhere, limited, name);
        assert!(
            (-5e-3..=0.0).contains(&excess),
            "{limited:?} {name}: {excess}"
        );
    }
    let played = everywhere
        .played
        .as_ref()
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(played.limited_ticks, 0);
    let cost = everywhere.solution.duration_s / at_nodes.solution.duration_s - 1.0;
    assert!((0.0..0.02).contains(&cost), "{cost}");
}

#[test]
fn torque_rate_and_elastic_displacement() {
    let broken = [
        (Limited::TorqueRate, "axis 3"),
        (Limited::Output, "elastic_displacement_y"),
    ];
    assert_held(&changed(PAPER_MOVE, &[]), &broken);
}

#[test]
fn stress() {
    let file = changed(PAPER_MOVE, &[("stress_pa = 355e6", "stress_pa = 120e6")]);
    assert_held(&file, &[(Limited::Output, "stress")]);
}

#[test]
fn torque() {
    let changes = [
        ("torque_nm = 20.0", "torque_nm = 6.0"),
        ("twist_rad = 0.05", "twist_rad = 0.5"),
    ];
    assert_held(&changed(AXIS, &changes), &[(Limited::Torque, "axis 1")]);
}

#[test]
fn speed() {
    let changes = [
        ("motor_speed_rpm = 6000.0", "motor_speed_rpm = 2000.0"),
        ("twist_rad = 0.05", "twist_rad = 0.5"),
    ];
    assert_held(
        &changed(AXIS, &changes),
        &[
            (Limited::Speed, "axis 1"),
            (Limited::PositionRate, "axis 1"),
        ],
    );
}

#[test]
fn torque_speed_curve() {
    let changes = [
        (
            "torque_speed_knee_rpm = 6000.0",
            "torque_speed_knee_rpm = 500.0",
        ),
        (
            "torque_speed_slope_nm_per_rpm = 0.0",
            "torque_speed_slope_nm_per_rpm = 0.006",
        ),
        ("twist_rad = 0.05", "twist_rad = 0.5"),
    ];
    assert_held(
        &changed(AXIS, &changes),
        &[(Limited::TorqueSpeed, "axis 1")],
    );
}

/// A solver that believes the move to be shorter than it is: no value exceeds its limit, but torques change too fast.
struct Hasty;

impl NlpSolver for Hasty {
    fn name(&self) -> &'static str {
        "hasty"
    }

    fn solve(
        &self,
        problem: Box<dyn NlpProblem>,
        settings: &Settings,
        monitor: Monitor,
    ) -> Outcome {
        let mut outcome = Pounce.solve(problem, settings, monitor);
        if let Some(duration) = outcome.x.last_mut() {
            *duration *= 0.95;
        }
        outcome
    }
}

#[test]
fn what_is_not_certified_is_refused() {
    let file = changed(AXIS, &[]);
    let error = plan(&file, &Hasty, Box::new(|_, _| true)).expect_err("limits are exceeded");
    assert!(matches!(error, PlanError::NotCertified { .. }), "{error}");
    let said = error.to_string();
    for part in [
        "does not hold",
        "torque rate of axis 1 reaches",
        "N·m/s",
        "[mesh]",
        "--limits nodes",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

/// So far from zero that one step of f32 from tick to tick is a speed of its own.
#[test]
fn a_limiter_that_may_act_is_said() {
    let file = changed(AXIS, &[("angle_rad = 1.0", "angle_rad = 1000.0")]);
    let plan = planned(&file, LimitsAt::Everywhere);
    let certificate = &plan.section.certificate;
    assert!(certificate.is_certified(), "{}", certificate.verdict());
    assert!(!certificate.limiter_never_acts());
    let warning = plan.warning().expect("a warning");
    for part in ["position", "f32", "axis 1", "limiter", "split the move"] {
        assert!(warning.contains(part), "{part}: {warning}");
    }
}

#[test]
fn other_meshes() {
    for (intervals, points, duration_s) in
        [(4, 6, 51.409e-3), (12, 8, 50.753e-3), (20, 5, 50.776e-3)]
    {
        let mut file = changed(PAPER_MOVE, &[]);
        (file.mesh.intervals, file.mesh.points) = (intervals, points);
        let plan = planned(&file, LimitsAt::Everywhere);
        let certificate = &plan.section.certificate;
        assert!(certificate.is_certified(), "{}", certificate.verdict());
        // Finer meshes approach the same move from above.
        assert!(
            plan.solution.duration_s < duration_s * 1.001,
            "{intervals}×{points}"
        );
        assert!(plan.solution.duration_s > 50.6e-3, "{intervals}×{points}");
    }
}

/// No singular pose is passed, not even between the points.
fn assert_stays_on_its_side(file: &MoveFile, plan: &Plan) {
    let at_start = file.machine.regularities(&file.from);
    for step in 0..=2000 {
        let state = plan.solution.state_at_share(f64::from(step) / 2000.0);
        for ((name, value), (_, start)) in
            (file.machine.regularities(&state[3..6]).iter()).zip(&at_start)
        {
            assert!(
                value * start > 0.0,
                "{name}: {start} at the start, then {value}"
            );
        }
    }
}

/// Of the long run of `cargo run --example random-moves` the first moves and one whose fastest polynomials step over a singular pose.
#[test]
fn random_moves_are_planned_without_help() {
    let paper = changed(PAPER_MOVE, &[]);
    let moves = random_moves(&paper, 12345).expect("a 3-RRR");
    let wanted = [1, 2, 3, 4, 10];
    for (_, random) in (1..=10).zip(moves).filter(|(n, _)| wanted.contains(n)) {
        let plan = planned(&random.file, LimitsAt::Everywhere);
        assert!(plan.section.certificate.is_certified(), "{random:?}");
        let mean = plan.hamiltonian.mean;
        assert!((mean + 1.0).abs() < 1e-3, "{mean} {random:?}");
        let played = plan
            .played
            .as_ref()
            .unwrap_or_else(|error| panic!("{error}: {random:?}"));
        assert_eq!(played.limited_ticks, 0, "{random:?}");
        assert_stays_on_its_side(&random.file, &plan);
    }
}
