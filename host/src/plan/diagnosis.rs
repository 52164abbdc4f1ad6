//! Why a plan failed: which constraint is violated most, where in time and by how much, which limits are saturated,
//! and what to try.

use crate::nlp::{NlpProblem, Outcome, Status};
use crate::ocp::{CollocationNlp, Transcription};
use std::fmt;

/// Share of its bound from which a quantity counts as saturated.
const SATURATED: f64 = 0.999;

/// The state of a solve that did not end well.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// How the solver ended.
    pub status: Status,
    /// Iterations used.
    pub iterations: usize,
    /// Duration of the last iterate, s.
    pub duration_s: f64,
    /// The most violated constraint, if any is violated at all.
    pub worst: Option<Violation>,
    /// Quantities that touch a limit somewhere: name, share of the points at which they do, first and last time (s).
    pub saturated: Vec<Saturation>,
    /// Where none is reached, the one that is come nearest to.
    pub nearest: Option<Nearest>,
}

/// The most violated constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Quantity, with unit; for dynamics the state whose equation does not hold.
    pub name: String,
    /// Whether it is a defect of the dynamics rather than a limit.
    pub dynamics: bool,
    /// Moment, s.
    pub time_s: f64,
    /// By how much, in the quantity's unit.
    pub amount: f64,
}

/// A limit that is come near to.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// Quantity, with unit.
    pub name: String,
    /// Share of its limit.
    pub share: f64,
    /// Moment, s.
    pub time_s: f64,
}

/// A limit that is reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Saturation {
    /// Quantity, with unit.
    pub name: String,
    /// Share of the points at which the limit is reached.
    pub share: f64,
    /// First time, s.
    pub from_s: f64,
    /// Last time, s.
    pub to_s: f64,
}

impl Diagnosis {
    /// Looks at where a solve ended.
    #[must_use]
    pub fn of(transcription: &Transcription, nlp: &CollocationNlp, outcome: &Outcome) -> Self {
        let duration_s = transcription.solution(&outcome.x).duration_s;
        let rows = transcription.row_meanings();
        let mut worst: Option<(f64, Violation)> = None;
        let mut touched = Touched::default();
        let constraints = outcome.constraints.iter().zip(nlp.constraint_bounds());
        for ((value, bounds), row) in constraints.zip(&rows) {
            let scaled = bounds.violation(*value);
            if scaled > 1e-6 && worst.as_ref().is_none_or(|(w, _)| scaled > *w) {
                let violation = Violation {
                    name: row.name.clone(),
                    dynamics: row.defect,
                    time_s: row.share * duration_s,
                    amount: scaled * row.scale,
                };
                worst = Some((scaled, violation));
            }
            if !row.defect {
                touched.see(
                    &row.name,
                    row.share * duration_s,
                    *value,
                    bounds.lower,
                    bounds.upper,
                );
            }
        }
        for (meaning, (value, bounds)) in transcription
            .variable_meanings()
            .iter()
            .zip(outcome.x.iter().zip(nlp.variable_bounds()))
        {
            if bounds.lower < bounds.upper {
                touched.see(
                    &meaning.name,
                    meaning.share * duration_s,
                    *value,
                    bounds.lower,
                    bounds.upper,
                );
            }
        }
        let (saturated, nearest) = touched.finish();
        Self {
            status: outcome.status,
            iterations: outcome.iterations,
            duration_s,
            worst: worst.map(|(_, violation)| violation),
            nearest: nearest.filter(|_| saturated.is_empty()),
            saturated,
        }
    }

