//! The transcription against finite differences, and against optimal control problems with known answers.

use std::path::Path;
use std::sync::Arc;
use stillpoint::autodiff::Scalar;
use stillpoint::movefile::MoveFile;
use stillpoint::nlp::{NlpProblem, NlpSolver, Pounce, Settings, Status};
use stillpoint::ocp::{
    Bounds, CollocationNlp, Exact, Guess, Hamiltonian, Interval, Limited, Mesh, Model,
    OptimalControlProblem, Quantity, Sample, Sizes, Solution, Transcription,
};
use stillpoint::plan::{move_problem, quintic_guess, robust_problem};

/// Numbers between −1 and 1 from a linear congruential generator.
fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        })
        .collect()
}

fn dense(structure: &[(usize, usize)], entries: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; rows * columns];
    for (&(row, column), entry) in structure.iter().zip(entries) {
        matrix[row * columns + column] += entry;
    }
    matrix
}

/// Largest difference between exact and central-difference derivatives relative to the largest entry: gradient,
/// Jacobian, Hessian of the Lagrangian.
fn derivative_errors(nlp: &mut CollocationNlp, x: &[f64]) -> [f64; 3] {
    const H: f64 = 1e-6;
    let (n, m) = (x.len(), nlp.constraint_bounds().len());
    let multipliers = noise(7, m);
    let factor = 0.7;
    let jacobian_structure = nlp.jacobian_structure().to_vec();
    let hessian_structure = nlp.hessian_structure().to_vec();
    assert!(hessian_structure.iter().all(|(row, column)| column <= row));

    let mut gradient = vec![0.0; n];
    nlp.gradient(x, &mut gradient);
    let mut entries = vec![0.0; jacobian_structure.len()];
    nlp.jacobian(x, &mut entries);
    let jacobian = dense(&jacobian_structure, &entries, m, n);
    let mut entries = vec![0.0; hessian_structure.len()];
    nlp.hessian(x, factor, &multipliers, &mut entries);
    let mut hessian = dense(&hessian_structure, &entries, n, n);
    for row in 0..n {
        for column in 0..row {
            hessian[column * n + row] = hessian[row * n + column];
        }
    }

    let mut lagrangian_gradient = |x: &[f64]| {
        let mut gradient = vec![0.0; n];
        nlp.gradient(x, &mut gradient);
        gradient.iter_mut().for_each(|g| *g *= factor);
        let mut entries = vec![0.0; jacobian_structure.len()];
        nlp.jacobian(x, &mut entries);
        for (&(row, column), entry) in jacobian_structure.iter().zip(&entries) {
            gradient[column] += multipliers[row] * entry;
        }
        let mut g = vec![0.0; m];
        nlp.constraints(x, &mut g);
        (nlp.objective(x), g, gradient)
    };
    let mut errors = [0.0_f64; 3];
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let scales = [largest(&gradient), largest(&jacobian), largest(&hessian)];
    for column in 0..n {
        let shifted = |sign: f64| {
            let mut x = x.to_vec();
            x[column] += sign * H;
            x
        };
        let (f_up, g_up, l_up) = lagrangian_gradient(&shifted(1.0));
        let (f_down, g_down, l_down) = lagrangian_gradient(&shifted(-1.0));
        errors[0] =
            errors[0].max(((f_up - f_down) / (2.0 * H) - gradient[column]).abs() / scales[0]);
        for row in 0..m {
            let slope = (g_up[row] - g_down[row]) / (2.0 * H);
            errors[1] = errors[1].max((slope - jacobian[row * n + column]).abs() / scales[1]);
        }
        for row in 0..n {
            let slope = (l_up[row] - l_down[row]) / (2.0 * H);
            errors[2] = errors[2].max((slope - hessian[row * n + column]).abs() / scales[2]);
        }
    }
    errors
}

fn uneven_mesh() -> Mesh {
    Mesh::new(vec![
        Interval {
            fraction: 0.2,
            points: 3,
        },
        Interval {
            fraction: 0.5,
            points: 5,
        },
        Interval {
            fraction: 0.3,
            points: 2,
        },
    ])
}

/// With limits between the points on everything, and every other path function left out at the points.
fn assert_exact(problem: OptimalControlProblem, guess: &Guess, perturbation: f64) {
    let Sizes {
        states,
        controls,
        path,
        ..
    } = problem.sizes;
    let all = (0..states).map(Limited::State);
    let all = all.chain((0..controls).map(Limited::Control));
    let all = all.chain((0..path).map(Limited::Path));
    let all = all.chain((0..path).map(Limited::Slope));
    let samples: Vec<Sample> = all
        .enumerate()
        .map(|(index, limited)| Sample {
            interval: index % 3,
            local: 1.0 - 0.1 * index as f64 % 2.0,
            limited,
            bounds: Bounds::FREE,
        })
        .collect();
    let transcription = Transcription::new(Arc::new(problem), uneven_mesh(), guess)
        .with_path((0..path).step_by(2).collect())
        .with_samples(&samples);
    let transcription = Arc::new(transcription);
    let mut x = transcription.unknowns(guess);
    for (value, noise) in x.iter_mut().zip(noise(3, transcription.variables())) {
        *value += perturbation * noise;
    }
    let mut nlp = CollocationNlp::new(Arc::clone(&transcription), x.clone(), None);
    let errors = derivative_errors(&mut nlp, &x);
    assert!(errors.iter().all(|&e| e < 1e-7), "{errors:?}");
}

