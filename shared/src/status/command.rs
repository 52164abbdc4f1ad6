//! Commands of the executor, by name.

use serde::{Deserialize, Serialize};

use super::State;

/// What the executor can be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Command {
    /// Take a trajectory, interval by interval, into the second buffer.
    BeginLoad,
    /// Check what has come and make it the trajectory to play.
    CommitLoad,
    /// Forget what has come.
    AbortLoad,
    /// Take a whole trajectory at once, such as the stored one.
    Load,
    /// Energise the drives where they stand, and creep to the first node.
    Arm,
    /// Switch the drives off at rest.
    Disarm,
    /// Play.
    Start,
    /// Play with the drives off.
    DryRun,
    /// Slow down along the path and stand still.
    Hold,
    /// Go on after a hold.
    Resume,
    /// Play at a part of the planned speed.
    Override,
    /// Slow down along the path, then take the torque away.
    QuickStop,
    /// Leave `Fault`, and reset the drives' own faults, which they may have in any state.
    Clear,
    /// Keep the loaded trajectory over a loss of power.
    Store,
    /// Forget the stored trajectory.
    Erase,
    /// Take other limits or another configuration.
    Configure,
}

impl Command {
    /// All commands.
    pub const ALL: [Self; 16] = [
        Self::BeginLoad,
        Self::CommitLoad,
        Self::AbortLoad,
        Self::Load,
        Self::Arm,
        Self::Disarm,
        Self::Start,
        Self::DryRun,
        Self::Hold,
        Self::Resume,
        Self::Override,
        Self::QuickStop,
        Self::Clear,
        Self::Store,
        Self::Erase,
        Self::Configure,
    ];

    /// The states in which the command is taken.
    pub const fn allowed_in(self) -> &'static [State] {
        use State::{Armed, Done, Fault, Held, Holding, Idle, Loading, Ready, Running};
        match self {
            // During a move, too: what comes waits in the second buffer for its commit.
            Self::BeginLoad => &[Idle, Loading, Ready, Armed, Running, Holding, Held, Done],
            Self::CommitLoad => &[Loading, Armed, Done],
            Self::Load => &[Idle, Ready, Armed, Done],
            Self::Arm | Self::DryRun | Self::Store => &[Ready],
            Self::Disarm => &[Armed, Done],
            Self::Start => &[Armed],
            Self::Hold => &[Running, Holding, Held],
            Self::Resume => &[Holding, Held],
            // Afterwards it is as asked, whatever was before: a repetition does no harm.
            Self::AbortLoad | Self::Override | Self::QuickStop => &State::ALL,
            // With the drives off: one that came up in its fault has to be reset before it is armed.
            Self::Clear => &[Idle, Loading, Ready, Fault],
            // Writing flash stops the board's code, and other limits undo what was accepted.
            Self::Erase | Self::Configure => &[Idle, Ready],
        }
    }
}
