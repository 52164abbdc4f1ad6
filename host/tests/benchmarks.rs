//! The ten problems with known answers, solved without hints.

use std::ops::ControlFlow;
use std::sync::Arc;
use stillpoint::benchmarks::{Approach, Measured, RunError, all, named, run};
use stillpoint::nlp::{Pounce, Settings, Status};
use stillpoint::ocp::{
    Answer, Guess, HamiltonianAt, Mesh, RefineEnd, RefineSettings, Side, bang_bang, refine,
};

const TOLERANCE: f64 = 1e-7;

fn solved(name: &str) -> (f64, Measured) {
    let benchmark = named(name).expect("one of the ten");
    let answer = benchmark.answer;
    let approach = Approach::Automatic {
        tolerance: TOLERANCE,
    };
    let measured = run(benchmark, &approach, &Pounce).expect("an answer");
    (((measured.objective - answer) / answer).abs(), measured)
}

#[test]
fn there_are_ten_with_names_of_their_own() {
    let mut names: Vec<_> = all().iter().map(|benchmark| benchmark.name).collect();
    assert_eq!(names.len(), 10);
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 10);
    assert!(named("no such problem").is_none());
}

#[test]
fn refinement_reaches_the_tolerance_and_the_answer() {
    for (name, allowed) in [
        ("bryson-denham", TOLERANCE),
        ("hypersensitive", TOLERANCE),
        ("brachistochrone", 1e-11),
        ("rayleigh", 1e-9),
        ("goddard", TOLERANCE),
        // Its answer is known to 1e-6.
        ("van-der-pol", 1e-6),
    ] {
        let (error, measured) = solved(name);
        assert!(error < allowed, "{name}: {error:e}");
        assert!(measured.arcs.is_none(), "{name}");
        let (last, before) = match measured.log.as_slice() {
            [.., before, last] => (last, before),
            _ => panic!("{name}: one mesh cannot tell how far the objective moves"),
        };
        assert!(last.error <= TOLERANCE, "{name}: {last:?}");
        assert!(
            last.change.is_some_and(|change| change <= TOLERANCE),
            "{name}: {last:?}"
        );
        assert!(
            last.points >= before.points / 2 && last.points < 400,
            "{name}: {last:?}"
        );
        assert!(
            measured.miss.is_some_and(|miss| miss < 1e-6),
            "{name}: {:?}",
            measured.miss
        );
    }
}

/// Switching times in the order of time.
fn switches(measured: &Measured) -> Vec<f64> {
    let arcs = &measured.arcs.as_ref().expect("a bang-bang answer").arcs;
    let ends = arcs.iter().scan(0.0, |end, arc| {
        *end += arc.duration_s;
        Some(*end)
    });
    ends.take(arcs.len() - 1).collect()
}

#[test]
fn bang_bang_answers_are_found_without_hints() {
    let quarter = 32.0_f64.cbrt() / 4.0;
    for (name, expected) in [
        ("triple-integrator", vec![quarter, 3.0 * quarter]),
        (
            "floating-oscillator",
            vec![1.002_678_430_4, 2.108_933_255_2, 3.215_188_080_1],
        ),
    ] {
        let (error, measured) = solved(name);
        assert!(error < 1e-11, "{name}: {error:e}");
        let found = switches(&measured);
        assert_eq!(found.len(), expected.len(), "{name}: {found:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() < 1e-9,
                "{name}: {found} {expected}"
            );
        }
    }
    for (name, arcs) in [("robot-arm", 6), ("two-link-arm", 4)] {
        let (error, measured) = solved(name);
        assert!(error < 1e-11, "{name}: {error:e}");
        assert_eq!(switches(&measured).len() + 1, arcs, "{name}");
        assert!(
            measured.miss.is_some_and(|miss| miss < 1e-7),
            "{name}: {:?}",
            measured.miss
        );
    }
}

/// The arm's answer is symmetric in time: it swings out and back.
#[test]
fn the_robot_arm_moves_symmetrically() {
    let (_, measured) = solved("robot-arm");
    let times = switches(&measured);
    for (time, mirrored) in times.iter().zip(times.iter().rev()) {
        let sum = time + mirrored;
        assert!(
            (sum - measured.solution.duration_s).abs() < 1e-8,
            "{times:?}"
        );
    }
}

fn answer(name: &str, mesh: Mesh) -> (Arc<stillpoint::ocp::OptimalControlProblem>, Answer) {
    let benchmark = named(name).expect("one of the ten");
    let problem = Arc::new(benchmark.problem);
    let settings = Settings {
        tolerance: 1e-10,
        max_iterations: 500,
        least_barrier: 0.0,
    };
    let monitor = Box::new(|_: &_| true);
    let answer = Answer::of(
        &problem,
        mesh,
        &benchmark.guess,
        &Pounce,
        &settings,
        monitor,
    );
    assert_eq!(answer.status, Status::Solved);
    (problem, answer)
}

/// H = −1 all along for minimum time, and ∂H/∂u = 0 inside the bounds.
#[test]
fn costates_satisfy_pontryagins_conditions() {
    let (problem, answer) = answer("brachistochrone", Mesh::uniform(3, 14));
    for point in 0..answer.solution.controls.ncols() {
        let column = |matrix: &nalgebra::DMatrix<f64>| -> Vec<f64> {
            matrix.column(point).iter().copied().collect()
        };
        let (x, u) = (
            column(&answer.solution.states),
            column(&answer.solution.controls),
        );
        let here = HamiltonianAt::at(&problem, &x, &u, &column(&answer.costates.values));
        assert!((here.value + 1.0).abs() < 1e-7, "{point}: {here:?}");
        assert!(here.by_control[0].abs() < 1e-7, "{point}: {here:?}");
    }
}

