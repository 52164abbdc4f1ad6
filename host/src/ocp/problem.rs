//! Optimal control problems in continuous time, of one phase:
//!
//! ```text
//! minimise   Φ(x(0), x(T), T) + ∫ L(x, u) dt
//! subject to ẋ = f(x, u),  bounds on x, u, on the path function p(x, u) and on the end function e(x(0), x(T), T),
//!            x(0), x(T) and T each free, bounded or fixed.
//! ```

use super::sample::Limited;
use std::fmt::Debug;

/// Lower and upper bound; equal for a fixed quantity, infinite for a free one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
}

impl Bounds {
    /// No bounds.
    pub const FREE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
    };

    /// `lower` to `upper`.
    #[must_use]
    pub const fn new(lower: f64, upper: f64) -> Self {
        Self { lower, upper }
    }

    /// Exactly `value`.
    #[must_use]
    pub const fn fixed(value: f64) -> Self {
        Self::new(value, value)
    }

    /// −`limit` to `limit`.
    #[must_use]
    pub const fn symmetric(limit: f64) -> Self {
        Self::new(-limit, limit)
    }

    /// What both allow.
    #[must_use]
    pub const fn intersect(self, other: Self) -> Self {
        Self::new(self.lower.max(other.lower), self.upper.min(other.upper))
    }

    /// How far outside a value is; 0 inside.
    #[must_use]
    pub fn violation(&self, value: f64) -> f64 {
        (self.lower - value).max(value - self.upper).max(0.0)
    }

    /// Half the distance of the bounds; the magnitude of the only one; infinite without any.
    #[must_use]
    pub fn size(&self) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => (self.upper - self.lower) / 2.0,
            (true, false) => self.lower.abs(),
            (false, true) => self.upper.abs(),
            (false, false) => f64::INFINITY,
        }
    }

    /// How far outside a value is as a share of [`Bounds::size`]; negative inside, minus infinity without bounds.
    #[must_use]
    pub fn excess(&self, value: f64) -> f64 {
        (self.lower - value).max(value - self.upper) / self.size().max(f64::MIN_POSITIVE)
    }

    /// Drawn in on each side by a share of their size.
    #[must_use]
    pub fn tightened(&self, share: f64) -> Self {
        let size = self.size();
        let by = if size.is_finite() { share * size } else { 0.0 };
        Self::new(self.lower + by, self.upper - by)
    }
}

/// Numbers of states, controls, path and end constraints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Length of x.
    pub states: usize,
    /// Length of u.
    pub controls: usize,
    /// Length of p.
    pub path: usize,
    /// Length of e.
    pub endpoint: usize,
}

impl Sizes {
    /// Variables of the stage functions: x then u.
    #[must_use]
    pub const fn stage_variables(&self) -> usize {
        self.states + self.controls
    }
    /// Values of the stage functions: f, p, L.
    #[must_use]
    pub const fn stage_values(&self) -> usize {
        self.states + self.path + 1
    }
    /// Variables of the end functions: x(0), x(T), T.
    #[must_use]
    pub const fn endpoint_variables(&self) -> usize {
        2 * self.states + 1
    }
    /// Values of the end functions: Φ, e.
    #[must_use]
    pub const fn endpoint_values(&self) -> usize {
        1 + self.endpoint
    }
}

/// Where derivatives can differ from zero: (row, column) pairs; Hessians by their lower triangle.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// Entries of the Jacobian.
    pub jacobian: Vec<(usize, usize)>,
    /// Entries of the Hessian of any combination of the rows.
    pub hessian: Vec<(usize, usize)>,
}

/// A vector function with exact derivatives, in the order of a fixed [`Structure`].
pub trait Differentiable: Send + Sync {
    /// Where its derivatives can differ from zero.
    fn structure(&self) -> &Structure;
    /// Values at `z`.
    fn values(&self, z: &[f64], out: &mut [f64]);
    /// Values, and Jacobian entries in the order of `structure().jacobian`.
    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]);
    /// Entries, in the order of `structure().hessian`, of the Hessian of `weights · values`.
    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]);
}

