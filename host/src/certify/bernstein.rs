//! Polynomials in Bernstein form, with a bound on their rounding errors.
//!
//! On a piece from a to b, with t = (x − a)/(b − a), a polynomial of degree n is Σ β_k C(n,k) tᵏ (1 − t)ⁿ⁻ᵏ. It starts at
//! β_0, ends at β_n, and never leaves the range of its coefficients: the basis is a partition of unity. Halving the piece
//! (de Casteljau) brings the coefficients towards the polynomial with the square of the piece's width. Source: Farouki, "The
//! Bernstein polynomial basis: a centennial retrospective", Computer Aided Geometric Design 29 (2012).

use crate::autodiff::Interval;
use stillpoint_shared::basis::{Basis, MAX_SUPPORT};
use stillpoint_shared::lgr::LgrError;

/// Relative error of one rounding to f64: 2⁻⁵³.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// Covers what is rounded while errors are added up.
const SLACK: f64 = 1.0 + 1e-9;

/// A polynomial on a piece of its interval.
#[derive(Clone, Debug)]
pub(super) struct Bernstein {
    /// Local coordinate where the piece starts; for people, not for proofs.
    from: f64,
    /// Width of the piece in the local coordinate.
    width: f64,
    degree: usize,
    coefficients: [f64; MAX_SUPPORT],
    /// No coefficient is further than this from the exact one.
    error: f64,
}

impl Bernstein {
    fn coefficients(&self) -> &[f64] {
        &self.coefficients[..=self.degree]
    }

    fn largest(&self) -> f64 {
        self.coefficients()
            .iter()
            .fold(0.0, |largest, beta| beta.abs().max(largest))
    }

    /// All values on the piece are among these.
    pub(super) fn range(&self) -> Interval {
        let betas = self.coefficients();
        let low = betas.iter().copied().fold(f64::INFINITY, f64::min);
        let high = betas.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if betas.iter().any(|beta| beta.is_nan()) {
            return Interval::ENTIRE;
        }
        Interval::new(low, high).widened(self.error)
    }

    /// Value at the start of the piece.
    pub(super) fn first(&self) -> Interval {
        Interval::point(self.coefficients[0]).widened(self.error)
    }

    /// Value at the end of the piece.
    pub(super) fn last(&self) -> Interval {
        Interval::point(self.coefficients[self.degree]).widened(self.error)
    }

    /// Start and end of the piece in the local coordinate.
    pub(super) fn span(&self) -> (f64, f64) {
        (self.from, self.from + self.width)
    }

    /// Width of the piece in the local coordinate; exact up to one rounding of the first piece's.
    pub(super) fn width(&self) -> f64 {
        self.width
    }

    /// Error bound of every coefficient.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// Both halves of the piece, by de Casteljau: every step is a mean, with one rounding.
    pub(super) fn halves(&self) -> [Self; 2] {
        let n = self.degree;
        let error = (self.error + n as f64 * ROUNDING * self.largest()) * SLACK;
        let width = 0.5 * self.width;
        let mut left = Self {
            width,
            error,
            ..self.clone()
        };
        let mut right = Self {
            from: self.from + width,
            ..left.clone()
        };
        for step in 1..=n {
            for k in 0..=n - step {
                right.coefficients[k] =
                    0.5 * right.coefficients[k] + 0.5 * right.coefficients[k + 1];
            }
            left.coefficients[step] = right.coefficients[0];
        }
        [left, right]
    }

    /// The derivative with respect to the local coordinate: n (β_{k+1} − β_k) / width.
    pub(super) fn derivative(&self) -> Self {
        let degree = self.degree.saturating_sub(1);
        let per_width = self.degree as f64 / self.width;
        let mut derivative = Self {
            degree,
            ..self.clone()
        };
        for (slope, pair) in derivative
            .coefficients
            .iter_mut()
            .zip(self.coefficients().windows(2))
        {
            *slope = (pair[1] - pair[0]) * per_width;
        }
        if self.degree == 0 {
            derivative.coefficients[0] = 0.0;
        }
        // Difference, width, quotient and product: four roundings of the result.
        derivative.error =
            (2.0 * per_width * self.error + 5.0 * ROUNDING * derivative.largest()) * SLACK;
        derivative
    }

    /// `own` times this and `others` times another polynomial of equal degree on the same piece; the factors may have been
    /// rounded three times each.
    pub(super) fn combined(&self, own: f64, other: &Self, others: f64) -> Self {
        let mut sum = self.clone();
        for (a, b) in sum.coefficients.iter_mut().zip(&other.coefficients) {
            *a = own * *a + others * b;
        }
        let size = own.abs() * self.largest() + others.abs() * other.largest();
        let error = own.abs() * self.error + others.abs() * other.error;
        sum.error = (error + 6.0 * ROUNDING * size) * SLACK;
        sum
    }

