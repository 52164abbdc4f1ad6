//! The artefact itself: what is shipped, decoded and played by the executor on the simulated drives of the move file.

use crate::movefile::MoveFile;
use crate::simulate::{ClosedLoop, ClosedLoopError, Metrics};
use stillpoint_shared::trajectory::MAX_ENCODED_BYTES;
use stillpoint_shared::{Trajectory, TrajectoryError};

/// Why the artefact was not played to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlayedError {
    /// What was encoded does not decode.
    #[error("it cannot be read back: {0}")]
    Trajectory(#[from] TrajectoryError),
    /// The executor or the drives stopped.
    #[error(transparent)]
    ClosedLoop(#[from] ClosedLoopError),
}

/// What the machine did.
#[derive(Clone, Debug, PartialEq)]
pub struct Played {
    /// The pose coordinate that is farthest from its target when the move ends, in units of its typical magnitude: name with unit.
    pub coordinate: &'static str,
    /// Its distance from the target, in its own unit.
    pub miss: f64,
    /// Largest strain, or without gauges elastic displacement, after the move.
    pub residual: f64,
    /// Whether that is a strain.
    pub strain: bool,
    /// Ticks in which the executor's limiter acted.
    pub limited_ticks: usize,
}

/// Encodes, decodes and plays a trajectory.
pub(super) fn played(file: &MoveFile, trajectory: &Trajectory) -> Result<Played, PlayedError> {
    let mut buffer = vec![0; MAX_ENCODED_BYTES];
    let decoded = Trajectory::decode(trajectory.encode(&mut buffer)?)?;
    let real = file.drive.real_machine(&file.machine);
    let plant = real.plant();
    let recording = ClosedLoop::new(plant, &file.limits, &file.from, &file.drive).play(&decoded)?;
    let metrics = Metrics::of(plant, &recording);
    let end = recording
        .frames
        .iter()
        .find(|frame| frame.time_s >= recording.rest_from_s);
    let target = plant.rest(&file.to);
    let (coordinate, miss, _) = end
        .into_iter()
        .flat_map(|frame| frame.coordinates.iter().zip(&target))
        .zip(plant.coordinates())
        .filter(|(_, coordinate)| !coordinate.elastic)
        .map(|((reached, target), coordinate)| {
            let miss = (reached - target).abs();
            (coordinate.name, miss, miss / coordinate.magnitude)
        })
        .max_by(|a, b| a.2.total_cmp(&b.2))
        .unwrap_or_default();
    Ok(Played {
        coordinate,
        miss,
        residual: metrics.residual(),
        strain: metrics.residual_strain.is_some(),
        limited_ticks: recording.limited_ticks(),
    })
}
