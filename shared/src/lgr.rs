//! Legendre–Gauss–Radau collocation in f64: points, quadrature weights, barycentric weights,
//! differentiation.
//!
//! The N LGR points are the roots of P_N + P_{N−1} on [−1, 1), −1 included. States are interpolated
//! through these and +1, the N + 1 *support points*, so the differentiation matrix D has N rows and
//! N + 1 columns. Only + − × ÷: host and board compute the same numbers.
//!
//! Source: Garg, Patterson, Hager, Rao, Benson, Huntington, "A unified framework for the numerical
//! solution of optimal control problems using pseudospectral methods", Automatica 46 (2010).

use core::fmt;

/// Why a basis could not be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LgrError {
    /// Fewer points were asked for than the rule has.
    TooFewPoints {
        /// Points asked for.
        points: usize,
        /// Fewest points possible.
        least: usize,
    },
    /// More points were asked for than the board's evaluation holds.
    TooManyPoints {
        /// Points asked for.
        points: usize,
        /// Most points possible.
        most: usize,
    },
    /// A slice has the wrong length.
    Length {
        /// Length given.
        found: usize,
        /// Length needed.
        expected: usize,
    },
    /// A row was asked for that D does not have.
    Row {
        /// Row asked for.
        row: usize,
        /// Number of rows.
        rows: usize,
    },
}

impl fmt::Display for LgrError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooFewPoints { points, least } => {
                write!(
                    f,
                    "{points} collocation points are too few: use at least {least}"
                )
            }
            Self::TooManyPoints { points, most } => {
                write!(
                    f,
                    "{points} collocation points are too many: use at most {most}"
                )
            }
            Self::Length { found, expected } => {
                write!(
                    f,
                    "a slice of length {found} was given: it must have length {expected}"
                )
            }
            Self::Row { row, rows } => {
                write!(
                    f,
                    "row {row} was asked for: the matrix has rows 0 to {}",
                    rows.saturating_sub(1)
                )
            }
        }
    }
}

impl core::error::Error for LgrError {}

fn expect_length(found: usize, expected: usize) -> Result<(), LgrError> {
    if found == expected {
        Ok(())
    } else {
        Err(LgrError::Length { found, expected })
    }
}

/// (P_{n−1}(x), P_n(x)) for n ≥ 1, by the three-term recurrence k P_k = (2k − 1) x P_{k−1} − (k −
/// 1) P_{k−2}.
fn legendre_pair(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut last) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, last) = (last, ((2.0 * k - 1.0) * x * last - (k - 1.0) * before) / k);
    }
    (before, last)
}

/// cos x for 0 ≤ x ≤ 2π / 3 by its Taylor series, whose rest is below 1e-16 there. The cosine of
/// `libm`, made for any angle, takes 5 kB of a board's flash.
fn cosine(x: f64) -> f64 {
    let square = x * x;
    // 1 − x²/(1·2) (1 − x²/(3·4) (1 − …))
    (1..=12).rev().fold(1.0, |rest, k| {
        let k = f64::from(2 * k);
        1.0 - square / ((k - 1.0) * k) * rest
    })
}