/// What the planner calls a quantity and how large it typically is.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name with unit.
    pub name: String,
    /// Typical magnitude, if known; otherwise scaling takes it from bounds and first guess.
    pub magnitude: Option<f64>,
    /// Bounds that hold all along.
    pub bounds: Bounds,
}

impl Quantity {
    /// A named quantity without known magnitude.
    #[must_use]
    pub fn new(name: impl Into<String>, bounds: Bounds) -> Self {
        Self {
            name: name.into(),
            magnitude: None,
            bounds,
        }
    }
}

/// An optimal control problem.
pub struct OptimalControlProblem {
    /// Numbers of everything.
    pub sizes: Sizes,
    /// (f, p, L) of (x, u).
    pub stage: Box<dyn Differentiable>,
    /// (Φ, e) of (x(0), x(T), T).
    pub endpoint: Box<dyn Differentiable>,
    /// States, with bounds.
    pub states: Vec<Quantity>,
    /// Controls, with bounds.
    pub controls: Vec<Quantity>,
    /// Path function, with bounds.
    pub path: Vec<Quantity>,
    /// Path functions that are rates of something played as a polynomial of its own, whose slope their bounds hold too.
    pub rates: Vec<usize>,
    /// Path functions that most motions stay far away from: a solver may try without them first.
    pub guards: Vec<usize>,
    /// End function, with bounds.
    pub ends: Vec<Quantity>,
    /// Bounds of x(0).
    pub initial: Vec<Bounds>,
    /// Bounds of x(T).
    pub terminal: Vec<Bounds>,
    /// Bounds of T, s.
    pub duration_s: Bounds,
}

impl OptimalControlProblem {
    /// Whether a path function depends on the control.
    pub(super) fn path_needs_control(&self, row: usize) -> bool {
        let own = self.sizes.states + row;
        let mut entries = self.stage.structure().jacobian.iter();
        entries.any(|&(r, c)| r == own && c >= self.sizes.states)
    }

    /// Everything with a finite bound that holds all along, equations not counted.
    pub(super) fn limited(&self) -> impl Iterator<Item = Limited> + '_ {
        let Sizes {
            states,
            controls,
            path,
            ..
        } = self.sizes;
        let all = (0..states).map(Limited::State);
        let all = all.chain((0..controls).map(Limited::Control));
        let all = all.chain((0..path).map(Limited::Path));
        let all = all.chain(self.rates.iter().copied().map(Limited::Slope));
        all.filter(|&limited| {
            let size = self.bounds_of(limited).size();
            size.is_finite() && size > 0.0
        })
    }

    /// Its bounds.
    pub(super) fn bounds_of(&self, limited: Limited) -> Bounds {
        self.quantity(limited).bounds
    }

    /// What it is.
    #[must_use]
    pub fn quantity(&self, limited: Limited) -> &Quantity {
        match limited {
            Limited::State(i) => &self.states[i],
            Limited::Control(i) => &self.controls[i],
            Limited::Path(i) | Limited::Slope(i) => &self.path[i],
        }
    }

    /// The same with all limits that hold all along drawn in by a share of their size.
    #[must_use]
    pub fn tightened(mut self, share: f64) -> Self {
        let quantities = self.states.iter_mut().chain(&mut self.controls);
        for quantity in quantities.chain(&mut self.path) {
            quantity.bounds = quantity.bounds.tightened(share);
        }
        self
    }
}

impl Debug for OptimalControlProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OptimalControlProblem")
            .field("sizes", &self.sizes)
            .field("states", &self.states)
            .field("controls", &self.controls)
            .field("path", &self.path)
            .field("ends", &self.ends)
            .field("initial", &self.initial)
            .field("terminal", &self.terminal)
            .field("duration_s", &self.duration_s)
            .finish_non_exhaustive()
    }
}
