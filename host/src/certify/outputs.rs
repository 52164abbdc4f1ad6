//! Bounds on the machine's outputs: functions of polynomials, enclosed with their derivatives.
//!
//! On a piece with centre c and half-width r, f(c) and f′(c) are enclosed tightly, and f″/2 over the whole piece; then
//! |f(c + d)| ≤ |f(c)| + max over |d| ≤ r of (|f′(c)| |d| + ±f″/2 d²) by Taylor's theorem. The excess of this bound falls with
//! the third power of r, so a few pieces are enough. The plain range over the piece is taken where it is smaller.

use super::bernstein::{Bernstein, Pieces};
use super::certificate::{IntervalPeak, Limited, Proof};
use super::coordinates::Coordinates;
use super::peak::{NOTHING, UNKNOWN, peak};
use crate::autodiff::{Interval, Taylor};
use crate::machine::{OutputForm, Plant};
use stillpoint_shared::Trajectory;

/// Share of a limit to which the bound is brought close to the largest value: of a polynomial, of another function.
const RESOLUTION: f64 = 1e-7;
const COARSE: f64 = 1e-5;

/// Most pieces of an interval that are looked at before a bound is taken as it is.
const MOST_PIECES: usize = 2_000;

/// Proofs of all limits on outputs; `limits` has an entry for each output.
pub(super) fn prove(
    trajectory: &Trajectory,
    pieces: &[Pieces],
    coordinates: &Coordinates,
    plant: &dyn Plant,
    limits: &[Option<f64>],
) -> Vec<Proof> {
    let outputs = plant.outputs();
    let described = outputs.iter().zip(limits).enumerate();
    let mut proofs: Vec<Proof> = described
        .filter_map(|(index, (output, limit))| {
            let (name, unit) = (output.key.to_owned(), output.unit);
            Some(Proof::new(Limited::Output, index, name, unit, (*limit)?))
        })
        .collect();
    let general = |proof: &Proof| outputs[usize::from(proof.index)].form == OutputForm::General;
    let count = usize::from(coordinates.count);
    let mut rest = coordinates.values.as_slice();
    for interval in trajectory.intervals() {
        let Some(pieces) = pieces.iter().find(|p| p.points() == interval.points) else {
            continue;
        };
        let (own, after) = rest.split_at((interval.points + 1) * count);
        rest = after;
        let polynomials: Vec<Vec<Bernstein>> = (0..count)
            .map(|i| {
                let values = own.iter().skip(i).step_by(count).map(|&q| f64::from(q));
                pieces.channel(&values.collect::<Vec<_>>()).pieces
            })
            .collect();
        let limits = proofs.iter().filter(|proof| general(proof));
        let wanted: Vec<(usize, f64)> = limits
            .map(|proof| (usize::from(proof.index), proof.limit))
            .collect();
        let mut others = general_peaks(&polynomials, plant, &wanted).into_iter();
        for proof in &mut proofs {
            let found = match outputs[usize::from(proof.index)].form {
                OutputForm::Proportional { coordinate, gain } => {
                    let scaled = polynomials[coordinate].iter().map(|p| p.scaled(gain));
                    peak(scaled, RESOLUTION * proof.limit)
                }
                OutputForm::General => others.next().unwrap_or(UNKNOWN),
            };
            proof.take(&interval, found);
        }
    }
    proofs
}

/// Peaks over one interval of the outputs `wanted`: each an index and a limit.
fn general_peaks(
    polynomials: &[Vec<Bernstein>],
    plant: &dyn Plant,
    wanted: &[(usize, f64)],
) -> Vec<IntervalPeak> {
    let mut peaks = vec![NOTHING; wanted.len()];
    if wanted.is_empty() {
        return peaks;
    }
    let count = polynomials.first().map_or(0, Vec::len);
    let mut open: Vec<Vec<Bernstein>> = (0..count)
        .map(|k| polynomials.iter().map(|pieces| pieces[k].clone()).collect())
        .collect();
    let mut looked_at = 0;
    while let Some(piece) = open.pop() {
        looked_at += 1;
        let halves: Vec<[Bernstein; 2]> = piece.iter().map(Bernstein::halves).collect();
        let (centre, whole) = enclosures(&piece, &halves);
        let (centre, whole) = (
            plant.output_enclosures(&centre),
            plant.output_enclosures(&whole),
        );
        let [first, ..] = piece.as_slice() else {
            break;
        };
        let (radius, middle) = (0.5 * first.width(), halves[0][0].span().1);
        let mut close = true;
        for (peak, &(output, limit)) in peaks.iter_mut().zip(wanted) {
            let reached = centre[output].value.mignitude();
            if reached > peak.reached {
                peak.reached = reached;
                peak.local = middle;
            }
            let upper = upper(&centre[output], &whole[output], radius);
            let near = upper <= peak.reached + COARSE * limit;
            close &= near;
        }
        if close || looked_at + open.len() > MOST_PIECES {
            for (peak, &(output, _)) in peaks.iter_mut().zip(wanted) {
                peak.bound = peak
                    .bound
                    .max(upper(&centre[output], &whole[output], radius));
            }
            continue;
        }
        let (left, right) = halves.into_iter().map(|[l, r]| (l, r)).unzip();
        open.push(left);
        open.push(right);
    }
    peaks
}

/// Value and derivatives of every coordinate at the centre of a piece, and over all of it. The second derivative at the
/// centre is that over the piece.
fn enclosures(piece: &[Bernstein], halves: &[[Bernstein; 2]]) -> (Vec<Taylor>, Vec<Taylor>) {
    let pairs = piece.iter().zip(halves).map(|(whole, [left, _])| {
        let slope = whole.derivative();
        let curve = slope.derivative().range() * 0.5;
        let at_centre = Taylor {
            value: left.last(),
            slope: left.derivative().last(),
            curve,
        };
        let all_over = Taylor {
            value: whole.range(),
            slope: slope.range(),
            curve,
        };
        (at_centre, all_over)
    });
    pairs.unzip()
}

/// Bound on |f| over a piece of half-width `radius`.
fn upper(centre: &Taylor, whole: &Taylor, radius: f64) -> f64 {
    let slope = Interval::point(centre.slope.magnitude());
    let radius = Interval::point(radius.next_up());
    let above = |value: f64, curve: f64| {
        let at_end = slope * radius + Interval::point(curve) * radius * radius;
        let vertex = slope * Interval::point(-2.0 * curve).recip();
        // The parabola turns down inside the piece: its top.
        let grown = if curve < 0.0 && vertex.low < radius.high {
            slope * vertex * 0.5
        } else {
            at_end
        };
        (Interval::point(value) + grown).high.max(value)
    };
    let greatest = above(centre.value.high, whole.curve.high);
    let least = above(-centre.value.low, -whole.curve.low);
    greatest.max(least).min(whole.value.magnitude())
}
