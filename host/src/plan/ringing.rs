//! What a plant rings with after a move: bounds on the free vibration that its state at the end leads to.
//!
//! At the end the joints are still, so what follows is the vibration with locked motors. About the undeformed machine at
//! the goal it is a sum of modes η_k(t) of unit modal mass and frequency ω_k, each of the amplitude √(η² + (η̇/ω)²) of the
//! end. An output with the slopes c_k along the modes then never exceeds
//!
//! ```text
//! Σ_k √((c_k η_k)² + (c_k η̇_k/ω_k)²),    η = φᵀM (q − q_goal),  η̇ = φᵀM v
//! ```
//!
//! whatever the phases; modes of the same frequency swing together and are added up before the root. Damping only makes
//! it less as long as it does not couple modes; the energy ½ Σ (η̇² + ω²η²) never grows with any damping.

use crate::machine::{Equations, Plant};
use crate::movefile::Residual;
use crate::ocp::{Affine, Bounds, Quantity};
use crate::simulate::modes::{ModesError, locked};
use std::f64::consts::TAU;

/// Frequencies that differ by a smaller share than this are the same: their modes drift apart by less over a
/// thousand periods than can be seen.
const SAME_FREQUENCY: f64 = 1e-5;

/// Least part that a mode is given of a bound.
const LEAST_PART: f64 = 0.005;

/// A mode at the goal as functions of the end state (q, v).
struct EndMode {
    omega_rad_per_s: f64,
    shape: Vec<f64>,
    /// η and η̇.
    position: Affine,
    rate: Affine,
}

/// Rows that bound what a plant rings with at the goal: functions of its end state (q, v), with names and bounds. They are
/// tight near an end state, if one is given.
pub(super) fn rows(
    plant: &dyn Plant,
    goal: &[f64],
    residuals: &[(Residual, f64)],
    near: Option<&[f64]>,
) -> Result<Vec<(Quantity, Vec<Affine>)>, ModesError> {
    let rest = plant.rest(goal);
    let modes = end_modes(plant, &rest)?;
    let mut rows = Vec::new();
    for &(residual, bound) in residuals {
        match residual {
            Residual::Energy => {
                let half = 0.5_f64.sqrt();
                let functions = modes.iter().flat_map(|mode| {
                    [
                        mode.position.scaled(half * mode.omega_rad_per_s),
                        mode.rate.scaled(half),
                    ]
                });
                rows.push((quantity("energy (J)", bound), functions.collect()));
            }
            Residual::Outputs(kind, unit) => {
                let slopes: Vec<Vec<f64>> = (modes.iter())
                    .map(|mode| plant.output_slopes(&rest, &mode.shape))
                    .collect();
                let outputs = plant.outputs().into_iter().enumerate();
                for (index, output) in outputs.filter(|(_, o)| o.kind == kind && o.unit == unit) {
                    let slopes: Vec<f64> = slopes.iter().map(|s| s[index]).collect();
                    rows.push((
                        quantity(output.key, bound * bound),
                        amplitude(&modes, &slopes, near),
                    ));
                }
            }
        }
    }
    Ok(rows)
}

fn quantity(name: &str, bound: f64) -> Quantity {
    Quantity {
        name: name.to_owned(),
        magnitude: Some(bound),
        bounds: Bounds::new(f64::NEG_INFINITY, bound),
    }
}

/// The functions whose squares add up to a bound on the square of an output's amplitude; `slopes` along the modes, which
/// rise in frequency.
///
/// By Cauchy and Schwarz (Σ A_k)² ≤ Σ A_k²/w_k for all positive parts w_k with Σ w_k = 1, with equality where they are
/// as the amplitudes A_k.
fn amplitude(modes: &[EndMode], slopes: &[f64], near: Option<&[f64]>) -> Vec<Affine> {
    let same = |a: &(&EndMode, &f64), b: &(&EndMode, &f64)| {
        b.0.omega_rad_per_s - a.0.omega_rad_per_s <= SAME_FREQUENCY * b.0.omega_rad_per_s
    };
    let modes: Vec<_> = modes.iter().zip(slopes).collect();
    let together = modes.chunk_by(same).map(|group| {
        let sum = |part: &dyn Fn(&EndMode, f64) -> Affine| {
            let parts = group.iter().map(|(mode, slope)| part(mode, **slope));
            parts.reduce(|a, b| a.plus(&b))
        };
        let position = sum(&|mode, slope| mode.position.scaled(slope));
        let rate = sum(&|mode, slope| mode.rate.scaled(slope / mode.omega_rad_per_s));
        position.into_iter().chain(rate).collect::<Vec<_>>()
    });
    let together: Vec<Vec<Affine>> = together.collect();
    let size = |pair: &Vec<Affine>| {
        let squares = near.map(|end| pair.iter().map(|f| f.at(end).powi(2)).sum::<f64>());
        squares.map_or(1.0, f64::sqrt)
    };
    let sizes: Vec<f64> = together.iter().map(size).collect();
    let least = (LEAST_PART * sizes.iter().sum::<f64>()).max(f64::MIN_POSITIVE);
    let all: f64 = sizes.iter().map(|size| size + least).sum();
    let pairs = together.iter().zip(sizes);
    pairs
        .flat_map(|(pair, size)| {
            let factor = (all / (size + least)).sqrt();
            pair.iter().map(move |f| f.scaled(factor))
        })
        .collect()
}

fn end_modes(plant: &dyn Plant, rest: &[f64]) -> Result<Vec<EndMode>, ModesError> {
    let n = plant.coordinate_count();
    let mut equations = Equations::new(plant);
    plant.equations(rest, &vec![0.0; n], &mut equations);
    let modes = locked(plant, rest)?.into_iter().map(|mode| {
        // Mφ: M is symmetric, so its rows are its columns.
        let rows = equations.mass_matrix.chunks_exact(n);
        let momentum: Vec<f64> = rows
            .map(|row| row.iter().zip(&mode.shape).map(|(m, s)| m * s).sum())
            .collect();
        let at_rest: f64 = momentum.iter().zip(rest).map(|(p, q)| p * q).sum();
        let none = vec![0.0; n];
        EndMode {
            omega_rad_per_s: TAU * mode.frequency_hz,
            shape: mode.shape,
            position: Affine {
                constant: -at_rest,
                gradient: [momentum.as_slice(), &none].concat(),
            },
            rate: Affine {
                constant: 0.0,
                gradient: [none.as_slice(), &momentum].concat(),
            },
        }
    });
    Ok(modes.collect())
}
