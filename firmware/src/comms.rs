//! Whether the host is still there. What to do if not is [`CommsPolicy`].

use stillpoint_shared::status::CommsPolicy;

/// Time since something was heard from the host, against what was agreed at start. All bytes of a
/// new one are zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommsWatch {
    policy: CommsPolicy,
    limit_ticks: u32,
    heard_tick: u64,
}

/// The host has been silent for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Silence {
    pub(crate) policy: CommsPolicy,
    pub(crate) silent_ticks: u32,
    pub(crate) limit_ticks: u32,
}

impl CommsWatch {
    pub(crate) const OFF: Self = Self {
        policy: CommsPolicy::Continue,
        limit_ticks: 0,
        heard_tick: 0,
    };

    /// Begins to watch; the start itself was heard.
    pub(crate) fn begin(policy: CommsPolicy, limit_ticks: u32, now_tick: u64) -> Self {
        Self {
            policy,
            limit_ticks,
            heard_tick: now_tick,
        }
    }

    /// Something was heard; ticks that do not come later than the last one change nothing.
    pub(crate) fn heard(&mut self, tick: u64) {
        if tick > self.heard_tick {
            self.heard_tick = tick;
        }
    }

    #[inline]
    pub(crate) fn silence(&self, now_tick: u64) -> Option<Silence> {
        if self.policy == CommsPolicy::Continue {
            return None;
        }
        let silent_ticks = now_tick.saturating_sub(self.heard_tick);
        (silent_ticks > u64::from(self.limit_ticks)).then_some(Silence {
            policy: self.policy,
            silent_ticks: u32::try_from(silent_ticks).unwrap_or(u32::MAX),
            limit_ticks: self.limit_ticks,
        })
    }
}