    /// This times a number.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        self.combined(factor, self, 0.0)
    }
}

/// The way from values at the support points to Bernstein form, on pieces of [−1, 1].
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    points: usize,
    pieces: Vec<Piece>,
}

#[derive(Clone, Debug)]
struct Piece {
    from: f64,
    width: f64,
    /// Row k: coefficient k of every Lagrange polynomial, and how far the exact one may be from it.
    rows: Vec<Vec<(f64, f64)>>,
}

/// A quantity of one interval.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    /// Piece by piece.
    pub(super) pieces: Vec<Bernstein>,
    /// Bound on Σ_j |L_j(x)| |c_j|, on which rounding in an evaluation depends.
    pub(super) absolute: f64,
}

impl Pieces {
    /// For N = `points` LGR points and the end, rounded to f32 as the board evaluates them.
    ///
    /// The pieces are narrow at the ends (the angles of their edges are evenly spaced), where Lagrange polynomials vary
    /// fast, so that no coefficient is much larger than the values; the edges −1, 0 and 1 are exact.
    pub(super) fn new(points: usize) -> Result<Self, LgrError> {
        let basis = Basis::new(points)?;
        let nodes: Vec<f64> = basis.nodes().iter().map(|&x| f64::from(x)).collect();
        let edge = |k: usize| {
            if k == points {
                1.0
            } else {
                -(std::f64::consts::PI * k as f64 / points as f64).cos()
            }
        };
        let pieces = (0..points).map(|k| Piece::new(edge(k), edge(k + 1), &nodes));
        Ok(Self {
            points,
            pieces: pieces.collect(),
        })
    }

    /// Number N of LGR points.
    pub(super) fn points(&self) -> usize {
        self.points
    }

    /// The polynomial through `values` at the N + 1 support points.
    pub(super) fn channel(&self, values: &[f64]) -> Channel {
        let mut absolute: f64 = 0.0;
        let pieces = self.pieces.iter().map(|piece| {
            let (polynomial, most) = piece.polynomial(values);
            absolute = absolute.max(most);
            polynomial
        });
        let pieces = pieces.collect();
        Channel { pieces, absolute }
    }
}

impl Piece {
    fn new(from: f64, to: f64, nodes: &[f64]) -> Self {
        let n = nodes.len() - 1;
        let at = |x: f64, node: f64| Interval::point(x) - Interval::point(node);
        let mut rows = vec![Vec::with_capacity(n + 1); n + 1];
        for (j, &own) in nodes.iter().enumerate() {
            // Π (x − x_i)/(x_j − x_i), factor by factor, in (1 − t) and t: C(n,k) β_k.
            let mut product = vec![Interval::point(1.0)];
            for (_, &other) in nodes.iter().enumerate().filter(|&(i, _)| i != j) {
                let scale = at(own, other).recip();
                let (start, end) = (at(from, other) * scale, at(to, other) * scale);
                let mut next = vec![Interval::point(0.0); product.len() + 1];
                for (k, &factor) in product.iter().enumerate() {
                    next[k] = next[k] + factor * start;
                    next[k + 1] = next[k + 1] + factor * end;
                }
                product = next;
            }
            let mut binomial = 1.0;
            for (k, (row, scaled)) in rows.iter_mut().zip(product).enumerate() {
                let beta = scaled * Interval::point(binomial).recip();
                row.push((beta.middle(), beta.radius()));
                // Whole numbers below 2⁵³: exact.
                binomial = binomial * (n - k) as f64 / (k + 1) as f64;
            }
        }
        Self {
            from,
            width: to - from,
            rows,
        }
    }

    /// The polynomial and a bound on Σ |L_j| |c_j| on this piece.
    fn polynomial(&self, values: &[f64]) -> (Bernstein, f64) {
        let degree = self.rows.len() - 1;
        let mut coefficients = [0.0; MAX_SUPPORT];
        let (mut uncertain, mut absolute) = (0.0_f64, 0.0_f64);
        for (beta, row) in coefficients.iter_mut().zip(&self.rows) {
            let (mut sum, mut doubt, mut size) = (0.0, 0.0, 0.0);
            for (&(middle, radius), value) in row.iter().zip(values) {
                sum += middle * value;
                doubt += radius * value.abs();
                size += middle.abs() * value.abs();
            }
            *beta = sum;
            uncertain = uncertain.max(doubt);
            absolute = absolute.max(size);
        }
        let rounding = (degree + 2) as f64 * ROUNDING * absolute;
        let polynomial = Bernstein {
            from: self.from,
            width: self.width,
            degree,
            coefficients,
            error: (uncertain + rounding) * SLACK,
        };
        (polynomial, (absolute + uncertain) * SLACK)
    }
}
