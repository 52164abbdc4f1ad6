//! What can go wrong between this program and a board.

use super::TransportError;
use std::time::Duration;
use stillpoint_shared::protocol::{Denial, Versions};

/// What went wrong between this program and a board.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The way to the board is gone.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Nobody answers the greeting.
    #[error(
        "the board does not answer ({attempts} greetings in {:.1} s, {damaged} damaged frames came): \
         check that it runs, that nobody else is connected to it, its port, its rate and its wiring", waited.as_secs_f64()
    )]
    Silent {
        /// Greetings sent.
        attempts: u32,
        /// Time waited.
        waited: Duration,
        /// Damaged frames received meanwhile.
        damaged: u64,
    },
    /// Board and host speak different versions.
    #[error(
        "the board ({board} {firmware}) speaks protocol {theirs}, this program {ours}: {}",
        remedy(ours, theirs)
    )]
    Versions {
        /// Kind of the board.
        board: String,
        /// Version of its firmware.
        firmware: String,
        /// What the board speaks.
        theirs: Versions,
        /// What this program speaks.
        ours: Versions,
    },
    /// A request was never answered.
    #[error(
        "the board did not answer {attempts} times within {:.1} s; whether it obeyed is not known: look at its status",
        waited.as_secs_f64()
    )]
    Unanswered {
        /// Times the request was sent.
        attempts: u32,
        /// Time waited.
        waited: Duration,
    },
    /// The program was told to end while it waited.
    #[error("interrupted")]
    Interrupted,
    /// The session ended while an order was under way.
    #[error(
        "the board was restarted or somebody else has connected to it ({denial}); whether it obeyed is not known: look at its status"
    )]
    SessionLost {
        /// What the board said.
        denial: Denial,
    },
    /// The board refuses.
    #[error("{0}")]
    Denied(Denial),
    /// The board answers something else than was asked for.
    #[error("the board gave an answer that does not fit `{request}`: update the older side")]
    Unexpected {
        /// The request.
        request: &'static str,
    },
    /// The request is too long for a frame.
    #[error("the request `{request}` does not fit a frame: give fewer values")]
    TooLong {
        /// The request.
        request: &'static str,
    },
}

impl DeviceError {
    /// Whether the board was not heard, so that it may be there again on a new connection.
    #[must_use]
    pub fn is_out_of_reach(&self) -> bool {
        matches!(
            self,
            Self::Transport(_) | Self::Unanswered { .. } | Self::Silent { .. }
        )
    }
}

/// Which side to update.
fn remedy(ours: &Versions, theirs: &Versions) -> &'static str {
    if theirs.newest < ours.oldest {
        "update the board's firmware"
    } else if theirs.oldest > ours.newest {
        "update this program"
    } else {
        "the message types differ though the number is the same: build both sides from the same source"
    }
}
