//! A CAN bus at 1 Mbit/s: arbitration by identifier, frames that take their time, drives on one
//! side and on the other a controller with three mailboxes and a small receive buffer, as bxCAN has
//! them. A bit takes 1 µs; every frame is stuffed at its worst.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use embedded_can::nb::Can;
use embedded_can::{ErrorKind, ExtendedId, Frame, Id, StandardId};

use stillpoint_firmware::cia402::Controller;

use super::drive::Drive;

/// A data frame with an 11-bit identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Raw {
    pub(crate) id: u16,
    bytes: [u8; 8],
    length: usize,
}

impl Raw {
    pub(crate) fn new(id: u16, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(data);
        Self {
            id,
            bytes,
            length: data.len(),
        }
    }

    pub(crate) fn data(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Bits on the wire: 47 + 8 s and the stuff bits (Davis et al. 2007).
    fn duration_us(&self) -> u64 {
        let s = self.length as u64;
        47 + 8 * s + (34 + 8 * s - 1) / 4
    }
}

/// What becomes of a frame at its receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    Arrives,
    Lost,
    Twice,
    /// So many µs late.
    Late(u64),
}

/// Decides the fate of every frame; `true` for one of the board.
pub(crate) type Fates = dyn FnMut(&Raw, bool) -> Fate;

/// How many frames the controller keeps for the board, as bxCAN's two FIFOs of three.
const RECEIVE_BUFFER: usize = 6;

pub(crate) struct Wire {
    pub(crate) drives: Vec<Drive>,
    pub(crate) fates: Box<Fates>,
    /// Whether the wires are cut: nothing is acknowledged.
    pub(crate) is_cut: bool,
    /// Every frame the controller took from the board, in the order it took them.
    pub(crate) taken: Vec<Raw>,
    /// Every frame the board fetched.
    pub(crate) fetched: Vec<Raw>,
    /// Calls of receive, and frames given, since the counters were last set to 0.
    pub(crate) receive_calls: usize,
    pub(crate) frames_taken: usize,
    /// µs in which the bus carried something.
    pub(crate) busy_us: u64,
    pub(crate) now_us: u64,
    mailboxes: [Option<Raw>; 3],
    /// Mailbox whose frame is on the wire; it is free again when the frame has arrived.
    sending: Option<usize>,
    received: VecDeque<Raw>,
    overrun: bool,
    on_wire: Option<(Raw, bool, u64)>,
    late: Vec<(u64, Raw, bool)>,
}

impl Wire {
    pub(crate) fn new(drives: Vec<Drive>) -> Self {
        Self {
            drives,
            fates: Box::new(|_, _| Fate::Arrives),
            is_cut: false,
            taken: Vec::new(),
            fetched: Vec::new(),
            receive_calls: 0,
            frames_taken: 0,
            busy_us: 0,
            now_us: 0,
            mailboxes: [None; 3],
            sending: None,
            received: VecDeque::new(),
            overrun: false,
            on_wire: None,
            late: Vec::new(),
        }
    }

    /// Lets time pass.
    pub(crate) fn advance(&mut self, to_us: u64) {
        while self.now_us < to_us {
            self.start();
            let drives = self.drives.iter().map(Drive::next_us);
            let wire = self.on_wire.iter().map(|(_, _, end_us)| *end_us);
            let late = self.late.iter().map(|(at_us, _, _)| *at_us);
            let next = drives.chain(wire).chain(late).min().unwrap_or(to_us);
            self.now_us = next.clamp(self.now_us + 1, to_us);
            for drive in &mut self.drives {
                drive.advance(self.now_us);
            }
            self.arrive();
        }
    }

    /// The most urgent frame of all that wait begins, if the bus is free and anyone is there to
    /// acknowledge it.
    fn start(&mut self) {
        let alone = !self.drives.iter().any(Drive::is_powered);
        if self.on_wire.is_some() || self.is_cut || alone {
            return;
        }
        let mailbox = (0..3)
            .filter_map(|index| Some((self.mailboxes[index]?.id, index)))
            .min();
        let drive = (0..self.drives.len())
            .filter_map(|index| {
                // A drive's own controller sends by urgency too.
                let queue = &self.drives[index].outgoing;
                let place = (0..queue.len()).min_by_key(|place| queue[*place].id)?;
                Some((queue[place].id, index, place))
            })
            .min();
        let (frame, from_board) = match (mailbox, drive) {
            (Some((id, _)), Some((other, index, place))) if other < id => {
                (self.drives[index].outgoing.remove(place), false)
            }
            (None, Some((_, index, place))) => (self.drives[index].outgoing.remove(place), false),
            (Some((_, index)), _) => {
                self.sending = Some(index);
                (self.mailboxes[index], true)
            }
            (None, None) => return,
        };
        if let Some(frame) = frame {
            let duration_us = frame.duration_us();
            self.busy_us += duration_us;
            self.on_wire = Some((frame, from_board, self.now_us + duration_us));
        }
    }

