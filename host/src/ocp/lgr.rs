//! The collocation rule of one interval, from `shared::basis`, as matrices for the planner.

use nalgebra::DMatrix;
use stillpoint_shared::lgr;

/// Legendre–Gauss–Radau rule of N points on [−1, 1): Garg et al., "A unified framework for the numerical solution of
/// optimal control problems using pseudospectral methods", Automatica 46 (2010).
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Support points of the states: the N collocation points and +1, length N + 1.
    pub support: Vec<f64>,
    /// Quadrature weights at the collocation points, length N.
    pub weights: Vec<f64>,
    /// Barycentric weights of the support points, length N + 1.
    pub barycentric: Vec<f64>,
    /// Barycentric weights of the N collocation points alone: the control lives on these.
    pub control_barycentric: Vec<f64>,
    /// D, N × (N + 1): derivative at the collocation points from values at the support points.
    pub differentiation: DMatrix<f64>,
}

impl Rule {
    /// The rule of `points` ≥ 2 points.
    ///
    /// # Errors
    /// Fewer than two points.
    pub fn new(points: usize) -> Result<Self, lgr::LgrError> {
        let mut support = vec![0.0; points + 1];
        lgr::support_nodes(&mut support)?;
        let mut weights = vec![0.0; points];
        lgr::lgr_weights(&support[..points], &mut weights)?;
        let mut barycentric = vec![0.0; points + 1];
        lgr::barycentric_weights(&support, &mut barycentric)?;
        let mut control_barycentric = vec![0.0; points];
        lgr::barycentric_weights(&support[..points], &mut control_barycentric)?;
        let mut differentiation = DMatrix::zeros(points, points + 1);
        let mut row = vec![0.0; points + 1];
        for i in 0..points {
            lgr::differentiation_row(&support, &barycentric, i, &mut row)?;
            differentiation.row_mut(i).copy_from_slice(&row);
        }
        Ok(Self {
            support,
            weights,
            barycentric,
            control_barycentric,
            differentiation,
        })
    }

    /// Number N of collocation points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.weights.len()
    }
}

/// Lagrange interpolation in the second barycentric form: fills `basis[j]` = ℓⱼ(x) for the given nodes and weights.
pub fn lagrange_basis(nodes: &[f64], barycentric: &[f64], x: f64, basis: &mut [f64]) {
    if let Some(hit) = nodes.iter().position(|&node| node == x) {
        basis.fill(0.0);
        basis[hit] = 1.0;
        return;
    }
    let mut sum = 0.0;
    for ((slot, node), weight) in basis.iter_mut().zip(nodes).zip(barycentric) {
        *slot = weight / (x - node);
        sum += *slot;
    }
    for slot in basis {
        *slot /= sum;
    }
}
