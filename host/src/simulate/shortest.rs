//! The shortest duration in which a profile can make a move without breaking a limit: what a user would pick instead.
//!
//! Vibration makes peaks rise and fall with the duration, so there may be an island of durations that happen to be
//! fine below longer ones that are not. Nobody would tune a machine to such an island; "shortest" here is the
//! duration from which on *every* longer one keeps all limits.

use super::ideal::{self, Settings};
use super::ode::OdeError;
use super::path::RigidPath;
use super::profile::{Law, Profile};
use super::recording::Recording;
use super::shaper::Shaper;
use super::usage::Usage;
use crate::machine::Plant;
use crate::movefile::{Limits, MoveFile};

/// A move from pose to pose, and what limits it.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The machine.
    pub plant: &'a dyn Plant,
    /// Pose at the start.
    pub from: &'a [f64],
    /// Pose at the end.
    pub to: &'a [f64],
    /// The limits.
    pub limits: &'a Limits,
}

/// A shortest move.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortest {
    /// Its profile.
    pub profile: Profile,
    /// What the machine does, with ideal drives.
    pub recording: Recording,
    /// The limit that forbids a shorter one.
    pub active: Usage,
}

/// Why there is no shortest move.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShortestError {
    /// The simulation fails.
    #[error(transparent)]
    Ode(#[from] OdeError),
    /// Some limit is broken at any duration, or none at any.
    #[error(
        "no shortest duration was found between {shortest_s} s and {longest_s} s: {limit} is used {ratio:.3} times"
    )]
    NoBracket {
        /// Shortest duration tried.
        shortest_s: f64,
        /// Longest duration tried.
        longest_s: f64,
        /// The limit used most at the last one.
        limit: String,
        /// How much of it.
        ratio: f64,
    },
}

/// For finding the neighbourhood: vibration peaks are met to about 1 %, those that build up late not at all.
const COARSE: Settings = Settings {
    after_s: 0.15,
    sample_s: 5e-4,
    tolerance: 1e-4,
};
/// For the answer.
const FINE: Settings = Settings {
    after_s: 0.35,
    sample_s: 1e-4,
    tolerance: 1e-6,
};
/// The search comes down from a duration that uses this much of the limits: longer ones use less.
const SAFE: f64 = 0.5;
/// Relative accuracy of the duration.
const ACCURACY: f64 = 5e-4;

impl<'a> From<&'a MoveFile> for Task<'a> {
    fn from(file: &'a MoveFile) -> Self {
        Self {
            plant: file.machine.plant(),
            from: &file.from,
            to: &file.to,
            limits: &file.limits,
        }
    }
}

struct Trial {
    law_s: f64,
    recording: Recording,
    most: Usage,
}

impl Task<'_> {
    fn try_out(
        &self,
        law: Law,
        shaper: &Shaper,
        law_s: f64,
        settings: Settings,
    ) -> Result<Trial, OdeError> {
        let profile = Profile::new(law, law_s, shaper.clone());
        let path = RigidPath::new(self.plant, self.from, self.to, &profile);
        let recording = ideal::simulate(self.plant, &path, settings)?;
        let most = Usage::most(self.plant, self.limits, &recording);
        Ok(Trial {
            law_s,
            recording,
            most,
        })
    }

    /// A duration that is long enough but not by far: uses go with its inverse, or the inverse's square.
    fn safe(&self, law: Law, shaper: &Shaper, guess_s: f64) -> Result<Trial, ShortestError> {
        let (mut law_s, mut tried) = (guess_s, (guess_s, guess_s));
        let mut last = None;
        for _ in 0..40 {
            let trial = self.try_out(law, shaper, law_s, COARSE)?;
            let ratio = trial.most.ratio;
            if ratio <= SAFE && ratio > 0.25 * SAFE {
                return Ok(trial);
            }
            tried = (tried.0.min(law_s), tried.1.max(law_s));
            law_s *= (ratio / (0.8 * SAFE)).sqrt().clamp(0.3, 3.0);
            last = Some(trial.most);
        }
        let most = last.unwrap_or(Usage {
            limit: String::new(),
            time_s: 0.0,
            ratio: 0.0,
        });
        Err(ShortestError::NoBracket {
            shortest_s: tried.0,
            longest_s: tried.1,
            limit: most.limit,
            ratio: most.ratio,
        })
    }

    /// The shortest move with a law and a shaper; `guess_s` is about how long the law lasts then.
    ///
    /// Comes down from a safe duration in steps of one to three per cent to the first that breaks a limit, then
    /// closes in on the duration between.
    ///
    /// # Errors
    /// [`ShortestError`].
    pub fn shortest(
        &self,
        law: Law,
        shaper: &Shaper,
        guess_s: f64,
    ) -> Result<Shortest, ShortestError> {
        let mut good = self.safe(law, shaper, guess_s)?;
        let mut bad = loop {
            let spare = (1.0 - good.most.ratio).max(0.0);
            let shorter_s = good.law_s * (1.0 - (0.06 * spare).max(0.01));
            let next = self.try_out(law, shaper, shorter_s, COARSE)?;
            if next.most.ratio > 1.0 {
                break next;
            }
            good = next;
        };
        // Samples further apart miss peaks, so the coarse answers are a little too good: both ends need fine ones.
        let width_s = good.law_s - bad.law_s;
        good = self.try_out(law, shaper, good.law_s, FINE)?;
        while good.most.ratio > 1.0 {
            let longer = self.try_out(law, shaper, good.law_s + width_s, FINE)?;
            bad = std::mem::replace(&mut good, longer);
        }
        let accuracy_s = ACCURACY * good.law_s;
        for turn in 0.. {
            let width_s = good.law_s - bad.law_s;
            if width_s <= accuracy_s {
                break;
            }
            let (above, below) = (bad.most.ratio - 1.0, 1.0 - good.most.ratio);
            let aim_s = match turn % 3 {
                // A little beyond where the straight line between the two meets the limit …
                0 => bad.law_s + width_s * above / (above + below) + 0.4 * accuracy_s,
                // … then a little before; if that line misleads, the middle.
                1 => good.law_s - 0.9 * accuracy_s,
                _ => bad.law_s + 0.5 * width_s,
            };
            let margin_s = 0.02 * width_s;
            let aim_s = aim_s.clamp(bad.law_s + margin_s, good.law_s - margin_s);
            let next = self.try_out(law, shaper, aim_s, FINE)?;
            if next.most.ratio > 1.0 {
                bad = next;
            } else {
                good = next;
            }
        }
        Ok(Shortest {
            profile: Profile::new(law, good.law_s, shaper.clone()),
            recording: good.recording,
            active: bad.most,
        })
    }
}