    fn arrive(&mut self) {
        if let Some((frame, from_board, end_us)) = self.on_wire
            && end_us <= self.now_us
        {
            self.on_wire = None;
            if let Some(index) = self.sending.take() {
                self.mailboxes[index] = None;
            }
            match (self.fates)(&frame, from_board) {
                Fate::Arrives => self.deliver(frame, from_board),
                Fate::Lost => {}
                Fate::Twice => {
                    self.deliver(frame, from_board);
                    self.deliver(frame, from_board);
                }
                Fate::Late(by_us) => self.late.push((self.now_us + by_us, frame, from_board)),
            }
        }
        let now_us = self.now_us;
        for (_, frame, from_board) in self
            .late
            .extract_if(.., |(at_us, _, _)| *at_us <= now_us)
            .collect::<Vec<_>>()
        {
            self.deliver(frame, from_board);
        }
    }

    fn deliver(&mut self, frame: Raw, from_board: bool) {
        if from_board {
            for drive in &mut self.drives {
                drive.receive(&frame);
            }
        } else if self.received.len() < RECEIVE_BUFFER {
            self.received.push_back(frame);
        } else {
            self.overrun = true;
        }
    }
}

/// The controller's side of a wire, as the board sees it.
#[derive(Clone)]
pub(crate) struct Port(pub(crate) Rc<RefCell<Wire>>);

/// What the board's `embedded-can` frames are here.
#[derive(Debug, Clone)]
pub(crate) struct TestFrame {
    id: Id,
    remote: bool,
    raw: Raw,
}

impl TestFrame {
    /// Frames that are none of CANopen's.
    pub(crate) fn foreign(remote: bool) -> Self {
        let id = if remote {
            Id::Standard(StandardId::new(0x181).unwrap())
        } else {
            Id::Extended(ExtendedId::new(0x181).unwrap())
        };
        Self {
            id,
            remote,
            raw: Raw::new(0x181, &[]),
        }
    }
}

impl Frame for TestFrame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let id = id.into();
        let Id::Standard(standard) = id else {
            return None;
        };
        (data.len() <= 8).then(|| Self {
            id,
            remote: false,
            raw: Raw::new(standard.as_raw(), data),
        })
    }

    fn new_remote(_: impl Into<Id>, _: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.raw.length
    }

    fn data(&self) -> &[u8] {
        self.raw.data()
    }
}

/// Frames were lost because nobody fetched them.
#[derive(Debug)]
pub(crate) struct Overrun;

impl embedded_can::Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Overrun
    }
}

impl Can for Port {
    type Frame = TestFrame;
    type Error = Overrun;

    /// As the `bxcan` crate does it: refuses a frame unless it is more urgent than all that wait,
    /// and displaces the least urgent one if no mailbox is free.
    fn transmit(&mut self, frame: &TestFrame) -> nb::Result<Option<TestFrame>, Overrun> {
        let mut wire = self.0.borrow_mut();
        let raw = frame.raw;
        if wire
            .mailboxes
            .iter()
            .flatten()
            .any(|waits| waits.id <= raw.id)
        {
            return Err(nb::Error::WouldBlock);
        }
        let place = (0..3)
            .filter(|index| wire.sending != Some(*index))
            .max_by_key(|index| wire.mailboxes[*index].map_or(u16::MAX, |waits| waits.id))
            .unwrap();
        let displaced = wire.mailboxes[place].replace(raw);
        wire.taken.push(raw);
        wire.frames_taken += 1;
        Ok(displaced.map(|raw| TestFrame {
            id: Id::Standard(StandardId::new(raw.id).unwrap()),
            remote: false,
            raw,
        }))
    }

    fn receive(&mut self) -> nb::Result<TestFrame, Overrun> {
        let mut wire = self.0.borrow_mut();
        wire.receive_calls += 1;
        if wire.overrun {
            wire.overrun = false;
            return Err(nb::Error::Other(Overrun));
        }
        let raw = wire.received.pop_front().ok_or(nb::Error::WouldBlock)?;
        wire.fetched.push(raw);
        Ok(TestFrame {
            id: Id::Standard(StandardId::new(raw.id).unwrap()),
            remote: false,
            raw,
        })
    }
}

impl Controller for Port {
    fn take_back(&mut self, id: u16) {
        let mut wire = self.0.borrow_mut();
        let sending = wire.sending;
        for (index, mailbox) in wire.mailboxes.iter_mut().enumerate() {
            if sending != Some(index) && mailbox.is_some_and(|waits| waits.id == id) {
                *mailbox = None;
            }
        }
    }
}
