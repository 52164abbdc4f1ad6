//! A whole board: any bytes, any requests, in any state.

use super::bytes::Bytes;
use super::seeds::{start_rad, valid_move};
use super::trajectory::limits;
use stillpoint_firmware::bench::{Action, BenchDrives};
use stillpoint_firmware::link::BoardInfo;
use stillpoint_firmware::store::flash::RamFlash;
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_firmware::{Config, Link, Machine, State, TickInputs};
use stillpoint_shared::LIMIT_TOLERANCE;
use stillpoint_shared::assembly::{self, Outline};
use stillpoint_shared::protocol::{
    Block, Envelope, FrameDecoder, Hello, MAX_FRAME_BYTES, Message, Request, Response, Versions,
    frame,
};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

const AXES: usize = 2;

type SmallFlash = RamFlash<4, 2048>;

struct Board {
    link: Link,
    machine: Box<Machine<AXES>>,
    store: Store<SmallFlash>,
    drives: BenchDrives<AXES>,
    decoder: FrameDecoder,
    envelope: Envelope,
}

/// What happens to the drives.
fn trouble(bytes: &mut Bytes<'_>) -> Action {
    let choice = bytes.u8();
    let axis = choice / 16 % 3;
    match choice % 8 {
        0 | 1 => Action::Repair,
        2 => Action::CutBus,
        3 => Action::Fault { axis },
        4 => Action::SwitchOff { axis },
        5 => Action::Silence { axis },
        6 => Action::Block { axis },
        _ => Action::Turn {
            axis,
            position_rad: f32::from_bits(bytes.u32()),
        },
    }
}

/// Bytes: one after another what happens, and with what.
///
/// No panic; every sound request has exactly one response, and no message is damaged; set-points are within the
/// limits at every tick; bytes that are no frame do nothing.
pub fn board(data: &[u8]) {
    let layout = Layout {
        moves: [0, 1],
        config: [2, 3],
    };
    let mut board = Board {
        link: Link::new(BoardInfo {
            board: "fuzz",
            firmware: "0",
            build_id: 0,
            period_ticks: 2_500,
            start: 0,
        }),
        machine: Box::new(Machine::new(limits().clone(), Config::default()).expect("it fits")),
        store: Store::mount(SmallFlash::new(), layout),
        drives: BenchDrives::at(&start_rad().into()),
        decoder: FrameDecoder::new(),
        envelope: Envelope {
            session: 0,
            sequence: 0,
        },
    };
    board.ticks(1, &TickInputs::default());
    board.hello(1);
    let mut bytes = Bytes(data);
    for _ in 0..200 {
        if bytes.is_empty() {
            break;
        }
        board.step(&mut bytes);
    }
    // It still answers.
    board.hello(2);
    let status = board.ask(&Request::Status);
    assert!(matches!(status, Some(Response::Status(_))), "{status:?}");
}

impl Board {
    fn step(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.u8() {
            0..=57 => self.ticks(bytes.u8(), &TickInputs::default()),
            58 | 59 => self.drives.act(trouble(bytes)),
            60 => {
                let inputs = TickInputs {
                    emergency_stop: bytes.u8() & 1 == 1,
                    busy_ticks: u32::from(bytes.u16()),
                    missed_ticks: u16::from(bytes.u8()),
                };
                self.ticks(1, &inputs);
            }
            61..=70 => self.noise(bytes),
            71..=75 => self.hello(u32::from(bytes.u8())),
            // Any body at all, in a sound frame.
            76..=140 => {
                let count = usize::from(bytes.u8()) * 2;
                self.raw_request(bytes.take(count));
            }
            // An old number: a repetition, or one that was late.
            141..=150 => {
                let sequence = self.envelope.sequence;
                self.envelope.sequence = sequence.wrapping_sub(u16::from(bytes.u8() % 4) + 1);
                self.likely(bytes.u8());
                self.envelope.sequence = sequence;
            }
            _ => self.likely(bytes.u8()),
        }
    }

