//! What a certificate says.

use super::plants::PlantProofs;
use serde::{Deserialize, Serialize};
use stillpoint_shared::{Interval, LIMIT_TOLERANCE, time};

/// What a limit is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Limited {
    /// Speed of an axis: the polynomial that is sent as velocity, rad/s.
    Speed,
    /// Slope of the position polynomial of an axis, rad/s.
    PositionRate,
    /// Torque of an axis, N·m.
    Torque,
    /// Slope of the torque polynomial of an axis, N·m/s.
    TorqueRate,
    /// |τ| + k (|θ̇| − n₀) of an axis, N·m: beyond the knee speed n₀ the torque–speed curve falls with slope k.
    TorqueSpeed,
    /// An output of the machine, in its unit: elastic displacement, stress.
    Output,
}

/// One limit of one axis or output, over the whole move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proof {
    /// What is limited.
    pub limited: Limited,
    /// Axis or output, from 0.
    pub index: u8,
    /// Name for people, such as `torque of axis 1` or `elastic_displacement_x_m`.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// The largest magnitude allowed.
    pub limit: f64,
    /// No magnitude on the whole move is larger: proved. Infinite if nothing could be proved.
    pub bound: f64,
    /// A magnitude that is reached.
    pub reached: f64,
    /// What the executor's f32 makes of it: no value it sends (for slopes: no step per tick over the tick) is larger.
    /// `None` for what is not sent.
    pub played: Option<f64>,
    /// Interval of the largest bound, from 0.
    pub interval: u16,
    /// Where in it the largest magnitude is reached, s after the start of the move.
    pub time_s: f64,
    /// The same interval by interval; not stored in files.
    #[serde(skip)]
    pub intervals: Vec<IntervalPeak>,
}

/// The largest magnitude in one interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalPeak {
    /// No magnitude in the interval is larger: proved.
    pub bound: f64,
    /// A magnitude that is reached.
    pub reached: f64,
    /// Where, in the local coordinate on [−1, 1].
    pub local: f64,
}

impl Proof {
    /// A proof that has not seen an interval yet.
    pub(super) fn new(
        limited: Limited,
        index: usize,
        name: String,
        unit: &str,
        limit: f64,
    ) -> Self {
        Self {
            limited,
            index: index as u8,
            name,
            unit: unit.to_owned(),
            limit,
            bound: f64::NEG_INFINITY,
            reached: f64::NEG_INFINITY,
            played: None,
            interval: 0,
            time_s: 0.0,
            intervals: Vec::new(),
        }
    }

    /// Takes the peak of the next interval in.
    pub(super) fn take(&mut self, interval: &Interval<'_>, peak: IntervalPeak) {
        if peak.bound > self.bound {
            self.bound = peak.bound;
            self.interval = self.intervals.len() as u16;
            self.time_s = time::seconds(interval.start_ticks)
                + time::seconds(interval.duration_ticks) * 0.5 * (peak.local + 1.0);
        }
        self.reached = self.reached.max(peak.reached);
        self.intervals.push(peak);
    }

    /// What is left between bound and limit, in the unit; negative if the limit is not proved.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.limit - self.bound
    }

    /// Whether the bound is within the limit.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.bound <= self.limit
    }

    /// Whether a value beyond the limit is reached, not only not excluded.
    #[must_use]
    pub fn is_violated(&self) -> bool {
        self.reached > self.limit
    }

    /// Excess of the bound over the limit, relative to the limit; negative inside.
    #[must_use]
    pub fn relative(&self) -> f64 {
        self.bound / self.limit - 1.0
    }

    /// Whether the executor's limiter provably leaves this quantity alone: it acts beyond 1 + [`LIMIT_TOLERANCE`] of the
    /// limit, computed in f32.
    #[must_use]
    pub fn is_left_alone(&self) -> bool {
        self.relative_as_played() <= 0.0
    }

    /// Excess of what the executor makes of it over what its limiter leaves alone, relative to that; negative inside.
    fn relative_as_played(&self) -> f64 {
        let most = self.limit * (1.0 + f64::from(LIMIT_TOLERANCE)) * (1.0 - 1e-6);
        self.played.map_or(-1.0, |played| played / most - 1.0)
    }
}

/// Bounds of every limit over every interval of a trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version of the program that made it.
    pub tool: String,
    /// Content hash of the trajectory.
    pub trajectory_hash: u64,
    /// [`limits_hash`](super::limits_hash) of the limits.
    pub limits_hash: u64,
    /// Axis by axis and output by output.
    pub proofs: Vec<Proof>,
    /// What holds for the other plants of a robust move, one by one.
    pub plants: Vec<PlantProofs>,
}

impl Certificate {
    /// Whether every limit holds everywhere: proved.
    #[must_use]
    pub fn is_certified(&self) -> bool {
        self.proofs.iter().all(Proof::holds)
    }

    /// Whether the executor's limiter provably never acts, at full speed and a period of the drive loop of 250 µs.
    #[must_use]
    pub fn limiter_never_acts(&self) -> bool {
        self.proofs.iter().all(Proof::is_left_alone)
    }

    /// By how much more of themselves the limits would have to be drawn in for all to be proved, and for the limiter to leave all
    /// alone as well; 0 or less where they are.
    #[must_use]
    pub fn missing_margins(&self) -> [f64; 2] {
        let largest = |excess: fn(&Proof) -> f64| {
            let excesses = self.proofs.iter().map(excess);
            excesses.fold(f64::NEG_INFINITY, f64::max)
        };
        let proved = largest(Proof::relative);
        [proved, proved.max(largest(Proof::relative_as_played))]
    }

    /// The limit to which the values that the executor sends come nearest, as a share of it.
    #[must_use]
    pub fn tightest_as_played(&self) -> Option<&Proof> {
        let share = |proof: &Proof| proof.played.map_or(0.0, |played| played / proof.limit);
        let proofs = self.proofs.iter();
        proofs.max_by(|a, b| share(a).total_cmp(&share(b)))
    }

    /// The limit that is exceeded most, or, if none is, the one with the smallest relative margin.
    #[must_use]
    pub fn tightest(&self) -> Option<&Proof> {
        let proofs = self.proofs.iter();
        proofs.max_by(|a, b| a.relative().total_cmp(&b.relative()))
    }
}
