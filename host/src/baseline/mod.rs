//! What a user would plan instead: a quintic or a jerk-limited S-curve along the straight line between the poses, alone or
//! with an input shaper, in the shortest duration within all limits.
//!
//! Motors follow the undeformed machine, with its torque fed forward. Shapers are tuned to the lowest frequencies of the
//! machine at the start with its motors locked. What comes out is a trajectory like any other, with a certificate.

mod name;
mod plan;

pub use name::{Baseline, BaselineError};
pub use plan::{BaselinePlan, plan_baseline};

#[cfg(test)]
mod tests;
