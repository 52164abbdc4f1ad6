//! Lagrange basis of one interval in f32, evaluated in product form.
//!
//! L_j(x) = w_j · Π_{i<j}(x − x_i) · Π_{i>j}(x − x_i), from running prefix and suffix products: no
//! division and no special case when x hits a node, as it does at the start of every interval.
//! Plain multiply and add in a fixed order (never a fused multiply-add), so x86-64 and Cortex-M4F
//! give the same bits.
//!
//! The nodes are rounded to f32 first and the weights computed from the *rounded* nodes, in f64:
//! the basis then is the exact Lagrange basis of nodes 3e-8 away, instead of no basis at all.

use crate::lgr::{self, LgrError};

/// Most LGR points in one interval.
pub const MAX_POINTS: usize = 32;

/// Most support points in one interval: the LGR points and the end.
pub const MAX_SUPPORT: usize = MAX_POINTS + 1;

/// Support points and barycentric weights of one interval with N LGR points.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    nodes: [f32; MAX_SUPPORT],
    weights: [f32; MAX_SUPPORT],
    points: usize,
}

impl Basis {
    /// No points.
    pub const EMPTY: Self = Self {
        nodes: [0.0; MAX_SUPPORT],
        weights: [0.0; MAX_SUPPORT],
        points: 0,
    };

    /// The basis on N = `points` LGR points and the end, 2 ≤ N ≤ [`MAX_POINTS`].
    pub fn new(points: usize) -> Result<Self, LgrError> {
        let mut basis = Self::EMPTY;
        basis.prepare(points)?;
        Ok(basis)
    }

    /// Makes this [`Basis::new`] where it lies; empty if there is no such basis.
    pub fn prepare(&mut self, points: usize) -> Result<(), LgrError> {
        self.points = 0;
        let mut exact = [0.0; MAX_SUPPORT];
        let mut exact_weights = [0.0; MAX_SUPPORT];
        let (Some(exact), Some(exact_weights)) =
            (exact.get_mut(..=points), exact_weights.get_mut(..=points))
        else {
            return Err(LgrError::TooManyPoints {
                points,
                most: MAX_POINTS,
            });
        };
        lgr::support_nodes(exact)?;
        for (rounded, node) in self.nodes.iter_mut().zip(exact.iter_mut()) {
            *rounded = *node as f32;
            *node = f64::from(*rounded);
        }
        lgr::barycentric_weights(exact, exact_weights)?;
        for (rounded, &weight) in self.weights.iter_mut().zip(exact_weights.iter()) {
            *rounded = weight as f32;
        }
        self.points = points;
        Ok(())
    }

    /// Number N of LGR points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// The support points on [−1, 1], ascending, as evaluation uses them.
    pub fn nodes(&self) -> &[f32] {
        let support = if self.points == 0 { 0 } else { self.points + 1 };
        self.nodes.get(..support).unwrap_or_default()
    }

    /// Σ_j L_j(x) row_j for N + 1 `rows` of Q quantities × A axes each, node after node.
    ///
    /// `x` is the local coordinate on [−1, 1]. Rows that are missing count as zero, rows beyond N +
    /// 1 are not read. `after` is room for the products; to make it anew would cost a tenth of all.
    #[inline]
    pub fn evaluate<const Q: usize, const A: usize>(
        &self,
        x: f32,
        rows: &[[[f32; A]; Q]],
        after: &mut [f32; MAX_SUPPORT],
    ) -> [[f32; A]; Q] {
        let mut product = 1.0;
        for (after, node) in after.iter_mut().zip(self.nodes()).rev() {
            *after = product;
            product *= x - node;
        }
        let mut sum = [[0.0; A]; Q];
        let mut before = 1.0;
        for (((node, weight), after), row) in
            self.nodes().iter().zip(&self.weights).zip(after).zip(rows)
        {
            let cardinal = before * *after * weight;
            for (sum, value) in sum.as_flattened_mut().iter_mut().zip(row.as_flattened()) {
                *sum += cardinal * value;
            }
            before *= x - node;
        }
        sum
    }

    /// Gives `take` the index j, L_j(x) and L_j′(x) of every support point, from the last to the
    /// first.
    ///
    /// By the product rule along the running products: P′ (x − x_i) + P.
    #[inline]
    pub fn cardinals(&self, x: f32, take: impl FnMut(usize, f32, f32)) {
        self.cardinals_with(x, |value| value, take);
    }

    /// The slopes of [`Basis::cardinals`] with the magnitude of every difference and weight: nothing
    /// cancels, so that they tell how large rounding errors can be. Zero beyond the basis.
    // Rarely needed: small rather than fast.
    #[inline(never)]
    pub fn slope_sizes(&self, x: f32) -> [f32; MAX_SUPPORT] {
        let mut sizes = [0.0; MAX_SUPPORT];
        self.cardinals_with(x, f32::abs, |j, _, slope| {
            if let Some(size) = sizes.get_mut(j) {
                *size = slope;
            }
        });
        sizes
    }

    #[inline]
    fn cardinals_with(
        &self,
        x: f32,
        size: impl Fn(f32) -> f32,
        mut take: impl FnMut(usize, f32, f32),
    ) {
        let mut before = [(0.0, 0.0); MAX_SUPPORT];
        let (mut product, mut slope) = (1.0, 0.0);
        for (before, node) in before.iter_mut().zip(self.nodes()) {
            *before = (product, slope);
            let difference = size(x - node);
            slope = slope * difference + product;
            product *= difference;
        }
        let (mut product, mut slope) = (1.0, 0.0);
        let support = self.nodes().iter().zip(&self.weights).zip(&before);
        for (j, ((node, weight), before)) in support.enumerate().rev() {
            let weight = size(*weight);
            let own_slope = before.1 * product + before.0 * slope;
            take(j, before.0 * product * weight, own_slope * weight);
            let difference = size(x - node);
            slope = slope * difference + product;
            product *= difference;
        }
    }
}
