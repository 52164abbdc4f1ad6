//! States of the executor.

use serde::{Deserialize, Serialize};

/// Where the executor is.
///
/// | state | drives | motion | left by |
/// |---|---|---|---|
/// | `Idle` | off | none | `begin_load` → `Loading`, `load` → `Ready` |
/// | `Loading` | off | none | `commit_load` → `Ready`, `abort_load` → `Ready` or `Idle` |
/// | `Ready` | off | none | `arm` → `Armed`, `begin_load` → `Loading`, a dry run → `Running` |
/// | `Armed` | on | creeps to the first node, then stands | `start` → `Running`, `disarm` → `Ready` |
/// | `Running` | on | along the path | the end → `Done`, `hold` → `Holding` |
/// | `Holding` | on | slows down along the path | standstill → `Held`, `resume` → `Running` |
/// | `Held` | on | stands on the path | `resume` → `Running` |
/// | `Done` | on | stands at the last node | `load`, `commit_load` → `Armed`, `disarm` → `Ready` |
/// | `Stopping` | on | slows down along the path | standstill → `Fault` |
/// | `Fault` | off | none commanded | `clear` → `Ready`, or `Idle` if nothing is loaded |
///
/// Every state but `Fault` goes to `Stopping` by a quick stop and to `Fault` by a
/// [`FaultCause`](super::FaultCause). In a dry run the drives are off in every state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum State {
    /// Nothing is loaded.
    Idle,
    /// A trajectory is on its way into the second buffer.
    Loading,
    /// A trajectory is loaded.
    Ready,
    /// The drives hold the first node.
    Armed,
    /// The trajectory plays.
    Running,
    /// The trajectory plays ever more slowly, to a hold.
    Holding,
    /// The drives hold a place on the path.
    Held,
    /// The drives hold the last node.
    Done,
    /// The trajectory plays ever more slowly, then the torque is taken away.
    Stopping,
    /// The torque is off until `clear`.
    Fault,
}

impl State {
    /// All states.
    pub const ALL: [Self; 10] = [
        Self::Idle,
        Self::Loading,
        Self::Ready,
        Self::Armed,
        Self::Running,
        Self::Holding,
        Self::Held,
        Self::Done,
        Self::Stopping,
        Self::Fault,
    ];

    /// Whether the drives are commanded, unless it is a dry run.
    pub const fn is_energised(self) -> bool {
        !matches!(self, Self::Idle | Self::Loading | Self::Ready | Self::Fault)
    }

    /// Whether a move has been started and has not come to its end.
    pub const fn is_under_way(self) -> bool {
        matches!(
            self,
            Self::Running | Self::Holding | Self::Held | Self::Stopping
        )
    }
}
