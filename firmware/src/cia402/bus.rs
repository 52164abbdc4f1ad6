//! One or two CAN buses behind the `embedded-can` traits, whatever their types.
//!
//! A bus takes frames in the order of rising urgency: several controllers (bxCAN among them) refuse
//! a frame while one that is as urgent or more waits in a mailbox, because they send by urgency and
//! would otherwise mix up frames of the same identifier. So the least urgent frame is offered
//! first, and then all mailboxes fill at once.

use embedded_can::nb::Can;
use embedded_can::{Error, ErrorKind};

use super::frame::CanFrame;

/// What became of a frame that was offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sent {
    /// It waits in a mailbox, from which a less urgent one may have been displaced.
    Taken(Option<CanFrame>),
    /// There is no room for it now.
    Busy,
    /// The controller reports an error.
    Failed,
}

/// What was there to be received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Received {
    /// A frame.
    Frame(CanFrame),
    /// A frame that is none of CANopen drives.
    Foreign,
    /// Nothing.
    Nothing,
    /// Notice that frames were lost because nobody fetched them.
    Overrun,
    /// The controller reports another error.
    Failed,
}

/// The buses of a group of drives: a tuple of one or two that implement
/// [`embedded_can::nb::Can`], or an array of equal ones.
pub trait Buses {
    /// Number of buses.
    const COUNT: usize;

    /// Offers a frame to bus number `bus`, without waiting.
    fn transmit(&mut self, bus: usize, frame: &CanFrame) -> Sent;

    /// Fetches a frame from bus number `bus`, without waiting.
    fn receive(&mut self, bus: usize) -> Received;
}

impl<A: Can> Buses for (A,) {
    const COUNT: usize = 1;

    fn transmit(&mut self, bus: usize, frame: &CanFrame) -> Sent {
        match bus {
            0 => transmit(&mut self.0, frame),
            _ => Sent::Failed,
        }
    }

    fn receive(&mut self, bus: usize) -> Received {
        match bus {
            0 => receive(&mut self.0),
            _ => Received::Failed,
        }
    }
}

impl<A: Can, B: Can> Buses for (A, B) {
    const COUNT: usize = 2;

    fn transmit(&mut self, bus: usize, frame: &CanFrame) -> Sent {
        match bus {
            0 => transmit(&mut self.0, frame),
            1 => transmit(&mut self.1, frame),
            _ => Sent::Failed,
        }
    }

    fn receive(&mut self, bus: usize) -> Received {
        match bus {
            0 => receive(&mut self.0),
            1 => receive(&mut self.1),
            _ => Received::Failed,
        }
    }
}

impl<A: Can, const COUNT: usize> Buses for [A; COUNT] {
    const COUNT: usize = COUNT;

    fn transmit(&mut self, bus: usize, frame: &CanFrame) -> Sent {
        match self.get_mut(bus) {
            Some(bus) => transmit(bus, frame),
            None => Sent::Failed,
        }
    }

    fn receive(&mut self, bus: usize) -> Received {
        match self.get_mut(bus) {
            Some(bus) => receive(bus),
            None => Received::Failed,
        }
    }
}

fn transmit<C: Can>(bus: &mut C, frame: &CanFrame) -> Sent {
    let Some(frame) = frame.to::<C::Frame>() else {
        return Sent::Failed;
    };
    match bus.transmit(&frame) {
        Ok(displaced) => Sent::Taken(displaced.as_ref().and_then(CanFrame::received)),
        Err(nb::Error::WouldBlock) => Sent::Busy,
        Err(nb::Error::Other(_)) => Sent::Failed,
    }
}

fn receive<C: Can>(bus: &mut C) -> Received {
    match bus.receive() {
        Ok(frame) => CanFrame::received(&frame).map_or(Received::Foreign, Received::Frame),
        Err(nb::Error::WouldBlock) => Received::Nothing,
        Err(nb::Error::Other(error)) if error.kind() == ErrorKind::Overrun => Received::Overrun,
        Err(nb::Error::Other(_)) => Received::Failed,
    }
}
