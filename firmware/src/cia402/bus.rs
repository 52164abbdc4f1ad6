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

/// A CAN controller that can take a frame back.
pub trait Controller: Can {
    /// Takes the frames with this identifier back that wait in a mailbox. One that is on the wire
    /// may still arrive.
    fn take_back(&mut self, id: u16);
}

/// The buses of a group of drives: a tuple of one or two [`Controller`]s, or an array of equal ones.
pub trait Buses {
    /// Number of buses.
    const COUNT: usize;

    /// Offers a frame to bus number `bus`, without waiting.
    fn transmit(&mut self, bus: usize, frame: &CanFrame) -> Sent;

    /// Fetches a frame from bus number `bus`, without waiting.
    fn receive(&mut self, bus: usize) -> Received;

    /// Takes the frames with this identifier back that wait in a mailbox of bus number `bus`.
    fn take_back(&mut self, bus: usize, id: u16);
}

impl<A: Controller> Buses for (A,) {
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

    fn take_back(&mut self, bus: usize, id: u16) {
        if bus == 0 {
            self.0.take_back(id);
        }
    }
}

impl<A: Controller, B: Controller> Buses for (A, B) {
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

    fn take_back(&mut self, bus: usize, id: u16) {
        match bus {
            0 => self.0.take_back(id),
            1 => self.1.take_back(id),
            _ => {}
        }
    }
}

impl<A: Controller, const COUNT: usize> Buses for [A; COUNT] {
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

    fn take_back(&mut self, bus: usize, id: u16) {
        if let Some(bus) = self.get_mut(bus) {
            bus.take_back(id);
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