    /// A request that makes sense, so that every state is reached.
    fn likely(&mut self, choice: u8) {
        let trajectory = valid_move(choice / 32 % 2);
        let outline = Outline::of(trajectory);
        let content_hash = outline.content_hash;
        let values: Vec<u8>;
        let request = match choice % 32 {
            0..=2 => Request::UploadBegin(outline),
            3..=8 => {
                let block = choice % 32 - 3;
                let block_values = assembly::block(trajectory, block).iter();
                values = block_values.flat_map(|value| value.to_le_bytes()).collect();
                Request::UploadBlock(Block {
                    tag: outline.tag(),
                    block,
                    values: &values,
                })
            }
            9..=11 => Request::UploadCommit { content_hash },
            12 => Request::UploadAbort,
            13 | 14 => Request::Arm,
            15 => Request::Disarm,
            16..=18 => Request::Start(StartRequest {
                trajectory_hash: content_hash,
                limits_hash: limits().hash(),
                comms: [
                    CommsPolicy::Continue,
                    CommsPolicy::Hold,
                    CommsPolicy::QuickStop,
                ][usize::from(choice / 64 % 3)],
                comms_timeout_ticks: 50,
                dry_run: choice.is_multiple_of(7),
            }),
            19 => Request::Hold,
            20 => Request::Resume,
            21 => Request::Override {
                percent: choice / 2,
            },
            22 => Request::QuickStop,
            23 | 24 => Request::Clear,
            25 => Request::Store,
            26 => Request::Load { content_hash },
            27 => Request::Erase {
                content_hash: (choice < 128).then_some(content_hash),
            },
            28 => Request::SetLimits(limits().axes().iter().copied().collect()),
            29 => Request::SetConfig(Config::default()),
            30 => Request::GetFaultSamples {
                first: u16::from(choice),
            },
            _ => Request::KeepAlive,
        };
        self.ask(&request);
    }

    fn ticks(&mut self, count: u8, inputs: &TickInputs) {
        for _ in 0..count {
            let report = self.machine.tick(&mut self.drives, inputs);
            let (state, setpoints) = (report.state, *report.setpoints);
            // The limits may have been changed over the wire.
            let Some(limits) = self.machine.executor.limits() else {
                continue;
            };
            for (setpoint, limits) in setpoints.iter().zip(limits.axes()) {
                assert!(setpoint.position_rad.is_finite());
                if state != State::Fault {
                    let most = 1.0 + 2.0 * LIMIT_TOLERANCE;
                    assert!(setpoint.velocity_rad_per_s.abs() <= limits.speed_rad_per_s * most);
                    assert!(setpoint.torque_nm.abs() <= limits.torque_nm * most);
                }
            }
        }
    }

    /// Bytes that end no sound frame, unless the fuzzer finds a check sum.
    fn noise(&mut self, bytes: &mut Bytes<'_>) {
        let count = usize::from(bytes.u8());
        for &byte in bytes.take(count) {
            self.link.receive(byte);
        }
        self.link.receive(0);
        self.responses();
    }

    fn hello(&mut self, nonce: u32) {
        self.envelope.session = 0;
        let versions = Versions::OWN;
        let hello = Request::Hello(Hello { versions, nonce });
        let Some(Response::Hello(identity)) = self.ask(&hello) else {
            panic!("no greeting");
        };
        self.envelope.session = identity.greeting.session;
    }

    fn ask(&mut self, request: &Request<'_>) -> Option<Response> {
        let mut buffer = [0; MAX_FRAME_BYTES];
        self.envelope.sequence = self.envelope.sequence.wrapping_add(1);
        let frame = frame::encode(self.envelope, request, &mut buffer).expect("it fits");
        self.exchange(frame)
    }

    fn raw_request(&mut self, body: &[u8]) {
        let mut buffer = [0; MAX_FRAME_BYTES];
        self.envelope.sequence = self.envelope.sequence.wrapping_add(1);
        let frame = super::frames::framed(self.envelope, body, &mut buffer);
        self.exchange(frame);
        // It may have been a greeting.
        self.hello(3);
    }

    /// Sends a frame and takes the one response to it.
    fn exchange(&mut self, frame: &[u8]) -> Option<Response> {
        for &byte in frame {
            self.link.receive(byte);
        }
        let mut responses = self.responses();
        assert_eq!(responses.len(), 1, "{responses:?}");
        responses.pop()
    }

    fn responses(&mut self) -> Vec<Response> {
        let mut responses = Vec::new();
        for _ in 0..100 {
            let more = self.link.poll(&mut *self.machine, &mut self.store);
            let sent = self.link.transmit().to_vec();
            self.link.sent(sent.len());
            if !more && sent.is_empty() {
                return responses;
            }
            for byte in sent {
                if let Some(payload) = self.decoder.feed(byte) {
                    let (_, body) =
                        frame::open(payload.expect("sound frames")).expect("an envelope");
                    match frame::read(body).expect("a message") {
                        Message::Response(response) => responses.push(response),
                        Message::Telemetry(_) => {}
                        other => panic!("{other:?}"),
                    }
                }
            }
        }
        panic!("the link is never done");
    }
}