#[test]
fn derivatives_of_the_machines_are_exact() {
    for name in ["paper", "axis"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("moves/{name}.toml"));
        let mut file = MoveFile::read(path).expect("a move file");
        // With a knee below the largest speed the torque–speed rows are there on both machines.
        file.limits.torque_speed_knee_rpm = 4000.0;
        file.limits.torque_speed_slope_nm_per_rpm = 0.01;
        assert_exact(move_problem(&file), &quintic_guess(&file, 0.07), 0.05);
    }
}

/// Two scenarios, one of them with all limits, every kind of residual.
#[test]
fn derivatives_of_several_plants_are_exact() {
    let moves = [
        (
            "paper",
            "platform_mass_kg",
            "residual_strain = 1e-5\nresidual_displacement_m = 1e-6",
        ),
        (
            "axis",
            "stiffness_nm_per_rad",
            "residual_displacement_rad = 1e-4",
        ),
    ];
    for (name, parameter, residuals) in moves {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("moves/{name}.toml"));
        let text = std::fs::read_to_string(path).expect("a move file")
            + &format!(
                "\n[robust]\nparameter = \"{parameter}\"\nfactors = [0.8, 1.3]\nlimits = [1.3]\n{residuals}\n\
                 residual_energy_j = 1e-3\n"
            );
        let mut file = MoveFile::parse(&text, name).expect("a robust move");
        file.limits.torque_speed_knee_rpm = 4000.0;
        file.limits.torque_speed_slope_nm_per_rpm = 0.01;
        let robust = file.robust.clone().expect("a robust move");
        let problem = robust_problem(&file, &robust, None).expect("modes");
        assert_exact(problem, &quintic_guess(&file, 0.07), 0.05);
    }
}

/// ẋ = (x₁ u, sin x₀ + u²), L = u² + x₀ x₁, p = (x₀ x₁, x₀ + u), Φ = x₀(0) x₁(T) + T², e = x₀(T)² T.
struct General;
struct GeneralEnds;

impl Model for General {
    fn variables(&self) -> usize {
        3
    }
    fn values(&self) -> usize {
        5
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let (x0, x1, u) = (z[0], z[1], z[2]);
        out[0] = x1 * u;
        out[1] = x0.sin_cos().0 + u * u;
        out[2] = x0 * x1;
        out[3] = x0 + u;
        out[4] = u * u + x0 * x1;
    }
}

impl Model for GeneralEnds {
    fn variables(&self) -> usize {
        5
    }
    fn values(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[0] * z[3] + z[4] * z[4];
        out[1] = z[2] * z[2] * z[4];
    }
}

fn free(names: &[&str]) -> Vec<Quantity> {
    names
        .iter()
        .map(|&name| Quantity::new(name, Bounds::FREE))
        .collect()
}

#[test]
fn derivatives_of_a_general_problem_are_exact() {
    let problem = OptimalControlProblem {
        sizes: Sizes {
            states: 2,
            controls: 1,
            path: 2,
            endpoint: 1,
        },
        stage: Box::new(Exact::new(General)),
        endpoint: Box::new(Exact::new(GeneralEnds)),
        states: free(&["x0", "x1"]),
        controls: free(&["u"]),
        path: free(&["p0", "p1"]),
        rates: vec![],
        guards: vec![],
        ends: free(&["e"]),
        initial: vec![Bounds::FREE; 2],
        terminal: vec![Bounds::FREE; 2],
        duration_s: Bounds::new(0.1, 10.0),
    };
    let guess = Guess::line(1.3, vec![0.3, -0.4], vec![1.2, 0.8], vec![0.6]);
    assert_exact(problem, &guess, 0.1);
}

fn solve(problem: OptimalControlProblem, mesh: Mesh, guess: &Guess) -> (f64, Solution) {
    let (objective, solution, _) = solve_with_hamiltonian(problem, mesh, guess);
    (objective, solution)
}

