//! A board in a box: link, machine, store and drives, and the host's side of the wire.

use stillpoint_firmware::link::{BoardInfo, Link, Machine};
use stillpoint_firmware::store::flash::RamFlash;
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_firmware::{Config, FaultRecord, IdealDrives, State};
use stillpoint_shared::Trajectory;
use stillpoint_shared::assembly::Outline;
use stillpoint_shared::protocol::{
    Block, Envelope, FrameDecoder, Hello, Identity, MAX_FRAME_BYTES, Message, Request, Response,
    Telemetry, Versions, frame,
};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

use crate::common::{AXES, FINE, block_bytes, limits, start};

pub(crate) type TestFlash = RamFlash<4, 4096>;

pub(crate) const LAYOUT: Layout = Layout {
    moves: [0, 1],
    config: [2, 3],
};

pub(crate) const INFO: BoardInfo = BoardInfo {
    board: "box",
    firmware: "1.2.3",
    build_id: 0x1234,
    period_ticks: 2_500,
    start: 41,
};

pub(crate) struct Rig {
    pub(crate) link: Link,
    pub(crate) machine: Box<Machine<AXES>>,
    pub(crate) store: Store<TestFlash>,
    pub(crate) drives: IdealDrives<AXES>,
    pub(crate) session: u16,
    pub(crate) sequence: u16,
    decoder: FrameDecoder,
}

impl Rig {
    /// A board with limits that stands at the start of the test's move, and no session.
    pub(crate) fn silent() -> Self {
        Self::with_store(Store::mount(TestFlash::new(), LAYOUT))
    }

    pub(crate) fn with_store(store: Store<TestFlash>) -> Self {
        let mut machine = Box::new(Machine::new(limits(), Config::default()).unwrap());
        let record = Box::leak(Box::new(FaultRecord::empty()));
        machine.executor.record_into(record, INFO.build_id);
        let mut rig = Self {
            link: Link::new(INFO),
            machine,
            store,
            drives: IdealDrives::at(&start()),
            session: 0,
            // So that the numbers come around in every longer test.
            sequence: 65_530,
            decoder: FrameDecoder::new(),
        };
        rig.tick(1);
        rig
    }

    /// The same with an open session.
    pub(crate) fn new() -> Self {
        let mut rig = Self::silent();
        rig.hello(1);
        rig
    }

    pub(crate) fn tick(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.machine.tick(&mut self.drives, &FINE);
        }
    }

    /// Ticks until a state is reached.
    pub(crate) fn until(&mut self, state: State) {
        for _ in 0..100_000 {
            if self.machine.executor.state() == state {
                return;
            }
            self.tick(1);
        }
        panic!("{state:?} does not come");
    }

    pub(crate) fn state(&self) -> State {
        self.machine.executor.state()
    }

    pub(crate) fn poll(&mut self) -> bool {
        self.link.poll(&mut *self.machine, &mut self.store)
    }

    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.link.receive(byte);
        }
    }

    /// All messages that have been made.
    pub(crate) fn messages(&mut self) -> Vec<(Envelope, Message)> {
        let bytes = self.link.transmit().to_vec();
        self.link.sent(bytes.len());
        let mut messages = Vec::new();
        for byte in bytes {
            if let Some(payload) = self.decoder.feed(byte) {
                let (envelope, body) = frame::open(payload.unwrap()).unwrap();
                messages.push((envelope, frame::read(body).unwrap()));
            }
        }
        messages
    }

    /// Polls until nothing is left to do, and returns all messages.
    pub(crate) fn drain(&mut self) -> Vec<(Envelope, Message)> {
        let mut messages = Vec::new();
        loop {
            let more = self.poll();
            let new = self.messages();
            if !more && new.is_empty() {
                return messages;
            }
            messages.extend(new);
        }
    }

    pub(crate) fn telemetry(&mut self) -> Vec<(u16, Telemetry)> {
        let messages = self.drain().into_iter();
        messages
            .map(|(envelope, message)| match message {
                Message::Telemetry(telemetry) => (envelope.sequence, telemetry),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    /// Sends a request as it is and returns the one response.
    pub(crate) fn exchange(&mut self, envelope: Envelope, request: &Request<'_>) -> Response {
        self.receive(&framed(envelope, request));
        let mut responses = Vec::new();
        for (answered, message) in self.drain() {
            if let Message::Response(response) = message {
                assert_eq!(answered.sequence, envelope.sequence);
                responses.push((answered.session, response));
            }
        }
        assert_eq!(responses.len(), 1, "{request:?}: {responses:?}");
        let (session, response) = responses.remove(0);
        if !matches!(request, Request::Hello(_)) {
            assert_eq!(session, envelope.session);
        }
        response
    }

    /// A new request in the open session.
    pub(crate) fn ask(&mut self, request: &Request<'_>) -> Response {
        self.sequence = self.sequence.wrapping_add(1);
        let envelope = self.envelope();
        self.exchange(envelope, request)
    }

    /// The envelope of the last request.
    pub(crate) fn envelope(&self) -> Envelope {
        Envelope {
            session: self.session,
            sequence: self.sequence,
        }
    }

    pub(crate) fn done(&mut self, request: &Request<'_>) {
        let response = self.ask(request);
        assert_eq!(response, Response::Done, "{request:?}");
    }

    pub(crate) fn hello(&mut self, nonce: u32) -> Identity {
        let hello = Hello {
            versions: Versions::OWN,
            nonce,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let envelope = Envelope {
            session: 0,
            sequence: self.sequence,
        };
        let Response::Hello(identity) = self.exchange(envelope, &Request::Hello(hello)) else {
            panic!("no greeting");
        };
        self.session = identity.greeting.session;
        identity
    }

    /// Uploads a move and commits it.
    pub(crate) fn upload(&mut self, trajectory: &Trajectory) -> Response {
        let outline = Outline::of(trajectory);
        let response = self.ask(&Request::UploadBegin(outline.clone()));
        let Response::Upload(arrived) = response else {
            return response;
        };
        for block in 0..arrived.blocks {
            self.ask(&Request::UploadBlock(Block {
                tag: outline.tag(),
                block,
                values: &block_bytes(trajectory, block),
            }));
        }
        self.ask(&Request::UploadCommit {
            content_hash: outline.content_hash,
        })
    }

    /// A start of what is loaded.
    pub(crate) fn start_request(&self, comms: CommsPolicy) -> StartRequest {
        StartRequest {
            comms,
            comms_timeout_ticks: 100,
            ..self.machine.executor.start_request()
        }
    }

    /// Brings the board from `Ready` to `Running`.
    pub(crate) fn run(&mut self, comms: CommsPolicy) {
        self.done(&Request::Arm);
        self.tick(10);
        self.done(&Request::Start(self.start_request(comms)));
        assert_eq!(self.state(), State::Running);
    }

    /// The board after a reset: what is in flash stays.
    pub(crate) fn restarted(self) -> Self {
        let store = Store::mount(self.store.into_flash(), LAYOUT);
        let mut rig = Self::with_store(store);
        rig.hello(2);
        rig
    }
}

pub(crate) fn framed(envelope: Envelope, request: &Request<'_>) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    frame::encode(envelope, request, &mut buffer)
        .unwrap()
        .to_vec()
}
