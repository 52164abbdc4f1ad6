//! Where the time of an iteration goes: `cargo run --release -p stillpoint --example iteration [MOVE.toml]`.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};
use stillpoint::movefile::MoveFile;
use stillpoint::nlp::{NlpProblem, NlpSolver, Pounce, Settings, Start};
use stillpoint::ocp::{Bounds, CollocationNlp, Mesh, Transcription};
use stillpoint::plan::{move_problem, quintic_guess};

/// A program that adds up the time spent in its callbacks.
struct Timed {
    nlp: CollocationNlp,
    spent: Rc<Cell<Duration>>,
}

impl Timed {
    fn time<T>(&mut self, work: impl FnOnce(&mut CollocationNlp) -> T) -> T {
        let started = Instant::now();
        let result = work(&mut self.nlp);
        self.spent.set(self.spent.get() + started.elapsed());
        result
    }
}

impl NlpProblem for Timed {
    fn variable_bounds(&self) -> &[Bounds] {
        self.nlp.variable_bounds()
    }
    fn constraint_bounds(&self) -> &[Bounds] {
        self.nlp.constraint_bounds()
    }
    fn jacobian_structure(&self) -> &[(usize, usize)] {
        self.nlp.jacobian_structure()
    }
    fn hessian_structure(&self) -> &[(usize, usize)] {
        self.nlp.hessian_structure()
    }
    fn start(&self) -> &Start {
        self.nlp.start()
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.time(|nlp| nlp.objective(x))
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.time(|nlp| nlp.gradient(x, gradient));
    }
    fn constraints(&mut self, x: &[f64], values: &mut [f64]) {
        self.time(|nlp| nlp.constraints(x, values));
    }
    fn jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        self.time(|nlp| nlp.jacobian(x, entries));
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], entries: &mut [f64]) {
        self.time(|nlp| nlp.hessian(x, factor, multipliers, entries));
    }
}

fn main() {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "host/moves/paper.toml".to_owned());
    let file = match MoveFile::read(path) {
        Ok(file) => file,
        Err(error) => return eprintln!("{error}"),
    };
    let guess = quintic_guess(&file, 0.06);
    let mesh = Mesh::uniform(file.mesh.intervals, file.mesh.points);
    let transcription = Arc::new(Transcription::new(
        Arc::new(move_problem(&file)),
        mesh,
        &guess,
    ));
    let start = transcription.unknowns(&guess);
    let settings = Settings {
        tolerance: file.solver.tolerance,
        max_iterations: file.solver.max_iterations,
        least_barrier: 0.0,
    };
    println!("iterations  ms per iteration  of it derivatives  of it linear algebra and the rest");
    for _ in 0..5 {
        let spent = Rc::new(Cell::new(Duration::ZERO));
        let nlp = CollocationNlp::new(Arc::clone(&transcription), start.clone(), None);
        let timed = Timed {
            nlp,
            spent: Rc::clone(&spent),
        };
        let started = Instant::now();
        let outcome = Pounce.solve(Box::new(timed), &settings, Box::new(|_| true));
        let per_iteration = |time: Duration| time.as_secs_f64() * 1e3 / outcome.iterations as f64;
        let (whole, derivatives) = (per_iteration(started.elapsed()), per_iteration(spent.get()));
        println!(
            "{:>10}  {whole:>16.2}  {derivatives:>17.2}  {:>33.2}",
            outcome.iterations,
            whole - derivatives
        );
    }
}
