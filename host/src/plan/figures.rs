//! The figures that say how good a plan is, in words.

use super::Plan;
use crate::movefile::LimitsAt;
use crate::sptfile::Remark;

impl Plan {
    /// What travels with the trajectory: how it was planned, and how good it is.
    pub(super) fn remarks(&self, limits: LimitsAt) -> Vec<Remark> {
        let remark = |topic: &str, text: String, doubtful| Remark {
            topic: topic.to_owned(),
            text,
            doubtful,
        };
        let effort = &self.effort;
        let planned = format!(
            "{} by {} in {} iterations; {} variables, {} constraints; limits {}.",
            effort.status,
            effort.solver,
            effort.iterations,
            effort.variables,
            effort.constraints,
            match limits {
                LimitsAt::Everywhere => "everywhere",
                LimitsAt::Nodes => "at the collocation points only",
            }
        );
        let warning = self.warning();
        let doubtful = warning.is_some();
        let dynamics = warning.map_or_else(
            || {
                let share = self.end_miss.worst().map_or(0.0, |worst| worst.relative());
                format!(
                    "Integrated with error control under the planned control, no coordinate misses its end by more than {share:.1e} of \
                     what it moves."
                )
            },
            |warning| format!("Doubtful: {warning}."),
        );
        let optimality = format!("{} {}", self.finer_in_words(), self.hamiltonian_in_words());
        vec![
            remark("Planned", planned, false),
            remark("Dynamics", dynamics, doubtful),
            remark("Optimality", optimality, false),
            remark("Played", self.played_in_words(), self.played.is_err()),
        ]
    }

    /// Change of the duration to the finer mesh, as a share of it.
    #[must_use]
    pub fn change_to_finer(&self) -> Option<f64> {
        let finer = self.finer?;
        Some(finer.duration_s / finer.own_s - 1.0)
    }

    /// What a finer mesh would change.
    #[must_use]
    pub fn finer_in_words(&self) -> String {
        self.finer.zip(self.change_to_finer()).map_or_else(
            || "On a finer mesh the solver did not end, so its change of the duration is not known.".to_owned(),
            |(finer, change)| {
                format!(
                    "On a finer mesh of {} points instead of {}, with limits at the same places, the move takes {:.3} ms instead of \
                     {:.3} ms, {:+.3} %.",
                    finer.points,
                    self.solution.mesh.points(),
                    finer.duration_s * 1e3,
                    finer.own_s * 1e3,
                    change * 100.0
                )
            },
        )
    }

    /// How constant the Hamiltonian is.
    #[must_use]
    pub fn hamiltonian_in_words(&self) -> String {
        let h = &self.hamiltonian;
        format!(
            "The Hamiltonian, −1 all along the fastest move, is {:.4} in the mean, off by {:.1e} (root mean square) and {:.1e} at \
             most.",
            h.mean, h.spread, h.largest
        )
    }

    /// What the executor made of the trajectory.
    #[must_use]
    pub fn played_in_words(&self) -> String {
        match &self.played {
            Ok(played) => {
                let residual = if played.strain {
                    format!("{:.1} µε of strain", played.residual * 1e6)
                } else {
                    format!("{:.1e} of elastic displacement", played.residual)
                };
                format!(
                    "Shipped, decoded and played by the executor, {} ends {:.1e} from its target and {residual} is left; the limiter {}.",
                    played.coordinate,
                    played.miss,
                    match played.limited_ticks {
                        0 => "never acts".to_owned(),
                        ticks => format!("acts in {ticks} ticks"),
                    }
                )
            }
            Err(error) => {
                format!("Shipped and decoded, the executor does not play it to its end: {error}.")
            }
        }
    }
}
