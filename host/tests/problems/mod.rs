//! Small nonlinear programs, and what can go wrong with one.

use stillpoint::autodiff::Scalar;
use stillpoint::nlp::{Multipliers, NlpProblem, Start};
use stillpoint::ocp::{Bounds, Differentiable, Exact, Model};

/// A small program: value 0 of the function is the objective, the others are the constraints.
pub(crate) struct Small {
    function: Box<dyn Differentiable>,
    variable_bounds: Vec<Bounds>,
    constraint_bounds: Vec<Bounds>,
    jacobian_structure: Vec<(usize, usize)>,
    start: Start,
}

impl Small {
    pub(crate) fn new(
        model: impl Model + 'static,
        variable_bounds: Vec<Bounds>,
        constraint_bounds: Vec<Bounds>,
        x: Vec<f64>,
    ) -> Self {
        let function = Box::new(Exact::new(model));
        let structure = function.structure().jacobian.iter();
        Self {
            jacobian_structure: structure
                .filter(|(row, _)| *row > 0)
                .map(|&(row, column)| (row - 1, column))
                .collect(),
            function,
            variable_bounds,
            constraint_bounds,
            start: Start { x, warm: None },
        }
    }

    /// The same program, started from elsewhere.
    pub(crate) fn started_from(self, x: Vec<f64>, warm: Option<Multipliers>) -> Self {
        let start = Start { x, warm };
        Self { start, ..self }
    }

    fn values(&self, x: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.constraint_bounds.len() + 1];
        self.function.values(x, &mut values);
        values
    }

    fn entries(&self, x: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.constraint_bounds.len() + 1];
        let mut entries = vec![0.0; self.function.structure().jacobian.len()];
        self.function.jacobian(x, &mut values, &mut entries);
        entries
    }
}

impl NlpProblem for Small {
    fn variable_bounds(&self) -> &[Bounds] {
        &self.variable_bounds
    }
    fn constraint_bounds(&self) -> &[Bounds] {
        &self.constraint_bounds
    }
    fn jacobian_structure(&self) -> &[(usize, usize)] {
        &self.jacobian_structure
    }
    fn hessian_structure(&self) -> &[(usize, usize)] {
        &self.function.structure().hessian
    }
    fn start(&self) -> &Start {
        &self.start
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.values(x)[0]
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        let structure = &self.function.structure().jacobian;
        for (entry, &(row, column)) in self.entries(x).iter().zip(structure) {
            if row == 0 {
                gradient[column] = *entry;
            }
        }
    }
    fn constraints(&mut self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&self.values(x)[1..]);
    }
    fn jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        let all = self.entries(x);
        let structure = &self.function.structure().jacobian;
        let constraints = all.iter().zip(structure).filter(|(_, (row, _))| *row > 0);
        for (slot, (entry, _)) in entries.iter_mut().zip(constraints) {
            *slot = *entry;
        }
    }
    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        entries: &mut [f64],
    ) {
        let weights: Vec<f64> = [objective_factor]
            .iter()
            .chain(multipliers)
            .copied()
            .collect();
        self.function.hessian(x, &weights, entries);
    }
}

/// Number 71 of Hock and Schittkowski: 17.0140173 at (1, 4.7429994, 3.8211503, 1.3794082).
pub(crate) fn hs071() -> Small {
    struct Hs071;
    impl Model for Hs071 {
        fn variables(&self) -> usize {
            4
        }
        fn values(&self) -> usize {
            3
        }
        fn evaluate<S: Scalar>(&self, x: &[S], out: &mut [S]) {
            out[0] = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
            out[1] = x[0] * x[1] * x[2] * x[3];
            out[2] = x[0].square() + x[1].square() + x[2].square() + x[3].square();
        }
    }
    Small::new(
        Hs071,
        vec![Bounds::new(1.0, 5.0); 4],
        vec![Bounds::new(25.0, f64::INFINITY), Bounds::fixed(40.0)],
        vec![1.0, 5.0, 5.0, 1.0],
    )
}

/// A point in two discs that do not meet: violated least at the origin, by 3 each.
pub(crate) fn two_discs() -> Small {
    struct TwoDiscs;
    impl Model for TwoDiscs {
        fn variables(&self) -> usize {
            2
        }
        fn values(&self) -> usize {
            3
        }
        fn evaluate<S: Scalar>(&self, x: &[S], out: &mut [S]) {
            out[0] = x[0] + x[1];
            out[1] = (x[0] - 2.0).square() + x[1].square();
            out[2] = (x[0] + 2.0).square() + x[1].square();
        }
    }
    Small::new(
        TwoDiscs,
        vec![Bounds::new(-10.0, 10.0); 2],
        vec![Bounds::new(f64::NEG_INFINITY, 1.0); 2],
        vec![0.3, 0.2],
    )
}

/// A square root that starts, and remains, outside its domain.
pub(crate) fn not_a_number() -> Small {
    struct Root;
    impl Model for Root {
        fn variables(&self) -> usize {
            2
        }
        fn values(&self) -> usize {
            2
        }
        fn evaluate<S: Scalar>(&self, x: &[S], out: &mut [S]) {
            out[0] = x[0].sqrt() + x[1].square();
            out[1] = x[0] * x[1];
        }
    }
    Small::new(
        Root,
        vec![Bounds::FREE; 2],
        vec![Bounds::new(-1.0, 1.0)],
        vec![-1.0, 0.5],
    )
}

/// Number 71 with a fault of its own.
#[cfg(feature = "ipopt")]
pub(crate) struct Faulty {
    pub(crate) inner: Small,
    pub(crate) jacobian_structure: Vec<(usize, usize)>,
    /// Jacobian evaluations until it panics.
    pub(crate) until_panic: usize,
}

#[cfg(feature = "ipopt")]
impl Faulty {
    pub(crate) fn new(until_panic: usize) -> Self {
        let inner = hs071();
        Self {
            jacobian_structure: inner.jacobian_structure.clone(),
            inner,
            until_panic,
        }
    }
}

#[cfg(feature = "ipopt")]
impl NlpProblem for Faulty {
    fn variable_bounds(&self) -> &[Bounds] {
        self.inner.variable_bounds()
    }
    fn constraint_bounds(&self) -> &[Bounds] {
        self.inner.constraint_bounds()
    }
    fn jacobian_structure(&self) -> &[(usize, usize)] {
        &self.jacobian_structure
    }
    fn hessian_structure(&self) -> &[(usize, usize)] {
        self.inner.hessian_structure()
    }
    fn start(&self) -> &Start {
        self.inner.start()
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.inner.objective(x)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.inner.gradient(x, gradient);
    }
    fn constraints(&mut self, x: &[f64], values: &mut [f64]) {
        self.inner.constraints(x, values);
    }
    fn jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        assert!(self.until_panic > 0, "this test's own panic");
        self.until_panic -= 1;
        self.inner.jacobian(x, entries);
    }
    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        entries: &mut [f64],
    ) {
        self.inner
            .hessian(x, objective_factor, multipliers, entries);
    }
}