fn solve_with_hamiltonian(
    problem: OptimalControlProblem,
    mesh: Mesh,
    guess: &Guess,
) -> (f64, Solution, Hamiltonian) {
    let transcription = Arc::new(Transcription::new(Arc::new(problem), mesh, guess));
    let start = transcription.unknowns(guess);
    let nlp = CollocationNlp::new(Arc::clone(&transcription), start, None);
    let settings = Settings {
        tolerance: 1e-10,
        max_iterations: 500,
        least_barrier: 0.0,
    };
    let outcome = Pounce.solve(Box::new(nlp), &settings, Box::new(|_| true));
    assert_eq!(outcome.status, Status::Solved);
    let objective = outcome.objective * transcription.scaling().objective;
    let hamiltonian = transcription.hamiltonian(&outcome);
    (objective, transcription.solution(&outcome.x), hamiltonian)
}

/// ẋ = v, v̇ = u, L = ½u².
struct BrysonDenham;
/// Φ = 0 or T.
struct Ends {
    states: usize,
    duration: bool,
}

impl Model for BrysonDenham {
    fn variables(&self) -> usize {
        3
    }
    fn values(&self) -> usize {
        3
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = z[1];
        out[1] = z[2];
        out[2] = z[2] * z[2] * 0.5;
    }
}

impl Model for Ends {
    fn variables(&self) -> usize {
        2 * self.states + 1
    }
    fn values(&self) -> usize {
        1
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        out[0] = if self.duration {
            z[2 * self.states]
        } else {
            S::constant(0.0)
        };
    }
}

#[test]
fn bryson_denham_with_its_state_constraint_costs_four() {
    let problem = OptimalControlProblem {
        sizes: Sizes {
            states: 2,
            controls: 1,
            path: 0,
            endpoint: 0,
        },
        stage: Box::new(Exact::new(BrysonDenham)),
        endpoint: Box::new(Exact::new(Ends {
            states: 2,
            duration: false,
        })),
        states: vec![
            Quantity::new("x", Bounds::new(f64::NEG_INFINITY, 1.0 / 9.0)),
            Quantity::new("v", Bounds::FREE),
        ],
        controls: free(&["u"]),
        path: vec![],
        rates: vec![],
        guards: vec![],
        ends: vec![],
        initial: vec![Bounds::fixed(0.0), Bounds::fixed(1.0)],
        terminal: vec![Bounds::fixed(0.0), Bounds::fixed(-1.0)],
        duration_s: Bounds::fixed(1.0),
    };
    // The boundary arc begins and ends at thirds; intervals of different degree meet there.
    let mesh = Mesh::new(vec![
        Interval {
            fraction: 1.0 / 3.0,
            points: 6,
        },
        Interval {
            fraction: 1.0 / 3.0,
            points: 4,
        },
        Interval {
            fraction: 1.0 / 3.0,
            points: 6,
        },
    ]);
    let guess = Guess::line(1.0, vec![0.0, 1.0], vec![0.0, -1.0], vec![-2.0]);
    let (cost, solution) = solve(problem, mesh, &guess);
    assert!((cost - 4.0).abs() < 1e-7, "{cost}");
    let top = solution.state_at_share(0.5)[0];
    assert!((top - 1.0 / 9.0).abs() < 1e-5, "{top}");
}

/// ẋ = v sin u, ẏ = v cos u, v̇ = g cos u.
struct Brachistochrone;

impl Model for Brachistochrone {
    fn variables(&self) -> usize {
        4
    }
    fn values(&self) -> usize {
        4
    }
    fn evaluate<S: Scalar>(&self, z: &[S], out: &mut [S]) {
        let (sin, cos) = z[3].sin_cos();
        out[0] = z[2] * sin;
        out[1] = z[2] * cos;
        out[2] = cos * 9.8;
        out[3] = S::constant(0.0);
    }
}

#[test]
fn brachistochrone_with_free_duration() {
    let problem = OptimalControlProblem {
        sizes: Sizes {
            states: 3,
            controls: 1,
            path: 0,
            endpoint: 0,
        },
        stage: Box::new(Exact::new(Brachistochrone)),
        endpoint: Box::new(Exact::new(Ends {
            states: 3,
            duration: true,
        })),
        states: free(&["x", "y", "v"]),
        controls: vec![Quantity::new("u", Bounds::new(-4.0, 4.0))],
        path: vec![],
        rates: vec![],
        guards: vec![],
        ends: vec![],
        initial: vec![Bounds::fixed(0.0); 3],
        terminal: vec![Bounds::fixed(2.0), Bounds::fixed(2.0), Bounds::FREE],
        duration_s: Bounds::new(0.1, 10.0),
    };
    let guess = Guess::line(1.0, vec![0.0; 3], vec![2.0, 2.0, 5.0], vec![0.8]);
    let (duration, _, h) = solve_with_hamiltonian(problem, Mesh::uniform(2, 12), &guess);
    assert!((duration - 0.824_759_143_156_6).abs() < 1e-9, "{duration}");
    // Of the fastest move it is −1 all along.
    assert!((h.mean + 1.0).abs() < 1e-9 && h.largest < 1e-6, "{h:?}");
}
