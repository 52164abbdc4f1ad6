//! The lifted functions against finite differences, and the check against answers that are wrong.

use super::check::check;
use super::detect::{BangArc, Side};
use super::lift::{LiftedEnds, LiftedStage};
use super::{guess, lifted, merged};
use crate::autodiff::Scalar;
use crate::benchmarks::named;
use crate::nlp::{Pounce, Settings, Status};
use crate::ocp::{
    Answer, Bounds, Differentiable, Exact, Guess, Mesh, Model, OptimalControlProblem, Quantity,
    Sizes,
};
use std::sync::Arc;

/// ẋ = (x₁ u, sin x₀ + u²), p = (x₀ x₁, x₀ + u), L = u² x₀ + x₀ x₁.
struct General;
/// Φ = x₀(0) x₁(T) + T² x₁(0), e = x₀(T)² T.
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
        out[4] = u * u * x0 + x0 * x1;
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
        out[0] = z[0] * z[3] + z[4] * z[4] * z[1];
        out[1] = z[2] * z[2] * z[4];
    }
}

fn problem() -> Arc<OptimalControlProblem> {
    let free = |name: &str| Quantity::new(name, Bounds::FREE);
    Arc::new(OptimalControlProblem {
        sizes: Sizes {
            states: 2,
            controls: 1,
            path: 2,
            endpoint: 1,
        },
        stage: Box::new(Exact::new(General)),
        endpoint: Box::new(Exact::new(GeneralEnds)),
        states: vec![free("x0"), free("x1")],
        controls: vec![Quantity::new("u", Bounds::symmetric(1.0))],
        path: vec![free("p0"), free("p1")],
        ends: vec![free("e")],
        rates: vec![],
        guards: vec![],
        initial: vec![Bounds::FREE; 2],
        terminal: vec![Bounds::FREE; 2],
        duration_s: Bounds::new(0.1, 10.0),
    })
}

/// Jacobian and Hessian of `function` at a generic point against central differences.
fn assert_exact(function: &dyn Differentiable, variables: usize, values: usize) {
    const H: f64 = 1e-6;
    let z: Vec<f64> = (0..variables)
        .map(|i| 0.4 + 0.37 * (i as f64 * 1.7).sin())
        .collect();
    let weights: Vec<f64> = (0..values).map(|i| 1.0 + 0.3 * i as f64).collect();
    let structure = function.structure();
    let jacobian = |z: &[f64]| {
        let (mut out, mut entries) = (vec![0.0; values], vec![0.0; structure.jacobian.len()]);
        function.jacobian(z, &mut out, &mut entries);
        let mut dense = vec![0.0; values * variables];
        for (entry, &(row, column)) in entries.iter().zip(&structure.jacobian) {
            dense[row * variables + column] += entry;
        }
        (out, dense)
    };
    let (at, dense) = jacobian(&z);
    let mut plain = vec![0.0; values];
    function.values(&z, &mut plain);
    assert_eq!(at, plain);
    let mut entries = vec![0.0; structure.hessian.len()];
    function.hessian(&z, &weights, &mut entries);
    let mut hessian = vec![0.0; variables * variables];
    for (entry, &(row, column)) in entries.iter().zip(&structure.hessian) {
        assert!(column <= row);
        hessian[row * variables + column] += entry;
    }
    for column in 0..variables {
        let shifted = |by: f64| {
            let mut z = z.clone();
            z[column] += by;
            jacobian(&z)
        };
        let ((up, d_up), (down, d_down)) = (shifted(H), shifted(-H));
        for row in 0..values {
            let slope = (up[row] - down[row]) / (2.0 * H);
            let exact = dense[row * variables + column];
            assert!(
                (slope - exact).abs() < 1e-7,
                "({row}, {column}): {exact} {slope}"
            );
        }
        for row in column..variables {
            let slope: f64 = (weights.iter().enumerate())
                .map(|(value, weight)| {
                    let entry = value * variables + row;
                    weight * (d_up[entry] - d_down[entry]) / (2.0 * H)
                })
                .sum();
            let exact = hessian[row * variables + column];
            assert!(
                (slope - exact).abs() < 1e-6,
                "({row}, {column}): {exact} {slope}"
            );
        }
    }
}

#[test]
fn lifted_functions_have_exact_derivatives() {
    for arcs in [1, 3] {
        let controls = (0..arcs)
            .map(|arc| vec![if arc == 1 { -1.0 } else { 1.0 }])
            .collect();
        assert_exact(
            &LiftedStage::new(problem(), controls),
            3 * arcs,
            5 * arcs + 1,
        );
        let ends = LiftedEnds::new(problem(), arcs);
        assert_exact(&ends, 6 * arcs + 1, 2 + 2 * (arcs - 1) + 1);
    }
}

fn arc(duration_s: f64, sides: &[Side]) -> BangArc {
    BangArc {
        duration_s,
        sides: sides.to_vec(),
    }
}

#[test]
fn arcs_of_no_length_are_dropped() {
    use Side::{Lower, Upper};
    let arcs = vec![
        arc(1.0, &[Upper, Lower]),
        arc(1e-9, &[Lower, Lower]),
        arc(0.5, &[Upper, Lower]),
        arc(0.25, &[Upper, Upper]),
        arc(1e-9, &[Lower, Upper]),
    ];
    let kept = merged(arcs, 1e-6);
    assert_eq!(
        kept,
        [arc(1.5, &[Upper, Lower]), arc(0.25, &[Upper, Upper])]
    );
}

/// The triple integrator's three arcs are an extremal; claimed to be those of the opposite push, they have the wrong signs.
#[test]
fn the_check_sees_wrong_signs_and_bounds() {
    use Side::{Lower, Upper};
    let benchmark = named("triple-integrator").expect("one of the ten");
    let mut problem = benchmark.problem;
    let arcs = [arc(0.8, &[Upper]), arc(1.6, &[Lower]), arc(0.8, &[Upper])];
    let settings = Settings {
        tolerance: 1e-11,
        max_iterations: 100,
        least_barrier: 0.0,
    };
    let near = Answer::of(
        &Arc::new(named("triple-integrator").expect("one of the ten").problem),
        Mesh::uniform(6, 3),
        &Guess::line(5.0, vec![0.0; 3], vec![1.0, 0.0, 0.0], vec![0.0]),
        &Pounce,
        &settings,
        Box::new(|_| true),
    );
    let shared = Arc::new(named("triple-integrator").expect("one of the ten").problem);
    let answer = Answer::of(
        &Arc::new(lifted(&shared, &arcs, &near.solution)),
        Mesh::uniform(1, 6),
        &guess(&arcs, &near.solution),
        &Pounce,
        &settings,
        Box::new(|_| true),
    );
    assert_eq!(answer.status, Status::Solved);
    assert!(check(&problem, &arcs, &answer).within(1e-9));

    let flipped = [arc(0.8, &[Lower]), arc(1.6, &[Upper]), arc(0.8, &[Lower])];
    let wrong = check(&problem, &flipped, &answer);
    assert!(wrong.switching > 0.99, "{wrong:?}");

    // The speed reaches J (T/4)²: a bound below it is exceeded, by a tenth of the speed.
    let peak = (32.0_f64.cbrt() / 4.0).powi(2);
    problem.states[1].bounds = Bounds::new(0.0, 0.9 * peak);
    let beyond = check(&problem, &arcs, &answer);
    assert!((beyond.bounds - 0.1).abs() < 1e-6, "{beyond:?}");
}
