//! Sending: what waits in the outboxes is offered to the bus, the least urgent frame first.

use super::axis::Axis;
use super::bus::{Buses, Sent};
use super::frame::{self, CanFrame};
use super::nmt::OPERATIONAL_HEARTBEAT;
use super::report::Traffic;

/// Most frames given to a bus in a tick, and again when the drives are made safe: as many as bxCAN
/// has mailboxes.
pub const MOST_SENT: usize = 3;

/// What one bus keeps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Line {
    pub(super) sync_waits: bool,
    pub(super) heartbeat_waits: bool,
    /// Tick of the last SYNC that was sent, and how many ticks ago that was.
    pub(super) last_sync: Option<(u32, u16)>,
    pub(super) traffic: Traffic,
    /// Axis that sent an SDO request last.
    last_asked: usize,
}

/// Frames that are offered in one go.
pub(super) struct Round<'a, B> {
    pub(super) buses: &'a mut B,
    pub(super) bus: usize,
    pub(super) line: &'a mut Line,
    pub(super) axes: &'a mut [Axis],
    /// Axes in the order of falling node ids.
    pub(super) by_urgency: &'a [usize],
    pub(super) controller_node: u8,
    pub(super) tick: u32,
}

impl<B: Buses> Round<'_, B> {
    /// Offers what waits, [`MOST_SENT`] frames at most; heartbeat and SDO, one request, only if
    /// there is `leisure`.
    pub(super) fn run(mut self, leisure: bool) {
        let (mut offered, mut left) = (false, MOST_SENT);
        let mut offer = |round: &mut Self, id: u16, data: &[u8]| {
            let taken = left > 0 && round.offer(&CanFrame::new(id, data));
            offered = true;
            left -= usize::from(taken);
            taken
        };

        if leisure {
            let id = frame::HEARTBEAT + u16::from(self.controller_node);
            if self.line.heartbeat_waits && offer(&mut self, id, &OPERATIONAL_HEARTBEAT) {
                self.line.heartbeat_waits = false;
            }
            if let Some((index, node, request)) = self.next_request()
                && offer(&mut self, frame::SDO_REQUEST + node, &request)
            {
                self.line.last_asked = index;
                self.outbox(index, |outbox| outbox.sdo = None);
            }
        }
        for &index in self.by_urgency {
            if let Some((axis, node)) = self.axis(index)
                && let Some(message) = axis.outbox.setpoint
                && offer(&mut self, frame::RPDO1 + node, &message)
            {
                self.outbox(index, |outbox| outbox.setpoint = None);
            }
        }
        if self.line.sync_waits && offer(&mut self, frame::SYNC, &[]) {
            self.line.sync_waits = false;
            self.line.last_sync = Some((self.tick, 0));
        }
        for index in 0..self.axes.len() {
            if let Some((axis, _)) = self.axis(index)
                && let Some(message) = axis.outbox.nmt
                && offer(&mut self, frame::NMT, &message)
            {
                self.outbox(index, |outbox| outbox.nmt = None);
            }
        }

        let traffic = &mut self.line.traffic;
        if left < MOST_SENT {
            traffic.blocked_ticks = 0;
        } else if offered {
            traffic.blocked_ticks = traffic.blocked_ticks.saturating_add(1);
        }
    }

    /// Offers one frame; true if it was taken. One that was displaced goes back to where it waited.
    fn offer(&mut self, frame: &CanFrame) -> bool {
        match self.buses.transmit(self.bus, frame) {
            Sent::Taken(displaced) => {
                self.line.traffic.sent = self.line.traffic.sent.wrapping_add(1);
                if let Some(frame) = displaced {
                    self.line.traffic.sent = self.line.traffic.sent.wrapping_sub(1);
                    self.restore(&frame);
                }
                true
            }
            Sent::Busy => false,
            Sent::Failed => {
                self.line.traffic.errors = self.line.traffic.errors.wrapping_add(1);
                false
            }
        }
    }

    /// Lets a displaced frame wait again, unless a newer one of its kind does. SYNC and network
    /// management are too urgent to be displaced.
    fn restore(&mut self, frame: &CanFrame) {
        if frame.id() == frame::HEARTBEAT + u16::from(self.controller_node) {
            self.line.heartbeat_waits = true;
        }
        let data = <[u8; 8]>::try_from(frame.data());
        for index in 0..self.axes.len() {
            let Some((_, node)) = self.axis(index) else {
                continue;
            };
            self.outbox(index, |outbox| {
                let slot = match frame.id().checked_sub(node) {
                    Some(frame::RPDO1) => &mut outbox.setpoint,
                    Some(frame::SDO_REQUEST) => &mut outbox.sdo,
                    _ => return,
                };
                *slot = slot.or(data.ok());
            });
        }
    }

    /// Index, node id and bytes of the SDO request whose turn it is: the drives take turns.
    fn next_request(&self) -> Option<(usize, u16, [u8; 8])> {
        let after = self.line.last_asked + 1;
        (after..self.axes.len()).chain(0..after).find_map(|index| {
            let (axis, node) = self.axis(index)?;
            Some((index, node, axis.outbox.sdo?))
        })
    }

    /// An axis, if it is on this bus, and its node id.
    fn axis(&self, index: usize) -> Option<(&Axis, u16)> {
        let axis = self.axes.get(index)?;
        let here = usize::from(axis.drive.bus) == self.bus;
        here.then_some((axis, u16::from(axis.drive.node)))
    }

    fn outbox(&mut self, index: usize, change: impl FnOnce(&mut super::axis::Outbox)) {
        if let Some(axis) = self.axes.get_mut(index) {
            change(&mut axis.outbox);
        }
    }
}

/// Axes in the order of falling node ids, which is that of rising urgency.
pub(super) fn by_urgency<const N: usize>(nodes: [u8; N]) -> [usize; N] {
    let mut order = [0; N];
    for (axis, node) in nodes.iter().enumerate() {
        let key = (*node, axis);
        let before = nodes
            .iter()
            .enumerate()
            .filter(|(other, node)| (**node, *other) > key)
            .count();
        if let Some(place) = order.get_mut(before) {
            *place = axis;
        }
    }
    order
}
