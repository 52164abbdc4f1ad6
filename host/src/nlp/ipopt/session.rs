//! One solve as the callbacks see it: the problem, checked and in the solver's integers.

use crate::nlp::{Monitor, NlpProblem};
use ipopt_sys::CNLP_Index as Index;

/// What the callbacks work on.
pub(super) struct Session {
    pub(super) problem: Box<dyn NlpProblem>,
    pub(super) monitor: Monitor,
    pub(super) variables: Index,
    pub(super) constraints: Index,
    pub(super) jacobian: Entries,
    pub(super) hessian: Entries,
    /// Last accepted iterate.
    pub(super) x: Vec<f64>,
    pub(super) iterations: usize,
    pub(super) panicked: bool,
}

/// A structure in the solver's integers.
pub(super) struct Entries {
    pub(super) rows: Vec<Index>,
    pub(super) columns: Vec<Index>,
    pub(super) count: Index,
}

impl Session {
    /// `None` if a size does not fit the solver's integers or the problem contradicts itself.
    pub(super) fn new(problem: Box<dyn NlpProblem>, monitor: Monitor) -> Option<Self> {
        let (n, m) = (
            problem.variable_bounds().len(),
            problem.constraint_bounds().len(),
        );
        let start = problem.start();
        let warm_fits = start.warm.as_ref().is_none_or(|warm| {
            (warm.constraints.len(), warm.lower.len(), warm.upper.len()) == (m, n, n)
        });
        if start.x.len() != n || !warm_fits {
            return None;
        }
        Some(Self {
            variables: Index::try_from(n).ok()?,
            constraints: Index::try_from(m).ok()?,
            jacobian: Entries::new(problem.jacobian_structure(), m, n)?,
            hessian: Entries::new(problem.hessian_structure(), n, n)?,
            x: start.x.clone(),
            problem,
            monitor,
            iterations: 0,
            panicked: false,
        })
    }
}

impl Entries {
    fn new(structure: &[(usize, usize)], height: usize, width: usize) -> Option<Self> {
        let inside = |&(row, column): &(usize, usize)| {
            let inside = row < height && column < width;
            inside.then_some((Index::try_from(row).ok()?, Index::try_from(column).ok()?))
        };
        let (rows, columns) = structure
            .iter()
            .map(inside)
            .collect::<Option<Vec<_>>>()?
            .into_iter()
            .unzip();
        let count = Index::try_from(structure.len()).ok()?;
        Some(Self {
            rows,
            columns,
            count,
        })
    }
}
