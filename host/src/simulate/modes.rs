//! Natural frequencies with the motors locked: what a machine rings with after a move.
//!
//! Motions with locked motors are q̇ in the null space of J. With Z a basis of it, the frequencies are those of
//! ZᵀKZ s = ω² ZᵀMZ s.

use crate::machine::{Equations, Plant};
use nalgebra::{Cholesky, DMatrix, DVector};
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
    let matrices = Matrices::at(plant, q)?;
    let j = &matrices.jacobian;
    let n = plant.coordinate_count();
    // Projector on the null space of J: its eigenvalues are 0 and 1.
    let gram = Cholesky::new(j * j.transpose()).ok_or(ModesError::Singular)?;
    let projector = DMatrix::identity(n, n) - j.transpose() * gram.solve(j);
    let split = projector.symmetric_eigen();
    let null: Vec<_> = (0..n)
        .filter(|&k| split.eigenvalues[k] > 0.5)
        .map(|k| split.eigenvectors.column(k))
        .collect();
    if null.is_empty() {
        return Ok(Vec::new());
    }
    matrices.modes(&DMatrix::from_columns(&null))
}

/// Modes with motors that nothing holds, about the undeformed machine at `q`, by rising frequency; those that move it as
/// a whole come first, with 0 Hz.
///
/// # Errors
/// [`ModesError`] at a singular pose.
pub fn free(plant: &dyn Plant, q: &[f64]) -> Result<Vec<Mode>, ModesError> {
    let n = plant.coordinate_count();
    Matrices::at(plant, q)?.modes(&DMatrix::identity(n, n))
}

/// Vibrations slower than this, three hours for one, are none: what they would bring back is adrift.
const ADRIFT_HZ: f64 = 1e-4;

/// Frequency (Hz) of a motion of the undeformed machine at `q` on which no motor acts, if there is one; 0 for one that is
/// adrift. Such a motion can be neither begun nor ended.
///
/// Popov's, Belevitch's and Hautus's test for M q̈ + K q = Jᵀ τ: the modes of one frequency are controlled when J tells them
/// apart.
///
/// # Errors
/// [`ModesError`] at a singular pose.
pub fn undriven_hz(plant: &dyn Plant, q: &[f64]) -> Result<Option<f64>, ModesError> {
    let (n, axes) = (plant.coordinate_count(), plant.axis_count());
    let mut equations = Equations::new(plant);
    plant.equations(q, &vec![0.0; n], &mut equations);
    let jacobian = DMatrix::from_row_slice(axes, n, &equations.joint_jacobian);
    let modes = free(plant, q)?;
    let seen = |mode: &Mode| &jacobian * DVector::from_column_slice(&mode.shape);
    let seen: Vec<DVector<f64>> = modes.iter().map(seen).collect();
    let most = seen
        .iter()
        .fold(0.0_f64, |most, motors| most.max(motors.norm()));
    let alike = |a: &Mode, b: &Mode| {
        b.frequency_hz < ADRIFT_HZ || b.frequency_hz - a.frequency_hz < 1e-9 * b.frequency_hz
    };
    let mut first = 0;
    for group in modes.chunk_by(alike) {
        let motors = DMatrix::from_columns(&seen[first..first + group.len()]);
        first += group.len();
        let told_apart = motors.rank(1e-9 * most);
        if told_apart < group.len() {
            let hz = group.last().map_or(0.0, |mode| mode.frequency_hz);
            return Ok(Some(if hz < ADRIFT_HZ { 0.0 } else { hz }));
        }
    }
    Ok(None)
}

/// M, K and J in units of the coordinates' magnitudes: metres and curvatures become comparable.
struct Matrices {
    scale: DMatrix<f64>,
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    jacobian: DMatrix<f64>,
}

impl Matrices {
    fn at(plant: &dyn Plant, q: &[f64]) -> Result<Self, ModesError> {
        let (n, axes) = (plant.coordinate_count(), plant.axis_count());
        let mut equations = Equations::new(plant);
        plant.equations(q, &vec![0.0; n], &mut equations);
        let magnitudes = plant.coordinates().into_iter().map(|c| c.magnitude);
        let scale = DMatrix::from_diagonal(&DVector::from_iterator(n, magnitudes));
        let matrices = Self {
            mass: &scale * DMatrix::from_row_slice(n, n, &equations.mass_matrix) * &scale,
            stiffness: &scale * plant.stiffness(q) * &scale,
            jacobian: DMatrix::from_row_slice(axes, n, &equations.joint_jacobian) * &scale,
            scale,
        };
        let all = [&matrices.mass, &matrices.stiffness, &matrices.jacobian];
        let finite = all.iter().all(|m| m.iter().all(|x| x.is_finite()));
        finite.then_some(matrices).ok_or(ModesError::Singular)
    }

    /// Modes within the span of a basis.
    fn modes(&self, basis: &DMatrix<f64>) -> Result<Vec<Mode>, ModesError> {
        let mass = Cholesky::new(basis.tr_mul(&self.mass) * basis).ok_or(ModesError::Singular)?;
        let inverse = mass.l().try_inverse().ok_or(ModesError::Singular)?;
        let stiffness = basis.tr_mul(&self.stiffness) * basis;
        let eigen = (&inverse * stiffness * inverse.transpose()).symmetric_eigen();
        let shapes = &self.scale * basis * inverse.transpose() * &eigen.eigenvectors;
        let mut modes: Vec<Mode> = (0..basis.ncols())
            .map(|k| Mode {
                frequency_hz: eigen.eigenvalues[k].max(0.0).sqrt() / TAU,
                shape: shapes.column(k).iter().copied().collect(),
            })
            .collect();
        modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        Ok(modes)
    }
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
