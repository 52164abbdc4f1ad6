//! The shortest duration in which a profile can make a move without breaking a limit: what a user would pick instead.
//!
//! Vibration makes peaks rise and fall with the duration, so there may be an island of durations that happen to be
//! fine below longer ones that are not. Nobody would tune a machine to such an island; "shortest" here is the
//! duration from which on *every* longer one keeps all limits.

use super::bounds::{Bounds, Use};
use super::ideal::{self, Settings};
use super::modes::{self, ModesError};
use super::ode::OdeError;
use super::path::RigidPath;
use super::profile::{Profile, Shaper, Tuning};
use super::recording::Recording;
use crate::machine::Plant;

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
    pub bounds: &'a Bounds,
}

/// A shortest move.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortest {
    /// Its profile.
    pub profile: Profile,
    /// What the machine does, with ideal drives.
    pub recording: Recording,
    /// The limit that forbids a shorter one.
    pub active: Use,
}

/// Why there is no shortest move.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShortestError {
    /// The simulation fails.
    #[error(transparent)]
    Ode(#[from] OdeError),
    /// The shapers cannot be tuned.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// Some limit is broken at any duration, or none at any.
    #[error("no shortest duration was found between {shortest_s} s and {longest_s} s: {limit} is used {ratio:.3} times")]
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

/// For finding the neighbourhood: peaks are met to about 1e-3.
const COARSE: Settings = Settings { after_s: 0.35, sample_s: 2.5e-4, tolerance: 1e-5 };
/// For the answer.
const FINE: Settings = Settings { after_s: 0.35, sample_s: 1e-4, tolerance: 1e-7 };
/// The search comes down from a duration that uses this much of the limits: longer ones use less.
const SAFE: f64 = 0.5;
/// Relative accuracy of the duration.
const ACCURACY: f64 = 1e-4;

struct Trial {
    quintic_s: f64,
    recording: Recording,
    most: Use,
}

impl Task<'_> {
    fn try_out(&self, shaper: &Shaper, quintic_s: f64, settings: Settings) -> Result<Trial, OdeError> {
        let profile = Profile::new(quintic_s, shaper.clone());
        let path = RigidPath::new(self.plant, self.from, self.to, &profile);
        let recording = ideal::simulate(self.plant, &path, settings)?;
        let most = self.bounds.most_used(self.plant, &recording);
        Ok(Trial { quintic_s, recording, most })
    }

    /// A duration that is long enough but not by far: uses go with its inverse, or the inverse's square.
    fn safe(&self, shaper: &Shaper, guess_s: f64) -> Result<Trial, ShortestError> {
        let (mut quintic_s, mut tried) = (guess_s, (guess_s, guess_s));
        let mut last = None;
        for _ in 0..40 {
            let trial = self.try_out(shaper, quintic_s, COARSE)?;
            let ratio = trial.most.ratio;
            if ratio <= SAFE && ratio > 0.25 * SAFE {
                return Ok(trial);
            }
            tried = (tried.0.min(quintic_s), tried.1.max(quintic_s));
            quintic_s *= (ratio / (0.8 * SAFE)).sqrt().clamp(0.3, 3.0);
            last = Some(trial.most);
        }
        let most = last.unwrap_or(Use { limit: String::new(), time_s: 0.0, ratio: 0.0 });
        Err(ShortestError::NoBracket {
            shortest_s: tried.0,
            longest_s: tried.1,
            limit: most.limit,
            ratio: most.ratio,
        })
    }

    /// The shortest move with a quintic and a shaper.
    ///
    /// Comes down from a safe duration in steps of one to three per cent to the first that breaks a limit, then
    /// closes in on the duration between.
    ///
    /// # Errors
    /// [`ShortestError`].
    pub fn shortest(&self, shaper: &Shaper, guess_s: f64) -> Result<Shortest, ShortestError> {
        let mut good = self.safe(shaper, guess_s)?;
        let mut bad = loop {
            let spare = (1.0 - good.most.ratio).max(0.0);
            let shorter_s = good.quintic_s * (1.0 - (0.06 * spare).max(0.01));
            let next = self.try_out(shaper, shorter_s, COARSE)?;
            if next.most.ratio > 1.0 {
                break next;
            }
            good = next;
        };
        // The coarse answer may be off by a thousandth: the bracket has to hold for the fine one.
        let width_s = good.quintic_s - bad.quintic_s;
        good = self.try_out(shaper, good.quintic_s, FINE)?;
        while good.most.ratio > 1.0 {
            good = self.try_out(shaper, good.quintic_s + width_s, FINE)?;
        }
        let mut stretch = 0.5;
        while good.quintic_s - bad.quintic_s > ACCURACY * good.quintic_s {
            // Where the straight line between the two meets the limit, but towards the middle after each miss on one side.
            let (above, below) = (bad.most.ratio - 1.0, 1.0 - good.most.ratio);
            let share = (above / (above + below)).clamp(0.02, 0.98);
            let aim = share + (0.5 - share) * stretch;
            let aim_s = bad.quintic_s + aim * (good.quintic_s - bad.quintic_s);
            stretch = 1.0 - stretch;
            let next = self.try_out(shaper, aim_s, FINE)?;
            if next.most.ratio > 1.0 {
                bad = next;
            } else {
                good = next;
            }
        }
        Ok(Shortest {
            profile: Profile::new(good.quintic_s, shaper.clone()),
            recording: good.recording,
            active: bad.most,
        })
    }

    /// The shortest moves with the usual profiles: a quintic alone, and shaped for the vibration with locked motors at
    /// the start. At the same time, one thread each.
    ///
    /// # Errors
    /// [`ShortestError`] of the first that fails.
    pub fn usual(&self) -> Result<Vec<(&'static str, Shortest)>, ShortestError> {
        let modes = modes::locked(self.plant, &self.plant.rest(self.from))?;
        let tuned: Vec<Tuning> = modes::distinct_hz(&modes)
            .into_iter()
            .map(|frequency_hz| Tuning { frequency_hz, damping_ratio: 0.0 })
            .collect();
        let mut profiles = vec![("quintic", Shaper::none())];
        if let [lowest, others @ ..] = tuned.as_slice() {
            let zv = Shaper::zv(*lowest);
            profiles.push(("quintic with ZV", zv.clone()));
            if let [next, ..] = others {
                profiles.push(("quintic with ZV on two modes", zv.then(&Shaper::zv(*next))));
            }
            profiles.push(("quintic with ZVD", Shaper::zvd(*lowest)));
        }
        // A quintic of three periods of the slowest vibration hardly excites it.
        let guess_s = tuned.first().map_or(0.1, |lowest| 3.0 / lowest.frequency_hz);
        std::thread::scope(|scope| {
            let running: Vec<_> = profiles
                .iter()
                .map(|(name, shaper)| (*name, scope.spawn(move || self.shortest(shaper, guess_s))))
                .collect();
            running
                .into_iter()
                .map(|(name, thread)| match thread.join() {
                    Ok(result) => result.map(|shortest| (name, shortest)),
                    Err(panic) => std::panic::resume_unwind(panic),
                })
                .collect()
        })
    }
}