/// Fills `nodes` with the N LGR points, ascending from −1, where N ≥ 2 is the slice's length.
///
/// Newton on f = P_N + P_{N−1}, whose derivative is N (P_{N−1} − P_N) / (1 − x), from the
/// Chebyshev–Gauss–Radau points −cos(2πk / (2N − 1)), by cos (k + 1)θ = 2 cos θ cos kθ − cos (k −
/// 1)θ. It converges quadratically; the loop is bounded all the same.
pub fn lgr_nodes(nodes: &mut [f64]) -> Result<(), LgrError> {
    const NEWTON_STEPS: usize = 12;
    let n = nodes.len();
    if n < 2 {
        return Err(LgrError::TooFewPoints {
            points: n,
            least: 2,
        });
    }
    let step_cosine = cosine(2.0 * core::f64::consts::PI / (2 * n - 1) as f64);
    let (mut before, mut guess) = (step_cosine, 1.0);
    for (k, node) in nodes.iter_mut().enumerate() {
        if k == 0 {
            *node = -1.0;
            continue;
        }
        (before, guess) = (guess, 2.0 * step_cosine * guess - before);
        let mut x = -guess;
        for _ in 0..NEWTON_STEPS {
            let (before, last) = legendre_pair(n, x);
            let step = (1.0 - x) * (before + last) / (n as f64 * (before - last));
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        *node = x;
    }
    Ok(())
}

/// Fills `nodes` with the N + 1 support points: the LGR points and +1. The slice's length is N + 1
/// ≥ 3.
pub fn support_nodes(nodes: &mut [f64]) -> Result<(), LgrError> {
    match nodes.split_last_mut() {
        Some((end, points)) => {
            lgr_nodes(points)?;
            *end = 1.0;
            Ok(())
        }
        None => Err(LgrError::TooFewPoints {
            points: 0,
            least: 2,
        }),
    }
}

/// Fills `weights` with the quadrature weights of the N LGR points in `nodes` (their sum is 2).
///
/// 2 / N² at −1, else (1 − x) / (N² P_{N−1}(x)²).
pub fn lgr_weights(nodes: &[f64], weights: &mut [f64]) -> Result<(), LgrError> {
    let n = nodes.len();
    expect_length(weights.len(), n)?;
    let square = (n * n) as f64;
    for (k, (weight, &x)) in weights.iter_mut().zip(nodes).enumerate() {
        let (before, _) = legendre_pair(n, x);
        *weight = if k == 0 {
            2.0 / square
        } else {
            (1.0 - x) / (square * before * before)
        };
    }
    Ok(())
}

/// Fills `weights` with the barycentric weights 1 / Π_{i≠j} (x_j − x_i) of distinct `nodes`,
/// unscaled: the Lagrange basis is L_j(x) = w_j Π_{i≠j} (x − x_i).
pub fn barycentric_weights(nodes: &[f64], weights: &mut [f64]) -> Result<(), LgrError> {
    expect_length(weights.len(), nodes.len())?;
    for (j, (weight, &own)) in weights.iter_mut().zip(nodes).enumerate() {
        let others = nodes.iter().enumerate().filter(|&(i, _)| i != j);
        *weight = 1.0 / others.fold(1.0, |product, (_, &other)| product * (own - other));
    }
    Ok(())
}

/// Fills `row` with row i of the differentiation matrix: Σ_j D_ij f(x_j) is f′(x_i) of the
/// polynomial through the nodes.
///
/// `nodes`, `weights` (barycentric) and `row` have the same length. D_ij = (w_j / w_i) / (x_i −
/// x_j); the diagonal is minus the sum of the rest, so that a constant has derivative zero to
/// rounding.
pub fn differentiation_row(
    nodes: &[f64],
    weights: &[f64],
    i: usize,
    row: &mut [f64],
) -> Result<(), LgrError> {
    expect_length(weights.len(), nodes.len())?;
    expect_length(row.len(), nodes.len())?;
    let (Some(&own), Some(&own_weight)) = (nodes.get(i), weights.get(i)) else {
        return Err(LgrError::Row {
            row: i,
            rows: nodes.len(),
        });
    };
    let mut sum = 0.0;
    for (j, ((entry, &node), &weight)) in row.iter_mut().zip(nodes).zip(weights).enumerate() {
        *entry = if j == i {
            0.0
        } else {
            weight / own_weight / (own - node)
        };
        sum += *entry;
    }
    if let Some(diagonal) = row.get_mut(i) {
        *diagonal = -sum;
    }
    Ok(())
}

/// Fills `matrix` (row-major, N × (N + 1)) with the LGR differentiation matrix on the N + 1 support
/// `nodes` with their barycentric `weights`.
pub fn differentiation_matrix(
    nodes: &[f64],
    weights: &[f64],
    matrix: &mut [f64],
) -> Result<(), LgrError> {
    let support = nodes.len();
    let Some(points) = support.checked_sub(1).filter(|&points| points >= 2) else {
        return Err(LgrError::TooFewPoints {
            points: support.saturating_sub(1),
            least: 2,
        });
    };
    expect_length(matrix.len(), points * support)?;
    for (i, row) in matrix.chunks_exact_mut(support).enumerate() {
        differentiation_row(nodes, weights, i, row)?;
    }
    Ok(())
}
