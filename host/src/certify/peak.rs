//! The largest magnitude of a polynomial: a bound that is proved, and a value that is reached.

use super::bernstein::Bernstein;
use super::certificate::IntervalPeak;

/// Most pieces that are looked at before a bound is taken as it is.
const MOST_PIECES: usize = 20_000;

/// Nothing is known.
pub(super) const UNKNOWN: IntervalPeak = IntervalPeak {
    bound: f64::INFINITY,
    reached: 0.0,
    local: -1.0,
};

/// Nothing has been looked at.
pub(super) const NOTHING: IntervalPeak = IntervalPeak {
    bound: 0.0,
    reached: -1.0,
    local: -1.0,
};

/// Halves the pieces of a polynomial until no bound exceeds the largest value found by more than `resolution`.
pub(super) fn peak(pieces: impl Iterator<Item = Bernstein>, resolution: f64) -> IntervalPeak {
    let mut peak = NOTHING;
    let mut open: Vec<Bernstein> = pieces.collect();
    for piece in &open {
        see_ends(&mut peak, piece);
    }
    let mut looked_at = 0;
    while let Some(piece) = open.pop() {
        let upper = piece.range().magnitude();
        if !upper.is_finite() {
            return UNKNOWN;
        }
        looked_at += 1;
        // Closer than its own rounding no bound can come.
        if upper <= peak.reached + resolution + 4.0 * piece.error() || looked_at > MOST_PIECES {
            peak.bound = peak.bound.max(upper);
            continue;
        }
        for half in piece.halves() {
            see_ends(&mut peak, &half);
            open.push(half);
        }
    }
    peak
}

fn see_ends(peak: &mut IntervalPeak, piece: &Bernstein) {
    let (from, to) = piece.span();
    for (local, value) in [(from, piece.first()), (to, piece.last())] {
        if value.mignitude() > peak.reached {
            peak.reached = value.mignitude();
            peak.local = local.clamp(-1.0, 1.0);
        }
    }
}
