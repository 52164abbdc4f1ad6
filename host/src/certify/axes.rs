//! Bounds on what is sent to the axes: polynomials all of them, the torque–speed curve included.
//!
//! Beyond the knee the curve is |τ| + k |θ̇| ≤ m + k n₀, that is |τ + k θ̇| and |τ − k θ̇| ≤ m + k n₀. Where the curve has
//! fallen to zero, this asks for more than the curve does: no speed beyond that at which no torque is left.

use super::bernstein::{Bernstein, Channel, Pieces};
use super::certificate::{Limited, Proof};
use super::peak::peak;
use super::playing;
use stillpoint_shared::status::Quantity;
use stillpoint_shared::trajectory::QUANTITIES;
use stillpoint_shared::{AxisLimits, Interval, Trajectory, time};

/// Share of a limit to which the bound is brought close to the largest value.
const RESOLUTION: f64 = 1e-7;

/// Proofs of all limits of one axis.
pub(super) fn prove(
    trajectory: &Trajectory,
    pieces: &[Pieces],
    axis: usize,
    limits: &AxisLimits,
) -> Vec<Proof> {
    let mut tally = Tally::new(axis, limits);
    for interval in trajectory.intervals() {
        let Some(pieces) = pieces.iter().find(|p| p.points() == interval.points) else {
            continue;
        };
        tally.see(&interval, pieces, trajectory.axes());
    }
    tally.proofs(jumps(trajectory, axis))
}

/// Values of one quantity of one axis in an interval, exact in f64.
fn values(interval: &Interval<'_>, axes: usize, quantity: Quantity, axis: usize) -> Vec<f64> {
    let own = interval.coefficients.iter();
    let values = own.skip(quantity as usize * axes + axis);
    values
        .step_by(QUANTITIES * axes)
        .map(|&value| f64::from(value))
        .collect()
}

/// Sums over all joints of |jump|: of the position and of the torque.
fn jumps(trajectory: &Trajectory, axis: usize) -> [f64; 2] {
    let axes = trajectory.axes();
    [Quantity::Position, Quantity::Torque].map(|quantity| {
        let mut end: Option<f64> = None;
        let mut sum = 0.0;
        for interval in trajectory.intervals() {
            let channel = values(&interval, axes, quantity, axis);
            if let (Some(before), Some(after)) = (end, channel.first()) {
                sum += (after - before).abs();
            }
            end = channel.last().copied();
        }
        sum
    })
}

/// One limit while intervals go by.
struct Line {
    proof: Proof,
    /// Taken off the polynomial's magnitude to get the limited quantity's.
    offset: f64,
    /// Largest rounding error of an evaluation; for slopes, of the polynomial whose slope it is.
    rounding: f64,
    /// Largest product of a slope and the interval's duration.
    rate_by_duration: f64,
}

struct Tally {
    axis: usize,
    lines: Vec<Line>,
    slope: f64,
}

impl Tally {
    fn new(axis: usize, limits: &AxisLimits) -> Self {
        let [torque, rate, speed, knee, slope] = [
            limits.torque_nm,
            limits.torque_rate_nm_per_s,
            limits.speed_rad_per_s,
            limits.knee_speed_rad_per_s,
            limits.slope_nm_s_per_rad,
        ]
        .map(f64::from);
        let line = |limited, words, unit, limit, offset| Line {
            proof: Proof::new(
                limited,
                axis,
                format!("{words} of axis {}", axis + 1),
                unit,
                limit,
            ),
            offset,
            rounding: 0.0,
            rate_by_duration: 0.0,
        };
        let slope_words = "slope of the position";
        let mut lines = vec![
            line(Limited::Speed, "speed", "rad/s", speed, 0.0),
            line(Limited::PositionRate, slope_words, "rad/s", speed, 0.0),
            line(Limited::Torque, "torque", "N·m", torque, 0.0),
            line(Limited::TorqueRate, "torque rate", "N·m/s", rate, 0.0),
        ];
        if slope > 0.0 {
            let (words, offset) = ("torque–speed curve", slope * knee);
            lines.push(line(Limited::TorqueSpeed, words, "N·m", torque, offset));
        }
        Self { axis, lines, slope }
    }

    fn see(&mut self, interval: &Interval<'_>, pieces: &Pieces, axes: usize) {
        let channel = |quantity| pieces.channel(&values(interval, axes, quantity, self.axis));
        let [position, speed, torque] = Quantity::ALL.map(channel);
        let points = interval.points;
        let duration_s = time::seconds(interval.duration_ticks);
        let rounding = |channel: &Channel| playing::rounding(points, channel.absolute);
        let rate = |channel: &Channel| -> Vec<Bernstein> {
            let slopes = channel.pieces.iter().map(Bernstein::derivative);
            slopes.map(|slope| slope.scaled(2.0 / duration_s)).collect()
        };
        let slope = self.slope;
        for line in &mut self.lines {
            let (polynomials, error) = match line.proof.limited {
                Limited::PositionRate => (rate(&position), rounding(&position)),
                Limited::Torque => (torque.pieces.clone(), rounding(&torque)),
                Limited::TorqueRate => (rate(&torque), rounding(&torque)),
                Limited::TorqueSpeed => {
                    let pairs = || torque.pieces.iter().zip(&speed.pieces);
                    let plus = pairs().map(|(t, v)| t.combined(1.0, v, slope));
                    let minus = pairs().map(|(t, v)| t.combined(1.0, v, -slope));
                    let error = rounding(&torque) + slope * rounding(&speed);
                    (plus.chain(minus).collect(), error)
                }
                // Outputs are no lines here.
                Limited::Speed | Limited::Output => (speed.pieces.clone(), rounding(&speed)),
            };
            let resolution = RESOLUTION * (line.proof.limit + line.offset);
            let mut found = peak(polynomials.into_iter(), resolution);
            line.rounding = line.rounding.max(error);
            line.rate_by_duration = line.rate_by_duration.max(found.bound * duration_s);
            if line.offset > 0.0 {
                // Rounding of the offset and of the differences.
                let rounded = 2.0 * f64::EPSILON * (line.offset + found.bound);
                found.bound = found.bound - line.offset + rounded;
                found.reached = found.reached - line.offset - rounded;
            }
            line.proof.take(interval, found);
        }
    }

    fn proofs(self, [position_jumps, torque_jumps]: [f64; 2]) -> Vec<Proof> {
        let proof = |line: Line| {
            let Line {
                proof,
                rounding,
                rate_by_duration,
                ..
            } = line;
            let steps = |jumps| playing::step_rate(proof.bound, rate_by_duration, rounding, jumps);
            let played = match proof.limited {
                Limited::PositionRate => steps(position_jumps),
                Limited::TorqueRate => steps(torque_jumps),
                _ => proof.bound + rounding,
            };
            Proof {
                played: Some(played),
                ..proof
            }
        };
        self.lines.into_iter().map(proof).collect()
    }
}
