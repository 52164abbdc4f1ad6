//! What a tick says.

use stillpoint_shared::status::{Fault, LimitFlags, State};

use crate::{Feedback, Setpoint};

/// What happened in one tick: a view of the executor, so that nothing is copied that nobody reads.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TickReport<'a, const AXES: usize> {
    /// Ticks since the executor was made, this one included.
    pub tick: u64,
    /// State after the tick.
    pub state: State,
    /// Time in the trajectory that the set-points belong to, in time ticks.
    pub path_ticks: u32,
    /// Path speed of the set-points, 0 to [`FULL_SPEED`](crate::path_time::FULL_SPEED).
    pub path_speed: u32,
    /// What was sent, or would have been in a dry run; where the axes stand, if the drives are off.
    pub setpoints: &'a [Setpoint; AXES],
    /// What came back, if anything did.
    pub feedback: Option<&'a [Feedback; AXES]>,
    /// Limits in force in this tick.
    pub limited: &'a [LimitFlags; AXES],
    /// The first cause, in the states `Stopping` and `Fault`.
    pub fault: Option<Fault>,
}