    fn advice(&self) -> &'static str {
        match self.status {
            Status::Stopped => "Run it again and let it finish, or give it a coarser mesh.",
            Status::IterationLimit => {
                "Raise the limits that are reached or [solver] max_iterations, or try another mesh: more points, or more intervals of \
                 fewer points."
            }
            Status::Acceptable => {
                "Loosen [solver] tolerance, or try a finer mesh ([mesh] intervals, points)."
            }
            Status::Invalid => {
                "The equations of motion give no number along the first guess: if the machine's parameters are right, the \
                 straight line between the poses passes a singular or unreachable one; move to a pose in between first."
            }
            _ => {
                "Raise the limit that is violated or saturated, split the move at a pose in between, check that the other \
                 elbow is not meant, or try a finer mesh ([mesh] intervals, points)."
            }
        }
    }
}

#[derive(Default)]
struct Touched {
    seen: Vec<(Saturation, usize, usize)>,
    nearest: Option<Nearest>,
}

impl Touched {
    fn see(&mut self, name: &str, time_s: f64, value: f64, lower: f64, upper: f64) {
        let (center, half) = ((lower + upper) / 2.0, (upper - lower) / 2.0);
        if !half.is_finite() || half <= 0.0 {
            return;
        }
        let index = self
            .seen
            .iter()
            .position(|(s, ..)| s.name == name)
            .unwrap_or_else(|| {
                let empty = Saturation {
                    name: name.to_owned(),
                    share: 0.0,
                    from_s: f64::INFINITY,
                    to_s: f64::NEG_INFINITY,
                };
                self.seen.push((empty, 0, 0));
                self.seen.len() - 1
            });
        let (saturation, hits, points) = &mut self.seen[index];
        *points += 1;
        let share = (value - center).abs() / half;
        if (self.nearest.as_ref()).is_none_or(|nearest| share > nearest.share) {
            self.nearest = Some(Nearest {
                name: name.to_owned(),
                share,
                time_s,
            });
        }
        if share >= SATURATED {
            *hits += 1;
            saturation.from_s = saturation.from_s.min(time_s);
            saturation.to_s = saturation.to_s.max(time_s);
        }
    }

    fn finish(self) -> (Vec<Saturation>, Option<Nearest>) {
        let saturated = (self.seen)
            .into_iter()
            .filter(|&(_, hits, _)| hits > 0)
            .map(|(saturation, hits, points)| Saturation {
                share: hits as f64 / points as f64,
                ..saturation
            })
            .collect();
        (saturated, self.nearest)
    }
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = match self.status {
            Status::Stopped => "stopped on request",
            Status::Infeasible => "no move satisfies all limits near where the solver looked",
            Status::IterationLimit => "the iterations are used up",
            Status::Stalled => "the solver makes no further progress",
            Status::Invalid => "the solver refused the problem",
            Status::Acceptable => "converged only to a hundred times the tolerance",
            Status::Solved => "solved",
        };
        write!(f, "{how} after {} iterations", self.iterations)?;
        if self.duration_s.is_finite() {
            write!(
                f,
                "; the last iterate takes {:.3} ms",
                self.duration_s * 1e3
            )?;
        }
        match &self.worst {
            Some(v) if v.dynamics => write!(
                f,
                "\n  violated most: the equation of motion of {} at {:.3} ms, by {:.3e}",
                v.name,
                v.time_s * 1e3,
                v.amount
            )?,
            Some(v) => write!(
                f,
                "\n  violated most: {} at {:.3} ms, by {:.3e}",
                v.name,
                v.time_s * 1e3,
                v.amount
            )?,
            None => write!(
                f,
                "\n  no constraint is violated, but it is not the fastest move yet"
            )?,
        }
        for s in &self.saturated {
            write!(
                f,
                "\n  at its limit: {} at {:.0} % of the points, {:.3} to {:.3} ms",
                s.name,
                s.share * 100.0,
                s.from_s * 1e3,
                s.to_s * 1e3
            )?;
        }
        if let Some(nearest) = &self.nearest {
            write!(
                f,
                "\n  no limit is reached; nearest: {} with {:.0} % of its limit at {:.3} ms",
                nearest.name,
                nearest.share * 100.0,
                nearest.time_s * 1e3
            )?;
        }
        write!(f, "\n  {}", self.advice())
    }
}
