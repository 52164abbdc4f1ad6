//! What must hold in every tick of every test, whatever happens to drives and messages.

use std::collections::BTreeMap;

use stillpoint_firmware::cia402::{MOST_RECEIVED, MOST_SENT};

use super::wire::Wire;

/// What a drive told the board in a feedback message that the board fetched.
#[derive(Debug, Clone, Copy)]
struct Told {
    at_us: u64,
    statusword: u16,
    counts: i32,
    mode: u8,
}

impl Told {
    /// Operation enabled, in mode 8, following.
    fn confirms(&self, tells_following: bool) -> bool {
        let follows = !tells_following || self.statusword & 1 << 12 != 0;
        self.statusword & 0x6f == 0x27 && self.mode == 8 && follows
    }

    fn is_fault(&self) -> bool {
        self.statusword & 0x4f == 0x08 || self.statusword & 0x4f == 0x0f
    }
}

/// Time for which a message may have waited for the bus.
const WAITED_US: u64 = 4_000;

/// Which call was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Call {
    Exchange,
    Safe,
    Observe,
}

/// Watches one wire.
#[derive(Debug)]
pub(crate) struct Laws {
    /// Whether the drives tell in bit 12 that they follow.
    pub(crate) tells_following: bool,
    seen_taken: usize,
    seen_fetched: usize,
    told: BTreeMap<u16, Vec<Told>>,
    last_controlword: BTreeMap<u16, u16>,
    /// Rising edges of the fault reset bit by node id.
    edges: BTreeMap<u16, usize>,
    /// Fault resets that were requested.
    pub(crate) requests: usize,
    /// Messages with set-points that were checked.
    pub(crate) checked: usize,
}

impl Default for Laws {
    fn default() -> Self {
        Self {
            tells_following: true,
            seen_taken: 0,
            seen_fetched: 0,
            told: BTreeMap::new(),
            last_controlword: BTreeMap::new(),
            edges: BTreeMap::new(),
            requests: 0,
            checked: 0,
        }
    }
}

impl Laws {
    /// Checks what a call has put on the wire.
    pub(crate) fn check(&mut self, wire: &mut Wire, call: Call) {
        assert!(
            wire.frames_taken <= MOST_SENT && wire.receive_calls <= MOST_RECEIVED,
            "bounded frames per call: {} sent, {} received",
            wire.frames_taken,
            wire.receive_calls
        );
        (wire.frames_taken, wire.receive_calls) = (0, 0);

        for frame in &wire.fetched[self.seen_fetched..] {
            if let (0x181..=0x1ff, &[s0, s1, p0, p1, p2, p3, mode]) = (frame.id, frame.data()) {
                self.told.entry(frame.id - 0x180).or_default().push(Told {
                    at_us: wire.now_us,
                    statusword: u16::from_le_bytes([s0, s1]),
                    counts: i32::from_le_bytes([p0, p1, p2, p3]),
                    mode,
                });
            }
        }
        self.seen_fetched = wire.fetched.len();

        for frame in &wire.taken[self.seen_taken..] {
            if let (0x201..=0x27f, &[c0, c1, p0, p1, p2, p3, t0, t1]) = (frame.id, frame.data()) {
                let controlword = u16::from_le_bytes([c0, c1]);
                let target = i32::from_le_bytes([p0, p1, p2, p3]);
                let torque = i16::from_le_bytes([t0, t1]);
                let message = (controlword, target, torque);
                self.setpoint(frame.id - 0x200, message, wire.now_us, call);
            }
        }
        self.seen_taken = wire.taken.len();
    }

    fn setpoint(&mut self, node: u16, message: (u16, i32, i16), now_us: u64, call: Call) {
        self.checked += 1;
        let (controlword, target, torque) = message;
        let told = self.told.get(&node).map_or(&[][..], Vec::as_slice);
        // What was told in the last cycles, and before them: the message may have waited for the
        // bus.
        let older = told
            .iter()
            .rposition(|told| told.at_us + WAITED_US < now_us);
        let recent = &told[older.unwrap_or(0)..];
        assert!(!recent.is_empty(), "no set-point to a drive never heard of");
        let stays = torque == 0 && recent.iter().any(|told| told.counts == target);
        assert!(
            stays
                || recent
                    .iter()
                    .any(|told| told.confirms(self.tells_following)),
            "node {node}: motion to {target} without confirmation, {recent:?}"
        );
        assert!(
            stays || controlword == 0x0f,
            "node {node}: motion to {target}, told {controlword:#x}"
        );
        if recent.iter().all(Told::is_fault) {
            assert!(
                stays && matches!(controlword, 0x00 | 0x80),
                "node {node} is in fault and told {controlword:#x}, {target}"
            );
        }
        if call != Call::Exchange {
            assert!(
                matches!(controlword, 0x00 | 0x80) && torque == 0,
                "node {node} is told {controlword:#x} after it was made safe"
            );
        }
        let before = self.last_controlword.insert(node, controlword).unwrap_or(0);
        if controlword & !before & 0x80 != 0 {
            let edges = self.edges.entry(node).or_default();
            *edges += 1;
            assert!(
                *edges <= self.requests,
                "node {node}: reset without request"
            );
        }
    }
}
