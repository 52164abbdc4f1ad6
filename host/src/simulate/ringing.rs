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

use super::modes::{ModesError, locked};
use crate::machine::{Equations, Plant};
use crate::movefile::Residual;
use crate::ocp::Affine;
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

/// What is bounded of a plant's vibration at the goal, as a function of its end state (q, v).
#[derive(Clone, Debug)]
pub struct Ringing {
    /// Key of the output, or `energy_j`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The bound.
    pub bound: f64,
    /// For each frequency two functions whose squares add up to the square of its amplitude; of the energy, to its part.
    pairs: Vec<Vec<Affine>>,
    /// Whether the squares are the energy itself.
    energy: bool,
}

/// What bounds on a plant's vibration at the goal come to.
///
/// # Errors
/// [`ModesError`] where the plant is singular at the goal.
pub fn ringing(
    plant: &dyn Plant,
    goal: &[f64],
    residuals: &[(Residual, f64)],
) -> Result<Vec<Ringing>, ModesError> {
    let rest = plant.rest(goal);
    let modes = end_modes(plant, &rest)?;
    let mut all = Vec::new();
    for &(residual, bound) in residuals {
        match residual {
            Residual::Energy => {
                let half = 0.5_f64.sqrt();
                let pairs = modes.iter().map(|mode| {
                    vec![
                        mode.position.scaled(half * mode.omega_rad_per_s),
                        mode.rate.scaled(half),
                    ]
                });
                all.push(Ringing {
                    name: "energy_j",
                    unit: "J",
                    bound,
                    pairs: pairs.collect(),
                    energy: true,
                });
            }
            Residual::Outputs(kind, unit) => {
                let slopes: Vec<Vec<f64>> = (modes.iter())
                    .map(|mode| plant.output_slopes(&rest, &mode.shape))
                    .collect();
                let outputs = plant.outputs().into_iter().enumerate();
                for (index, output) in outputs.filter(|(_, o)| o.kind == kind && o.unit == unit) {
                    let slopes: Vec<f64> = slopes.iter().map(|s| s[index]).collect();
                    all.push(Ringing {
                        name: output.key,
                        unit,
                        bound,
                        pairs: pairs(&modes, &slopes),
                        energy: false,
                    });
                }
            }
        }
    }
    Ok(all)
}

/// Pairs of functions for the amplitudes of an output with `slopes` along the modes, which rise in frequency.
fn pairs(modes: &[EndMode], slopes: &[f64]) -> Vec<Vec<Affine>> {
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
        position.into_iter().chain(rate).collect()
    });
    together.collect()
}

impl Ringing {
    /// Sum of the squares of each pair.
    fn squares(&self, end: &[f64]) -> impl Iterator<Item = f64> {
        let square = |f: &Affine| f.at(end).powi(2);
        self.pairs
            .iter()
            .map(move |pair| pair.iter().map(square).sum())
    }

    /// What the plant rings with at most after the end state (q, v): the sum of all amplitudes, or the energy.
    #[must_use]
    pub fn left(&self, end: &[f64]) -> f64 {
        if self.energy {
            self.squares(end).sum()
        } else {
            self.squares(end).map(f64::sqrt).sum()
        }
    }

    /// The bound on [`Self::sum_of_squares`].
    #[must_use]
    pub fn bound_of_squares(&self) -> f64 {
        if self.energy {
            self.bound
        } else {
            self.bound * self.bound
        }
    }

    /// The functions whose squares add up to what must not exceed [`Self::bound_of_squares`]: a bound on the square of the
    /// sum of all amplitudes, tight near the end state `near`, if one is given; or the energy.
    ///
    /// By Cauchy and Schwarz (Σ A_k)² ≤ Σ A_k²/w_k for all positive parts w_k with Σ w_k = 1, with equality where they are
    /// as the amplitudes A_k.
    #[must_use]
    pub fn sum_of_squares(&self, near: Option<&[f64]>) -> Vec<Affine> {
        if self.energy {
            return self.pairs.concat();
        }
        let sizes: Vec<f64> = near.map_or_else(
            || vec![1.0; self.pairs.len()],
            |end| self.squares(end).map(f64::sqrt).collect(),
        );
        let least = (LEAST_PART * sizes.iter().sum::<f64>()).max(f64::MIN_POSITIVE);
        let all: f64 = sizes.iter().map(|size| size + least).sum();
        let pairs = self.pairs.iter().zip(sizes);
        pairs
            .flat_map(|(pair, size)| {
                let factor = (all / (size + least)).sqrt();
                pair.iter().map(move |f| f.scaled(factor))
            })
            .collect()
    }
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
