//! Why there is no plan.

use super::ways::Failure;
use super::{ConversionError, Diagnosis, Effort};
use crate::certify::{CertifyError, PlantError};
use crate::nlp::Status;
use crate::simulate::modes::ModesError;
use crate::simulate::ode::OdeError;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The solver did not converge.
    #[error("no plan: {0}")]
    Unsolved(Box<Diagnosis>, Box<Effort>),
    /// No move of the longest duration that is planned for keeps the motors' limits.
    #[error(
        "no plan: within `{limit}` the undeformed machine takes {estimate_s:.3e} s, and moves of more than {longest_s} s are not planned: \
         raise it, or move less far"
    )]
    TooLong {
        /// Key of the limit that the duration is due to.
        limit: &'static str,
        /// Duration of a quintic within it, s.
        estimate_s: f64,
        /// Longest duration, s.
        longest_s: f64,
    },
    /// The machine cannot follow the planned control to the end.
    #[error("the plan does not hold: {source}. Try a finer mesh ([mesh] intervals, points)")]
    Check {
        /// Where the integration ended.
        source: OdeError,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The machine ends somewhere else under the planned control.
    #[error(
        "the plan does not hold: integrated under the planned control, {name} misses its end by {miss:.3e}, {share:.0} % of \
         what it moves. Try a finer mesh ([mesh] intervals, points), or for a tiny move a smaller [solver] tolerance"
    )]
    Missed {
        /// The coordinate that misses most.
        name: String,
        /// By how much, in its unit.
        miss: f64,
        /// In per cent of its range.
        share: f64,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The limits could not be made to hold between the points.
    #[error(
        "the plan does not hold: {tightest}. Try a finer mesh ([mesh] intervals, points), or plan with limits at the points only \
         (`--limits nodes`), which a board refuses"
    )]
    NotCertified {
        /// The limit that is exceeded most, in words.
        tightest: String,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The answer does not fit the board.
    #[error(transparent)]
    Conversion(#[from] ConversionError),
    /// Another plant of a robust move exceeds a bound.
    #[error(
        "the plan does not hold: {broken}{suits}. Try a finer mesh ([mesh] intervals, points), allow more to be left, or name \
         plants nearer to the nominal one"
    )]
    OtherPlant {
        /// What is how much, of how much, with which plant.
        broken: String,
        /// Which plants are as still as they have to be.
        suits: String,
        /// What was spent.
        effort: Box<Effort>,
    },
    /// The solver converged for plants that are nearer to the nominal one than those of the file, if at all.
    #[error("{unsolved}\n  {instead}")]
    TooFarApart {
        /// How it ended for those of the file.
        unsolved: Box<Self>,
        /// What there is a plan for.
        instead: String,
    },
    /// A plant of a robust move cannot follow what is planned.
    #[error("the plan does not hold: {0}")]
    Plant(#[from] PlantError),
    /// A plant of a robust move has no modes at the goal.
    #[error("no bound on what is left after the move: {0}")]
    Modes(#[from] ModesError),
    /// The answer cannot be certified, whatever it is.
    #[error(transparent)]
    Certify(#[from] CertifyError),
}

impl PlanError {
    /// What went wrong, if another way may lead to a plan, and what was spent.
    pub(super) fn worth_another_way(&self) -> Option<(Failure, &Effort)> {
        match self {
            Self::Unsolved(diagnosis, effort) => (diagnosis.status != Status::Stopped)
                .then_some((Failure::Unsolved, effort.as_ref())),
            Self::NotCertified { effort, .. }
            | Self::Check { effort, .. }
            | Self::Missed { effort, .. }
            | Self::OtherPlant { effort, .. } => Some((Failure::Untrue, effort)),
            _ => None,
        }
    }

    pub(super) fn unsolved(mut diagnosis: Box<Diagnosis>, effort: &Effort) -> Self {
        diagnosis.iterations = effort.iterations;
        Self::Unsolved(diagnosis, Box::new(effort.clone()))
    }
}
