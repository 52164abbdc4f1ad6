//! A stored certificate against one computed from scratch.

use super::plants::{PlantError, PlantProofs, Simulated, certify_plants};
use super::{Certificate, CertifyError, Proof, certify, limits_hash};
use crate::machine::Plant;
use crate::movefile::{Limits, MoveFile, Scenario};
use crate::sptfile::{Section, SectionError, SptFile};

/// Share of a limit by which a stored bound may differ from the computed one: how closely bounds are computed.
const DIFFERENCE: f64 = 2e-5;

/// The same of a simulated value: how closely that is reproduced.
const SIMULATED_DIFFERENCE: f64 = 1e-3;

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
    /// The plants of the certificate are not those of the move file's `[robust]`.
    #[error(
        "the certificate holds {certified} besides the nominal plant, the move file asks for {wanted}: give the move file that it \
         was planned from, or plan the move again"
    )]
    OtherPlants {
        /// Plants and bounds of the certificate, in words.
        certified: String,
        /// Those of the move file.
        wanted: String,
    },
    /// Nothing can be said of another plant.
    #[error("{0}")]
    Plant(#[from] PlantError),
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
            Self::Certify(_) | Self::Plant(_) => "other-machine",
            Self::OtherPlants { .. } => "other-plants",
            Self::Differs { .. } => "differs",
            Self::NotCertified(..) => "not-certified",
        }
    }
}

/// Computes the certificate of a file from scratch, for all plants of a move, and compares it with the stored one.
///
/// # Errors
/// [`VerifyError`] unless both agree, every limit holds and every plant is as still as it has to be.
pub fn verify_move(spt: &SptFile, file: &MoveFile) -> Result<Certificate, VerifyError> {
    let mut computed = verify(spt, &file.limits, file.machine.plant())?;
    let stored = &spt.section.as_ref().map_err(|error| *error)?.certificate;
    let wanted = file.robust.as_ref().map_or(&[][..], |r| &r.scenarios);
    let same = |(plant, scenario): (&PlantProofs, &Scenario)| {
        plant.name == scenario.name && plant.coordinates.is_some() == scenario.limited
    };
    if stored.plants.len() != wanted.len() || !stored.plants.iter().zip(wanted).all(same) {
        let certified = stored
            .plants
            .iter()
            .map(|plant| (&plant.name, plant.coordinates.is_some()));
        let wanted = wanted
            .iter()
            .map(|scenario| (&scenario.name, scenario.limited));
        return Err(VerifyError::OtherPlants {
            certified: in_words(certified),
            wanted: in_words(wanted),
        });
    }
    if let Some(robust) = &file.robust {
        let coordinates = stored.plants.iter().map(|plant| plant.coordinates.clone());
        let coordinates = coordinates.collect();
        computed.plants = certify_plants(file, robust, &spt.trajectory, coordinates)?;
        for (stored_plant, plant) in stored.plants.iter().zip(&computed.plants) {
            compare_proofs(stored, &stored_plant.proofs, &plant.proofs, &plant.name)?;
            compare_simulated(stored, stored_plant, plant)?;
        }
    }
    match computed.plants.iter().find_map(PlantProofs::broken) {
        None => Ok(computed),
        Some(broken) => Err(VerifyError::NotCertified(broken, Box::new(computed))),
    }
}

/// Plants by name, and whether limits hold for them.
fn in_words<'a>(plants: impl Iterator<Item = (&'a String, bool)>) -> String {
    let named = plants.map(|(name, limited)| {
        let limits = if limited { " with all limits" } else { "" };
        format!("{name}{limits}")
    });
    let named: Vec<String> = named.collect();
    if named.is_empty() {
        "no plant".to_owned()
    } else {
        named.join(", ")
    }
}

/// Computes the certificate of a file from scratch, for the nominal plant, and compares it with the stored one.
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
        ..
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
    compare_proofs(stored, &stored.proofs, &computed.proofs, "")?;
    match computed.tightest().filter(|proof| !proof.holds()) {
        None => Ok(computed),
        Some(proof) => Err(VerifyError::NotCertified(
            proof.to_string(),
            Box::new(computed),
        )),
    }
}

fn compare_proofs(
    certificate: &Certificate,
    stored: &[Proof],
    computed: &[Proof],
    plant: &str,
) -> Result<(), VerifyError> {
    let differs = |proof: &Proof, (what, stored, computed)| VerifyError::Differs {
        tool: certificate.tool.clone(),
        what,
        name: if plant.is_empty() {
            proof.name.clone()
        } else {
            format!("{} with {plant}", proof.name)
        },
        unit: proof.unit.clone(),
        stored,
        computed,
    };
    for proof in computed {
        let same = |other: &&Proof| (other.limited, other.index) == (proof.limited, proof.index);
        let Some(other) = stored.iter().find(same) else {
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

/// The same for what was simulated.
fn compare_simulated(
    certificate: &Certificate,
    stored: &PlantProofs,
    computed: &PlantProofs,
) -> Result<(), VerifyError> {
    for row in &computed.simulated {
        let same = |other: &&Simulated| (&other.name, other.after) == (&row.name, row.after);
        let stored = stored.simulated.iter().find(same);
        let close = |other: &&Simulated| {
            let difference = (other.value - row.value).abs();
            difference <= SIMULATED_DIFFERENCE * row.limit && other.limit == row.limit
        };
        if stored.filter(close).is_none() {
            return Err(VerifyError::Differs {
                tool: certificate.tool.clone(),
                what: "value",
                name: format!("{} with {}", row.name, computed.name),
                unit: row.unit.clone(),
                stored: stored.map_or(f64::NAN, |other| other.value),
                computed: row.value,
            });
        }
    }
    Ok(())
}
