//! Which requests are obeyed: those of the open session, orders at most once and never after a
//! later one.

use stillpoint_shared::assembly::Arrived;
use stillpoint_shared::protocol::{Denial, Hello, Response, Versions};

/// Result of an order, small enough to keep for a repetition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outcome {
    Done,
    Upload(Arrived),
    Denied(Denial),
}

impl From<Outcome> for Response {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::Done,
            Outcome::Upload(arrived) => Self::Upload(arrived),
            Outcome::Denied(denial) => Self::Denied(denial),
        }
    }
}

/// What to do with an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    /// Obey it.
    Obey,
    /// Answer as before.
    Repeat(Outcome),
}

/// The open session.
#[derive(Debug)]
pub(super) struct Session {
    /// Its number; 0 if none is open.
    number: u16,
    /// The board's count of starts.
    start: u16,
    nonce: u32,
    newest: Option<u16>,
    latest_order: Option<(u16, Outcome)>,
}

/// Whether a sequence number comes after another one, modulo 2¹⁶.
const fn is_after(sequence: u16, other: u16) -> bool {
    (sequence.wrapping_sub(other) as i16) > 0
}

impl Session {
    /// No session yet since this start of the board.
    pub(super) const fn none(start: u16) -> Self {
        Self {
            number: 0,
            start,
            nonce: 0,
            newest: None,
            latest_order: None,
        }
    }

    /// Takes a greeting; returns the number of the session that it is for, 0 if there is no common
    /// version, and whether the session is a new one.
    pub(super) fn greet(&mut self, hello: &Hello) -> (u16, bool) {
        if Versions::OWN.common(hello.versions).is_none() {
            return (0, false);
        }
        if self.number != 0 && self.nonce == hello.nonce {
            return (self.number, false);
        }
        // Drawn, not counted: counts from before and after a reset meet. The multiplier (2³² by the
        // golden ratio) carries both numbers into the upper half.
        let drawn = hello.nonce.wrapping_add(u32::from(self.start) << 16);
        let mut number = (drawn.wrapping_mul(0x9e37_79b1) >> 16) as u16;
        while number == 0 || number == self.number {
            number = number.wrapping_add(1);
        }
        *self = Self {
            number,
            nonce: hello.nonce,
            ..Self::none(self.start)
        };
        (number, true)
    }

    /// Number of the open session; 0 if none is open.
    pub(super) const fn number(&self) -> u16 {
        self.number
    }

    /// Takes a request of session `named`; returns whether it is the newest so far, which a
    /// repetition, or one that was late on the line, is not.
    pub(super) fn take(&mut self, named: u16, sequence: u16) -> Result<bool, Denial> {
        if self.number == 0 || named != self.number {
            let open = self.number;
            return Err(Denial::Session { named, open });
        }
        let is_newest = self.newest.is_none_or(|newest| is_after(sequence, newest));
        if is_newest {
            self.newest = Some(sequence);
        }
        Ok(is_newest)
    }

    /// What to do with the order of this sequence number.
    pub(super) fn turn(&self, sequence: u16) -> Result<Turn, Denial> {
        match self.latest_order {
            Some((latest, outcome)) if sequence == latest => Ok(Turn::Repeat(outcome)),
            Some((latest, _)) if !is_after(sequence, latest) => {
                Err(Denial::Overtaken { sequence, latest })
            }
            _ => Ok(Turn::Obey),
        }
    }

    /// Keeps what became of an order.
    pub(super) fn obeyed(&mut self, sequence: u16, outcome: Outcome) {
        self.latest_order = Some((sequence, outcome));
    }
}
