//! Micro-benchmarks: `cargo bench -p stillpoint --bench planner`.

use divan::{Bencher, black_box};
use std::sync::Arc;
use stillpoint::machine::Equations;
use stillpoint::movefile::MoveFile;
use stillpoint::nlp::NlpProblem;
use stillpoint::ocp::{CollocationNlp, Mesh, OptimalControlProblem, Transcription};
use stillpoint::plan::{move_problem, plan, quintic_guess};
use stillpoint_shared::Player;

fn main() {
    divan::main();
}

fn file() -> MoveFile {
    MoveFile::parse(include_str!("../moves/paper.toml"), "paper.toml").expect("the paper's move")
}

/// A point in the middle of the move with everything moving.
const Q: [f64; 6] = [0.2, 0.11, 0.05, 0.2, -0.3, 0.25];
const V: [f64; 6] = [0.9, 0.1, -2.0, 40.0, -60.0, 30.0];
const TORQUE: [f64; 3] = [80.0, -100.0, 60.0];

#[divan::bench]
fn equations_of_motion(bencher: Bencher<'_, '_>) {
    let file = file();
    let plant = file.machine.plant();
    let mut equations = Equations::new(plant);
    bencher.bench_local(|| plant.equations(black_box(&Q), black_box(&V), &mut equations));
}

fn stage() -> (OptimalControlProblem, Vec<f64>) {
    let z = [&TORQUE[..], &Q, &V, &[1e4, -1e4, 5e3]].concat();
    (move_problem(&file()), z)
}

#[divan::bench]
fn dynamics_of_a_point(bencher: Bencher<'_, '_>) {
    let (problem, z) = stage();
    let mut out = vec![0.0; problem.sizes.stage_values()];
    bencher.bench_local(|| problem.stage.values(black_box(&z), &mut out));
}

#[divan::bench]
fn jacobian_of_a_point(bencher: Bencher<'_, '_>) {
    let (problem, z) = stage();
    let mut out = vec![0.0; problem.sizes.stage_values()];
    let mut entries = vec![0.0; problem.stage.structure().jacobian.len()];
    bencher.bench_local(|| {
        problem
            .stage
            .jacobian(black_box(&z), &mut out, &mut entries)
    });
}

#[divan::bench]
fn hessian_of_a_point(bencher: Bencher<'_, '_>) {
    let (problem, z) = stage();
    let weights = vec![0.3; problem.sizes.stage_values()];
    let mut entries = vec![0.0; problem.stage.structure().hessian.len()];
    bencher.bench_local(|| problem.stage.hessian(black_box(&z), &weights, &mut entries));
}

fn program() -> (CollocationNlp, Vec<f64>) {
    let file = file();
    let guess = quintic_guess(&file, 0.06);
    let mesh = Mesh::uniform(file.mesh.intervals, file.mesh.points);
    let transcription = Arc::new(Transcription::new(
        Arc::new(move_problem(&file)),
        mesh,
        &guess,
    ));
    let x = transcription.unknowns(&guess);
    (CollocationNlp::new(transcription, x.clone(), None), x)
}

/// Alternates between two iterates, so that nothing is remembered.
fn two_iterates(x: &[f64]) -> impl FnMut() -> Vec<f64> {
    let (a, b) = (x.to_vec(), x.iter().map(|x| x * 1.001).collect::<Vec<_>>());
    let mut first = false;
    move || {
        first = !first;
        if first { a.clone() } else { b.clone() }
    }
}

#[divan::bench]
fn constraints_of_the_program(bencher: Bencher<'_, '_>) {
    let (mut nlp, x) = program();
    let mut values = vec![0.0; nlp.constraint_bounds().len()];
    let mut next = two_iterates(&x);
    bencher.bench_local(|| nlp.constraints(&next(), &mut values));
}

#[divan::bench]
fn jacobian_of_the_program(bencher: Bencher<'_, '_>) {
    let (mut nlp, x) = program();
    let mut entries = vec![0.0; nlp.jacobian_structure().len()];
    let mut next = two_iterates(&x);
    bencher.bench_local(|| nlp.jacobian(&next(), &mut entries));
}

#[divan::bench]
fn hessian_of_the_program(bencher: Bencher<'_, '_>) {
    let (mut nlp, x) = program();
    let multipliers = vec![0.3; nlp.constraint_bounds().len()];
    let mut entries = vec![0.0; nlp.hessian_structure().len()];
    // The Jacobian at the same iterate is there already, as in every iteration of a solver.
    nlp.jacobian(&x, &mut vec![0.0; nlp.jacobian_structure().len()]);
    bencher.bench_local(|| nlp.hessian(black_box(&x), 1.0, &multipliers, &mut entries));
}

#[divan::bench]
fn trajectory_evaluation(bencher: Bencher<'_, '_>) {
    let plan = plan(&file(), &stillpoint::nlp::Pounce, Box::new(|_, _| true)).expect("a plan");
    let player = Player::<3>::new(&plan.trajectory).expect("three axes");
    bencher.bench_local(|| player.sample(black_box(123_456)));
}
