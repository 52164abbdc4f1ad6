//! A stored certificate against one computed from scratch.

use super::{Certificate, CertifyError, Proof, certify, limits_hash};
use crate::machine::Plant;
use crate::movefile::Limits;
use crate::sptfile::{Section, SectionError, SptFile};

/// Share of a limit by which a stored bound may differ from the computed one: how closely bounds are computed.
const DIFFERENCE: f64 = 2e-5;

/// Why a file is not verified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// There is no certificate, or none that can be read.
    #[error("{0}")]
    Section(#[from] SectionError),
    /// The certificate was made for another trajectory.
    #[error(
        "the certificate belongs to trajectory {certified:016x}, the file holds {found:016x}: plan the move again"
    )]
    OtherTrajectory {
        /// Content hash in the certificate.
        certified: u64,
        /// Content hash of the file's trajectory.
        found: u64,
    },
    /// The limits are others than those of the move file.
    #[error(
        "the certificate holds for limits {certified:016x}, those of the move file are {found:016x}: give the move file that it \
         was planned from, or plan the move again"
    )]
    OtherLimits {
        /// Hash in the certificate.
        certified: u64,
        /// Hash of the move file's limits.
        found: u64,
    },
    /// The parts do not belong together.
    #[error("{0}")]
    Certify(#[from] CertifyError),
    /// What is stored is not what is computed.
    #[error(
        "the certificate of version {tool} says {stored:.6e} {unit} as {what} of {name}, computed anew it is {computed:.6e} {unit}: the \
         move file describes another machine, or the certificate is wrong; plan the move again"
    )]
    Differs {
        /// Version that made the certificate.
        tool: String,
        /// Which of its figures.
        what: &'static str,
        /// Name of the limited quantity.
        name: String,
        /// Its unit.
        unit: String,
        /// Figure in the certificate.
        stored: f64,
        /// Figure computed.
        computed: f64,
    },
    /// A limit does not hold, or cannot be shown to hold.
    #[error("not certified: {0}")]
    NotCertified(String, Box<Certificate>),
}

impl VerifyError {
    /// A word for machines.
    #[must_use]
    pub fn status(&self) -> &'static str {
        match self {
            Self::Section(SectionError::Missing) => "no-certificate",
            Self::Section(_) => "damaged",
            Self::OtherTrajectory { .. } => "other-trajectory",
            Self::OtherLimits { .. } => "other-limits",
            Self::Certify(_) => "other-machine",
            Self::Differs { .. } => "differs",
            Self::NotCertified(..) => "not-certified",
        }
    }
}

/// Computes the certificate of a file from scratch and compares it with the stored one.
///
/// # Errors
/// [`VerifyError`] unless both agree and every limit holds.
pub fn verify(
    file: &SptFile,
    limits: &Limits,
    plant: &dyn Plant,
) -> Result<Certificate, VerifyError> {
    let Section {
        coordinates,
        certificate: stored,
    } = file.section.as_ref().map_err(|error| *error)?;
    let found = file.trajectory.header().content_hash;
    if stored.trajectory_hash != found {
        return Err(VerifyError::OtherTrajectory {
            certified: stored.trajectory_hash,
            found,
        });
    }
    let found = limits_hash(limits, plant).map_err(CertifyError::Limits)?;
    if stored.limits_hash != found {
        return Err(VerifyError::OtherLimits {
            certified: stored.limits_hash,
            found,
        });
    }
    let computed = certify(&file.trajectory, coordinates, limits, plant)?;
    compare(stored, &computed)?;
    match computed.tightest().filter(|proof| !proof.holds()) {
        None => Ok(computed),
        Some(proof) => Err(VerifyError::NotCertified(
            proof.to_string(),
            Box::new(computed),
        )),
    }
}

fn compare(stored: &Certificate, computed: &Certificate) -> Result<(), VerifyError> {
    let differs = |proof: &Proof, (what, stored_figure, computed_figure)| VerifyError::Differs {
        tool: stored.tool.clone(),
        what,
        name: proof.name.clone(),
        unit: proof.unit.clone(),
        stored: stored_figure,
        computed: computed_figure,
    };
    for proof in &computed.proofs {
        let same = |other: &&Proof| (other.limited, other.index) == (proof.limited, proof.index);
        let Some(other) = stored.proofs.iter().find(same) else {
            return Err(differs(proof, ("bound", f64::NAN, proof.bound)));
        };
        if let Some(figures) = difference(other, proof) {
            return Err(differs(proof, figures));
        }
    }
    Ok(())
}

/// The first figure that is another: which, stored and computed.
fn difference(stored: &Proof, computed: &Proof) -> Option<(&'static str, f64, f64)> {
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= DIFFERENCE * computed.limit;
    // Several intervals may be equally tight.
    let there = computed.intervals.get(usize::from(stored.interval));
    let bound_there = there.map_or(f64::NAN, |interval| interval.bound);
    let played = |proof: &Proof| proof.played.unwrap_or(f64::NAN);
    let figures = [
        (
            "limit",
            stored.limit,
            computed.limit,
            stored.limit == computed.limit,
        ),
        (
            "bound",
            stored.bound,
            computed.bound,
            close(stored.bound, computed.bound),
        ),
        (
            "largest value reached",
            stored.reached,
            computed.reached,
            close(stored.reached, computed.reached),
        ),
        (
            "largest value played",
            played(stored),
            played(computed),
            stored.played.is_some() == computed.played.is_some()
                && stored
                    .played
                    .is_none_or(|value| close(value, played(computed))),
        ),
        (
            "bound in the interval named",
            stored.bound,
            bound_there,
            close(bound_there, computed.bound),
        ),
    ];
    let mut wrong = figures.into_iter().filter(|(.., right)| !right);
    wrong
        .next()
        .map(|(what, stored, computed, _)| (what, stored, computed))
}
