//! The board's side of the protocol ([`stillpoint_shared::protocol`]): bytes in, bytes out, and a
//! bounded amount of work in between. No hardware: the board gives it the bytes that arrive and
//! takes those to be sent.
//!
//! ```text
//! receive ─► inbox ─► decoder ─► session ─► machine, store ─► outbox ─► transmit
//!                                      telemetry ◄─ tap ◄─┘      ▲
//!                                          └─────────────────────┘
//! ```
//!
//! The inbox holds [`WINDOW`] frames, so a host that leaves no more than that unanswered loses none
//! of them. A request is taken out only when its response has room in the outbox; telemetry is sent
//! only where a response still has room behind it.

mod answers;
mod machine;
mod outbox;
mod session;
mod tap;
mod work;

use heapless::Deque;
use stillpoint_shared::protocol::{
    Denial, Envelope, FrameDecoder, Hello, LinkCounters, MAX_FRAME_BYTES, MAX_TELEMETRY_BYTES,
    Message, Request, Response, TelemetryConfig, frame,
};

use crate::Refusal;
use crate::store::Store;
use crate::store::flash::Flash;
use answers::Reach;
use outbox::Outbox;
use session::{Outcome, Session, Turn};

pub use machine::{Access, Machine};
pub use tap::Tap;

/// Requests that a host may leave unanswered.
pub const WINDOW: u8 = 2;

const INBOX_BYTES: usize = WINDOW as usize * MAX_FRAME_BYTES;

/// What the board says about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardInfo {
    /// Kind of the board, 16 bytes at most.
    pub board: &'static str,
    /// Version of the firmware, 16 bytes at most.
    pub firmware: &'static str,
    /// First eight bytes of the image's build id.
    pub build_id: u64,
    /// Period of the drive loop, in ticks of 0.1 µs.
    pub period_ticks: u32,
    /// A number that is another one after every start of the board, as far as it can. Session
    /// numbers are drawn from it and the host's nonce: what is left on the line from before a start
    /// belongs to no open session, but by a chance of 1 in 65,535.
    pub start: u16,
}

/// The board's side of the protocol.
#[derive(Debug)]
pub struct Link {
    info: BoardInfo,
    inbox: Deque<u8, INBOX_BYTES>,
    decoder: FrameDecoder,
    session: Session,
    outbox: Outbox,
    counters: LinkCounters,
    telemetry_sequence: u16,
    wants_start: bool,
}

// All in all 6 kB with the tap, beside the executor.
const _: () = assert!(size_of::<Link>() <= 3_000 && size_of::<Tap>() <= 1_800);

/// One more, as far as it can be counted.
fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

impl Link {
    /// A link without a session.
    pub const fn new(info: BoardInfo) -> Self {
        Self {
            info,
            inbox: Deque::new(),
            decoder: FrameDecoder::new(),
            session: Session::none(info.start),
            outbox: Outbox::new(),
            counters: LinkCounters {
                requests: 0,
                damaged: 0,
                overrun_bytes: 0,
                repeated: 0,
                dropped: 0,
            },
            telemetry_sequence: 0,
            wants_start: false,
        }
    }

    /// Whether the board is to be started anew, with the drives off and when everything is sent:
    /// other drives are configured than those it started with.
    pub fn wants_start(&self) -> bool {
        self.wants_start && self.outbox.pending().is_empty()
    }

    /// What the board says about itself.
    pub fn info(&self) -> &BoardInfo {
        &self.info
    }

    /// What the link has seen.
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    /// Gives the machine the limits and the configuration that are stored; to be called when the
    /// board starts.
    pub fn restore<const AXES: usize, F: Flash>(
        &self,
        machine: &mut impl Access<AXES>,
        store: &Store<F>,
    ) -> Result<(), Refusal> {
        let limits = store.limits().ok_or(Refusal::NotConfigured)?;
        let stored = store.config();
        let config = stored.filter(|config| config.period_ticks == self.info.period_ticks);
        let config = config.unwrap_or(self.info.config());
        machine.with(|machine| machine.executor.configure(&limits, &config))
    }

    /// Takes a byte from the host.
    pub fn receive(&mut self, byte: u8) {
        if self.inbox.push_back(byte).is_err() {
            self.count_lost(1);
        }
    }

    /// So many bytes from the host were lost on the way to [`Link::receive`].
    pub fn count_lost(&mut self, bytes: u32) {
        let counter = &mut self.counters.overrun_bytes;
        *counter = counter.saturating_add(bytes);
    }

    /// Number of bytes that can be received before the next [`Link::poll`].
    pub fn free(&self) -> usize {
        INBOX_BYTES - self.inbox.len()
    }

    /// The bytes to be sent next; [`Link::sent`] takes them away.
    pub fn transmit(&self) -> &[u8] {
        self.outbox.pending()
    }

    /// The first `bytes` of [`Link::transmit`] have been sent.
    pub fn sent(&mut self, bytes: usize) {
        self.outbox.sent(bytes);
    }

