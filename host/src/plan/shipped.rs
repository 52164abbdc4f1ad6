//! What is written into the file, and whether it is what was planned.

use super::{PlanError, nominal_part, trajectory};
use crate::certify::{Certificate, Coordinates, certify, certify_plants};
use crate::movefile::{LimitsAt, MoveFile};
use crate::ocp::Solution;
use stillpoint_shared::Trajectory;

/// The widest margin that is tried. Rounding to f32 takes most of it: a speed's is that of two positions over one tick of the
/// drive loop.
const WIDEST_MARGIN: f64 = 5e-3;

/// How much wider a margin is made than what was missing.
const WIDENING: f64 = 1.3;

/// What is written into the file.
pub(super) struct Shipped {
    pub(super) trajectory: Trajectory,
    pub(super) coordinates: Coordinates,
    pub(super) certificate: Certificate,
}

impl Shipped {
    /// Of a solution for all plants.
    pub(super) fn of(file: &MoveFile, solution: &Solution) -> Result<Self, PlanError> {
        let plant = file.machine.plant();
        let (axes, n) = (plant.axis_count(), plant.coordinate_count());
        let nominal = nominal_part(file, solution);
        let trajectory = trajectory(plant, &file.limits, &nominal, 1)?;
        let coordinates = Coordinates::of(&nominal, axes, n);
        let mut certificate = certify(&trajectory, &coordinates, &file.limits, plant)?;
        if let Some(robust) = &file.robust {
            let scenarios = robust.scenarios.iter().enumerate();
            let own = scenarios.map(|(index, scenario)| {
                let first = axes + 2 * n * (1 + index);
                (scenario.limited).then(|| Coordinates::of(solution, first, n))
            });
            let own = own.collect();
            certificate.plants = certify_plants(file, robust, &trajectory, own)?;
        }
        Ok(Self {
            trajectory,
            coordinates,
            certificate,
        })
    }

    /// The margin with which what is shipped would be certified, and left alone by the executor's limiter if that is possible;
    /// `None` where it is already or cannot be.
    pub(super) fn wider_margin(&self, file: &MoveFile, margin: f64) -> Option<f64> {
        if file.solver.limits == LimitsAt::Nodes {
            return None;
        }
        let [proved, left_alone] = self.certificate.missing_margins();
        let wider = |missing: f64| margin + WIDENING * missing;
        let possible = |missing: &f64| *missing > 0.0 && wider(*missing) <= WIDEST_MARGIN;
        let missing = Some(left_alone).filter(possible);
        missing.or(Some(proved).filter(possible)).map(wider)
    }
}
