//! What a start says, and what happens when the host falls silent.

use serde::{Deserialize, Serialize};

use super::Refusal;

/// What to do when nothing has been heard from the host for too long during a move.
///
/// | state | `Continue` | `Hold` | `QuickStop` |
/// |---|---|---|---|
/// | `Running` | – | `Holding` | `Stopping` |
/// | `Holding`, `Held` | – | – | `Stopping` |
/// | `Done` | – | – | `Stopping`: at rest already, so the torque goes at once |
/// | `Stopping` | – | – | – |
/// | all others | – | – | – (nothing has been started: the drives are off or stand) |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CommsPolicy {
    /// Play on.
    Continue,
    /// Hold on the path; `resume` goes on.
    #[default]
    Hold,
    /// Slow down along the path, then take the torque away.
    QuickStop,
}

/// What a start has to say: which move, for which machine, and what to do without the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StartRequest {
    /// Content hash of the trajectory meant.
    pub trajectory_hash: u64,
    /// Hash of the limits meant.
    pub limits_hash: u64,
    /// What to do when the host falls silent.
    pub comms: CommsPolicy,
    /// Longest silence of the host in drive ticks, at least 1; not used with
    /// [`CommsPolicy::Continue`].
    pub comms_timeout_ticks: u32,
    /// Whether to play with the drives off.
    pub dry_run: bool,
}

impl StartRequest {
    /// Whether the request means the trajectory that is loaded and the machine's limits, by their hashes, and says how
    /// long the host may be silent.
    pub fn check(&self, loaded: u64, machine: u64) -> Result<(), Refusal> {
        if self.trajectory_hash != loaded {
            return Err(Refusal::OtherTrajectory {
                quoted: self.trajectory_hash,
                loaded,
            });
        }
        if self.limits_hash != machine {
            return Err(Refusal::OtherLimits {
                quoted: self.limits_hash,
                machine,
            });
        }
        if self.comms != CommsPolicy::Continue && self.comms_timeout_ticks == 0 {
            return Err(Refusal::NoCommsTimeout);
        }
        Ok(())
    }
}

/// Why a move is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum HoldReason {
    /// It was told to.
    Command,
    /// Nothing was heard from the host, and the policy chosen at start is to hold.
    CommsLost,
}