    /// Answers one request, if one has arrived, and sends telemetry. Returns whether there may be
    /// more to do at once.
    ///
    /// Bounded: it looks at no more bytes than the inbox holds, and obeys one request.
    pub fn poll<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        machine: &mut M,
        store: &mut Store<F>,
    ) -> bool {
        if self.outbox.room() >= MAX_FRAME_BYTES {
            let mut wants_start = self.wants_start;
            let mut reach = Reach {
                machine,
                store,
                wants_start: &mut wants_start,
            };
            self.next_request(&mut reach);
            self.wants_start = wants_start;
        }
        self.send_telemetry(machine);
        !self.inbox.is_empty()
    }

    fn next_request<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        reach: &mut Reach<'_, M, F>,
    ) {
        while let Some(byte) = self.inbox.pop_front() {
            let opened = match self.decoder.feed(byte) {
                None => continue,
                Some(payload) => payload.and_then(frame::open),
            };
            let Ok((envelope, body)) = opened else {
                count(&mut self.counters.damaged);
                continue;
            };
            count(&mut self.counters.requests);
            let mut answering = Answering {
                info: &self.info,
                session: &mut self.session,
                counters: &mut self.counters,
                outbox: &mut self.outbox,
            };
            match Request::decode(body) {
                Ok(request) => answering.take(envelope, &request, reach),
                Err(_) => {
                    let bytes = body.len() as u16;
                    let denial = Denial::NotUnderstood { bytes };
                    answering.send(envelope, Response::Denied(denial));
                }
            }
            return;
        }
    }

    #[inline(never)]
    fn send_telemetry<const AXES: usize>(&mut self, machine: &mut impl Access<AXES>) {
        while self.outbox.room() >= MAX_FRAME_BYTES + MAX_TELEMETRY_BYTES {
            let Some(sample) = machine.with(|machine| machine.tap.pop()) else {
                return;
            };
            self.telemetry_sequence = self.telemetry_sequence.wrapping_add(1);
            let envelope = Envelope {
                session: self.session.number(),
                sequence: self.telemetry_sequence,
            };
            if !self.outbox.push(envelope, &Message::Telemetry(sample)) {
                return;
            }
        }
    }
}

/// The parts of the link that answer a request while its bytes are in the decoder.
struct Answering<'a> {
    info: &'a BoardInfo,
    session: &'a mut Session,
    counters: &'a mut LinkCounters,
    outbox: &'a mut Outbox,
}

impl Answering<'_> {
    /// Obeys, then answers: while an order is obeyed, no response, which may be large, is on the
    /// stack.
    fn take<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        envelope: Envelope,
        request: &Request<'_>,
        reach: &mut Reach<'_, M, F>,
    ) {
        if let Request::Hello(hello) = request {
            return self.greet(envelope, hello, reach);
        }
        match self.judge(envelope, request, reach) {
            Ok(None) => self.answer(envelope, request, reach),
            Ok(Some(outcome)) => self.send(envelope, outcome.into()),
            Err(denial) => self.send(envelope, Response::Denied(denial)),
        }
    }

    #[inline(never)]
    fn greet<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        envelope: Envelope,
        hello: &Hello,
        reach: &mut Reach<'_, M, F>,
    ) {
        let (session, is_new) = self.session.greet(hello);
        if is_new {
            reach
                .machine
                .with(|machine| machine.tap.set(TelemetryConfig::OFF));
        }
        let identity = reach.identity(self.info, session);
        let envelope = Envelope {
            session,
            ..envelope
        };
        self.send(envelope, Response::Hello(identity));
    }

    /// What became of an order; `None` for any other request of the session.
    fn judge<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        envelope: Envelope,
        request: &Request<'_>,
        reach: &mut Reach<'_, M, F>,
    ) -> Result<Option<Outcome>, Denial> {
        let sequence = envelope.sequence;
        let is_newest = self.session.take(envelope.session, sequence)?;
        // Whoever only watches is no supervisor.
        if is_newest && !matches!(request, Request::SetTelemetry(_)) {
            reach
                .machine
                .with(|machine| machine.executor.heard_from_host(machine.executor.ticks()));
        }
        if !request.is_order() {
            return Ok(None);
        }
        match self.session.turn(sequence)? {
            Turn::Repeat(outcome) => {
                count(&mut self.counters.repeated);
                Ok(Some(outcome))
            }
            // It would put the start off, or be forgotten with it.
            Turn::Obey if *reach.wants_start => Err(Denial::Starting),
            Turn::Obey => {
                let outcome = reach
                    .obey(request, self.info)
                    .unwrap_or_else(Outcome::Denied);
                self.session.obeyed(sequence, outcome);
                Ok(Some(outcome))
            }
        }
    }

    #[inline(never)]
    fn answer<const AXES: usize, M: Access<AXES>, F: Flash>(
        &mut self,
        envelope: Envelope,
        request: &Request<'_>,
        reach: &mut Reach<'_, M, F>,
    ) {
        match reach.ask(request, *self.counters) {
            Ok(response) => self.send(envelope, response),
            Err(denial) => self.send(envelope, Response::Denied(denial)),
        }
    }

    #[inline(never)]
    fn send(&mut self, envelope: Envelope, response: Response) {
        // It fits: this cannot fail.
        let _ = self.outbox.push(envelope, &Message::Response(response));
    }
}
