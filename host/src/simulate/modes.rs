//! Natural frequencies with the motors locked: what a machine rings with after a move.
//!
//! Motions with locked motors are q̇ in the null space of J. With Z a basis of it, the frequencies are those of
//! ZᵀKZ s = ω² ZᵀMZ s.

use crate::machine::{Equations, Plant};
use nalgebra::{Cholesky, DMatrix};
use std::f64::consts::TAU;

/// One mode of vibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency.
    pub frequency_hz: f64,
    /// Amplitudes of the coordinates for unit modal mass.
    pub shape: Vec<f64>,
}

/// Why there are no modes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// M or J is singular or undefined.
    #[error(
        "the machine has no modes of vibration at this pose: it is singular there or cannot be assembled"
    )]
    Singular,
}

/// Modes with locked motors about the undeformed machine at `q`, by rising frequency.
///
/// # Errors
/// [`ModesError`] at a singular pose.
pub fn locked(plant: &dyn Plant, q: &[f64]) -> Result<Vec<Mode>, ModesError> {
    let (n, axes) = (plant.coordinate_count(), plant.axis_count());
    let mut equations = Equations::new(plant);
    plant.equations(q, &vec![0.0; n], &mut equations);
    // In units of the coordinates' magnitudes: metres and curvatures become comparable.
    let magnitudes = plant.coordinates().into_iter().map(|c| c.magnitude);
    let scale = DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(n, magnitudes));
    let mass = &scale * DMatrix::from_row_slice(n, n, &equations.mass_matrix) * &scale;
    let stiffness = &scale * plant.stiffness(q) * &scale;
    let jacobian = DMatrix::from_row_slice(axes, n, &equations.joint_jacobian) * &scale;
    if [&mass, &stiffness, &jacobian]
        .iter()
        .any(|m| m.iter().any(|x| !x.is_finite()))
    {
        return Err(ModesError::Singular);
    }

    // Projector on the null space: its eigenvalues are 0 and 1.
    let gram = Cholesky::new(&jacobian * jacobian.transpose()).ok_or(ModesError::Singular)?;
    let projector = DMatrix::identity(n, n) - jacobian.transpose() * gram.solve(&jacobian);
    let split = projector.symmetric_eigen();
    let null: Vec<_> = (0..n)
        .filter(|&k| split.eigenvalues[k] > 0.5)
        .map(|k| split.eigenvectors.column(k))
        .collect();
    if null.is_empty() {
        return Ok(Vec::new());
    }
    let basis = DMatrix::from_columns(&null);

    let reduced_mass = Cholesky::new(basis.tr_mul(&mass) * &basis).ok_or(ModesError::Singular)?;
    let inverse = reduced_mass.l().try_inverse().ok_or(ModesError::Singular)?;
    let reduced = &inverse * (basis.tr_mul(&stiffness) * &basis) * inverse.transpose();
    let eigen = reduced.symmetric_eigen();
    let shapes = &scale * basis * inverse.transpose() * &eigen.eigenvectors;
    let mut modes: Vec<Mode> = (0..null.len())
        .map(|k| Mode {
            frequency_hz: eigen.eigenvalues[k].max(0.0).sqrt() / TAU,
            shape: shapes.column(k).iter().copied().collect(),
        })
        .collect();
    modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    Ok(modes)
}

/// The different frequencies among modes, rising; those within a hundredth count as one, with the lowest's value.
#[must_use]
pub fn distinct_hz(modes: &[Mode]) -> Vec<f64> {
    let mut distinct: Vec<f64> = Vec::new();
    for frequency_hz in modes.iter().map(|m| m.frequency_hz).filter(|f| *f > 0.0) {
        if distinct
            .last()
            .is_none_or(|last| frequency_hz > 1.01 * last)
        {
            distinct.push(frequency_hz);
        }
    }
    distinct
}