#[test]
fn answers_that_are_not_bang_bang_stay_as_they_are() {
    // Goddard's has a singular arc; the other costs u².
    for name in ["goddard", "rayleigh"] {
        let (problem, answer) = answer(name, Mesh::uniform(20, 5));
        assert!(
            bang_bang(&problem, &answer, &Pounce, 300).is_none(),
            "{name}"
        );
    }
}

#[test]
fn the_sides_of_the_arcs_alternate() {
    let (problem, answer) = answer("triple-integrator", Mesh::uniform(7, 3));
    let found = bang_bang(&problem, &answer, &Pounce, 300).expect("two switches");
    let sides: Vec<_> = found.arcs.iter().map(|arc| arc.sides.clone()).collect();
    assert_eq!(
        sides,
        [vec![Side::Upper], vec![Side::Lower], vec![Side::Upper]]
    );
    assert!(found.optimality.hamiltonian < 1e-9 && found.optimality.switching < 1e-9);
    assert_eq!(found.optimality.bounds, 0.0);
    // The joined polynomials are the same motion: at half time the middle of the way, at rest no more.
    let middle = found.solution.state_at_share(0.5);
    assert!(
        (middle[0] - 0.5).abs() < 1e-12 && middle[2].abs() < 1e-11,
        "{middle:?}"
    );
}

#[test]
fn refinement_says_why_it_ends() {
    let end = |max_intervals, max_meshes, max_iterations| {
        let benchmark = named("hypersensitive").expect("one of the ten");
        let settings = RefineSettings {
            tolerance: 1e-7,
            max_intervals,
            max_points: 10_000,
            max_meshes,
            solver: Settings {
                tolerance: 1e-9,
                max_iterations,
                least_barrier: 0.0,
            },
        };
        let problem = Arc::new(benchmark.problem);
        let mesh = Mesh::uniform(10, 4);
        let go_on = |_: &_, _: &_| ControlFlow::Continue(());
        refine(&problem, mesh, &benchmark.guess, &Pounce, &settings, go_on)
    };
    let refined = end(20, 40, 500);
    let RefineEnd::Capacity { intervals, .. } = refined.end else {
        panic!("{:?}", refined.end);
    };
    assert!(intervals > 20);
    assert!(refined.log.iter().all(|mesh| mesh.intervals <= 20));
    let refined = end(1000, 3, 500);
    assert_eq!((refined.end, refined.log.len()), (RefineEnd::Meshes, 3));
    let refined = end(1000, 40, 1);
    assert_eq!(refined.end, RefineEnd::Unsolved(Status::IterationLimit));
    assert!(refined.log.is_empty());
}

#[test]
fn a_tolerance_out_of_reach_is_an_error() {
    let approach = Approach::Automatic { tolerance: 1e-30 };
    let benchmark = named("rayleigh").expect("one of the ten");
    let error = run(benchmark, &approach, &Pounce).expect_err("f64 ends before");
    assert!(matches!(error, RunError::Tolerance { .. }), "{error}");
}

/// x′ = −x, one interval: the estimate against the true error of the interpolant.
#[test]
fn the_estimate_is_of_the_size_of_the_error() {
    use stillpoint::autodiff::Scalar;
    use stillpoint::ocp::{Bounds, Exact, Model, OptimalControlProblem, Quantity, Sizes};
    struct Decay;
    impl Model for Decay {
        fn variables(&self) -> usize {
            1
        }
        fn values(&self) -> usize {
            2
        }
        fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
            out[0] = -z[0];
            out[1] = S::constant(0.0);
        }
    }
    struct Nothing;
    impl Model for Nothing {
        fn variables(&self) -> usize {
            3
        }
        fn values(&self) -> usize {
            1
        }
        fn evaluate<S: Scalar>(&self, _: &[S], out: &mut [S]) {
            out[0] = S::constant(0.0);
        }
    }
    let problem = Arc::new(OptimalControlProblem {
        sizes: Sizes {
            states: 1,
            controls: 0,
            path: 0,
            endpoint: 0,
        },
        stage: Box::new(Exact::new(Decay)),
        endpoint: Box::new(Exact::new(Nothing)),
        states: vec![Quantity::new("x", Bounds::FREE)],
        controls: vec![],
        path: vec![],
        ends: vec![],
        rates: vec![],
        guards: vec![],
        initial: vec![Bounds::fixed(1.0)],
        terminal: vec![Bounds::FREE],
        duration_s: Bounds::fixed(2.0),
    });
    for points in 3..9 {
        let settings = RefineSettings {
            tolerance: 1e-7,
            max_intervals: 10,
            max_points: 100,
            max_meshes: 1,
            solver: Settings {
                tolerance: 1e-12,
                max_iterations: 50,
                least_barrier: 0.0,
            },
        };
        let guess = Guess::line(2.0, vec![1.0], vec![0.1], vec![]);
        let mesh = Mesh::uniform(1, points);
        let stop = |_: &_, _: &_| ControlFlow::Break(());
        let refined = refine(&problem, mesh, &guess, &Pounce, &settings, stop);
        let solution = &refined.answer.solution;
        let range = 1.0 - (-2.0_f64).exp();
        let error = (0..=1000)
            .map(|k| f64::from(k) / 1000.0)
            .map(|s| (solution.state_at_share(s)[0] - (-2.0 * s).exp()).abs() / range)
            .fold(0.0, f64::max);
        let ratio = refined.log[0].error / error;
        assert!(
            (0.1..10.0).contains(&ratio),
            "{points} points: {ratio}, {error:e}"
        );
    }
}
