//! Proofs that a trajectory keeps every limit, on the f32 values that are shipped and everywhere between them.
//!
//! No sampling: polynomials are bounded in Bernstein form on pieces that are halved until the bound is close to a value that
//! is reached; elastic displacements, functions of polynomials, by enclosures of value and derivatives. Every rounding error of
//! the computation is part of the bound, and so is, as a figure of its own, what the executor's f32 makes of the polynomials.
//! docs/certificate.md says what is proved and what is not; on proofs between the points see also
//! arXiv 2403.07707.

mod axes;
mod bernstein;
mod certificate;
mod coordinates;
mod outputs;
mod peak;
mod plants;
mod playing;
mod table;
mod verify;

pub use certificate::{Certificate, IntervalPeak, Limited, Proof};
pub use coordinates::Coordinates;
pub use plants::{PlantError, PlantProofs, Simulated, certify_plants, left_after};
pub use table::{HEADINGS, PLANT_HEADINGS};
pub use verify::{VerifyError, verify, verify_move};

use crate::machine::Plant;
use crate::movefile::Limits;
use crate::simulate::trajectory::board_limits;
use bernstein::Pieces;
use stillpoint_shared::{LimitsError, Trajectory, TrajectoryError, hash};

/// Why there is nothing to certify.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CertifyError {
    /// The limits do not fit the board's numbers.
    #[error("the limits cannot be given to the board: {0}")]
    Limits(LimitsError),
    /// Trajectory and machine do not go together.
    #[error(
        "the trajectory has {trajectory} axes, the machine {machine}: give the move file that it was planned from"
    )]
    Axes {
        /// Axes of the trajectory.
        trajectory: usize,
        /// Axes of the machine.
        machine: usize,
    },
    /// Coordinates and machine do not go together.
    #[error(
        "{found} coordinates are stored, the machine has {machine}: give the move file that the trajectory was planned from"
    )]
    CoordinateCount {
        /// Coordinates stored.
        found: usize,
        /// Coordinates of the machine.
        machine: usize,
    },
    /// Coordinates and trajectory do not go together.
    #[error(
        "{found} values of the coordinates are stored, the trajectory's points ask for {expected}: plan the move again"
    )]
    Coordinates {
        /// Values stored.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// An interval has an impossible number of points.
    #[error("{0}")]
    Trajectory(TrajectoryError),
}

/// CRC-64/XZ over the postcard bytes of all limits: the axes' as the board knows them, then each output's, or none.
///
/// # Errors
/// [`LimitsError`] where a number does not fit f32.
pub fn limits_hash(limits: &Limits, plant: &dyn Plant) -> Result<u64, LimitsError> {
    let axes = board_limits(limits, plant)?;
    Ok(hash::of(&(&axes, &limits.outputs)))
}

/// Bounds every limit over every interval, for the plant that the trajectory was planned for; of others see [`certify_plants`].
///
/// The limits of the axes are those of the board, in f32. A limit that does not hold is no error: the certificate says so.
///
/// # Errors
/// [`CertifyError`] when the parts do not belong together.
pub fn certify(
    trajectory: &Trajectory,
    coordinates: &Coordinates,
    limits: &Limits,
    plant: &dyn Plant,
) -> Result<Certificate, CertifyError> {
    let board = board_limits(limits, plant).map_err(CertifyError::Limits)?;
    let machine = plant.axis_count();
    if trajectory.axes() != machine {
        return Err(CertifyError::Axes {
            trajectory: trajectory.axes(),
            machine,
        });
    }
    coordinates.check(trajectory, plant)?;
    let pieces = pieces_of(trajectory)?;
    let axes = board.axes().iter().enumerate();
    let mut proofs: Vec<Proof> = axes
        .flat_map(|(axis, limits)| axes::prove(trajectory, &pieces, axis, limits))
        .collect();
    let outputs = outputs::prove(trajectory, &pieces, coordinates, plant, &limits.outputs);
    proofs.extend(outputs);
    Ok(Certificate {
        tool: env!("CARGO_PKG_VERSION").to_owned(),
        trajectory_hash: trajectory.header().content_hash,
        limits_hash: limits_hash(limits, plant).map_err(CertifyError::Limits)?,
        proofs,
        plants: Vec::new(),
    })
}

/// What bounds polynomials on every number of points in use.
fn pieces_of(trajectory: &Trajectory) -> Result<Vec<Pieces>, CertifyError> {
    let mut pieces: Vec<Pieces> = Vec::new();
    for (interval, span) in trajectory.intervals().enumerate() {
        let points = span.points;
        if pieces.iter().all(|known| known.points() != points) {
            let new = Pieces::new(points);
            pieces.push(new.map_err(|_| {
                CertifyError::Trajectory(TrajectoryError::Points { interval, points })
            })?);
        }
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests;
