//! Names of the baselines, and what stands behind them.

use crate::certify::CertifyError;
use crate::simulate::modes::{ModesError, distinct_hz, locked};
use crate::simulate::profile::Law;
use crate::simulate::shaper::{Shaper, Tuning};
use crate::simulate::shortest::{Shortest, ShortestError, Task};
use crate::simulate::trajectory::PathError;

/// A planner that knows nothing of the machine but its frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Baseline {
    name: &'static str,
    law: Law,
    shaping: Option<Shaping>,
}

/// A shaper, and on how many of the lowest modes.
type Shaping = (fn(Tuning) -> Shaper, usize);

/// Why there is no such move.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BaselineError {
    /// The shaper cannot be tuned.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// The machine has not as many modes as are to be shaped.
    #[error(
        "{name} shapes {wanted} modes of vibration, the machine has {found} of different frequencies"
    )]
    TooFewModes {
        /// Name of the baseline.
        name: &'static str,
        /// Modes that it shapes.
        wanted: usize,
        /// Modes of the machine.
        found: usize,
    },
    /// No duration is the shortest.
    #[error(transparent)]
    Shortest(#[from] ShortestError),
    /// It cannot be written as a trajectory.
    #[error(transparent)]
    Path(#[from] PathError),
    /// It cannot be certified, whatever it is.
    #[error(transparent)]
    Certify(#[from] CertifyError),
    /// Its certificate says no.
    #[error("{name} of {duration_s:.6} s does not hold: {tightest}")]
    NotCertified {
        /// Name of the baseline.
        name: &'static str,
        /// The longest duration tried.
        duration_s: f64,
        /// The limit that is exceeded most, in words.
        tightest: String,
    },
}

impl Baseline {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::new("quintic", Law::Quintic, None),
        Self::new("quintic+zv", Law::Quintic, Some((Shaper::zv, 1))),
        Self::new("quintic+zvd", Law::Quintic, Some((Shaper::zvd, 1))),
        Self::new("quintic+ei", Law::Quintic, Some((Shaper::ei, 1))),
        Self::new("quintic+zv2", Law::Quintic, Some((Shaper::zv, 2))),
        Self::new("quintic+zvd2", Law::Quintic, Some((Shaper::zvd, 2))),
        Self::new("quintic+ei2", Law::Quintic, Some((Shaper::ei, 2))),
        Self::new("s-curve", Law::SCurve, None),
        Self::new("s-curve+zv", Law::SCurve, Some((Shaper::zv, 1))),
        Self::new("s-curve+zvd", Law::SCurve, Some((Shaper::zvd, 1))),
        Self::new("s-curve+ei", Law::SCurve, Some((Shaper::ei, 1))),
        Self::new("s-curve+zv2", Law::SCurve, Some((Shaper::zv, 2))),
        Self::new("s-curve+zvd2", Law::SCurve, Some((Shaper::zvd, 2))),
        Self::new("s-curve+ei2", Law::SCurve, Some((Shaper::ei, 2))),
    ];

    const fn new(name: &'static str, law: Law, shaping: Option<Shaping>) -> Self {
        Self { name, law, shaping }
    }

    /// The baseline of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name == name)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The law that it shapes.
    #[must_use]
    pub fn law(&self) -> Law {
        self.law
    }

    /// Whether it has a shaper.
    #[must_use]
    pub fn is_shaped(&self) -> bool {
        self.shaping.is_some()
    }

    /// Those that shape no more modes than the machine has.
    ///
    /// # Errors
    /// [`ModesError`] where the machine is singular.
    pub fn all_for(task: &Task<'_>) -> Result<Vec<Self>, ModesError> {
        let found = frequencies_hz(task)?.len();
        let fits = |baseline: &Self| baseline.shaping.is_none_or(|(_, modes)| modes <= found);
        Ok(Self::ALL.into_iter().filter(fits).collect())
    }

    /// The shortest move of this kind, with drives that follow exactly.
    ///
    /// # Errors
    /// [`BaselineError`].
    pub fn shortest(&self, task: &Task<'_>) -> Result<Shortest, BaselineError> {
        let frequencies_hz = frequencies_hz(task)?;
        let found = frequencies_hz.len();
        let mut shaper = Shaper::none();
        if let Some((shape, wanted)) = self.shaping {
            if found < wanted {
                return Err(BaselineError::TooFewModes {
                    name: self.name,
                    wanted,
                    found,
                });
            }
            for &frequency_hz in &frequencies_hz[..wanted] {
                shaper = shaper.then(&shape(Tuning {
                    frequency_hz,
                    damping_ratio: 0.0,
                }));
            }
        }
        // Three periods of the slowest vibration hardly excite it.
        let lowest_hz = frequencies_hz.first();
        let guess_s = lowest_hz.map_or(0.1, |lowest_hz| 3.0 / lowest_hz);
        Ok(task.shortest(self.law, &shaper, guess_s)?)
    }
}

/// The frequencies of a machine that stands at the start with its motors locked, rising.
fn frequencies_hz(task: &Task<'_>) -> Result<Vec<f64>, ModesError> {
    let modes = locked(task.plant, &task.plant.rest(task.from))?;
    Ok(distinct_hz(&modes))
}
