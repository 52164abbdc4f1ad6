//! Probe.
use std::sync::Arc;
use std::time::Instant;
use stillpoint::movefile::MoveFile;
use stillpoint::nlp::*;
use stillpoint::ocp::*;
use stillpoint::plan::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let t0 = Instant::now();
    let file = MoveFile::read(&args[1]).unwrap_or_else(|e| panic!("{e}"));
    let mesh = Mesh::uniform(args[2].parse().unwrap(), args[3].parse().unwrap());
    let guess = quintic_guess(&file, args[4].parse().unwrap());
    let t = Arc::new(Transcription::new(
        Arc::new(move_problem(&file)),
        mesh,
        &guess,
    ));
    let x = t.unknowns(&guess);
    let nlp = CollocationNlp::new(Arc::clone(&t), x, None);
    println!(
        "setup {:?} n {} m {} jac {} hess {}",
        t0.elapsed(),
        t.variables(),
        t.constraints(),
        nlp.jacobian_structure().len(),
        nlp.hessian_structure().len()
    );
    let t1 = Instant::now();
    let out = Pounce.solve(
        Box::new(nlp),
        &Settings {
            tolerance: 1e-6,
            max_iterations: 2000,
        },
        Box::new(|i| {
            if std::env::var("LOG").is_ok() {
                println!("{i:?}");
            }
            true
        }),
    );
    println!(
        "{} it {} solve {:?} T {}",
        out.status,
        out.iterations,
        t1.elapsed(),
        t.solution(&out.x).duration_s
    );
}
