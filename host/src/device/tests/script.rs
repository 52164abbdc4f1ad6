//! A session against a board that answers as it is told, on a line of its own clock: what is sent when, how often and
//! under which number, and what becomes of answers that nobody waits for.

use super::{quintic, settings};
use crate::device::{DeviceError, Reception, Session, Transport, TransportError};
use std::collections::VecDeque;
use std::time::Duration;
use stillpoint_firmware::State;
use stillpoint_shared::assembly::{Arrived, Outline};
use stillpoint_shared::protocol::{
    Capacities, Channels, Denial, Envelope, FrameDecoder, Greeting, Identity, MAX_FRAME_BYTES,
    Message, Request, Response, Telemetry, Versions, frame,
};

const SECOND: Duration = Duration::from_secs(1);

/// Something the board sends so many ms after a request.
type Answer = (u64, Envelope, Message);

/// A line with a board that answers by a script.
struct Script<F> {
    now: Duration,
    decoder: FrameDecoder,
    to_host: VecDeque<(Duration, Vec<u8>)>,
    /// When requests came, and their numbers.
    requests: Vec<(Duration, Envelope)>,
    answer: F,
}

impl<F: FnMut(Envelope, &Request<'_>) -> Vec<Answer>> Script<F> {
    fn new(answer: F) -> Self {
        Self {
            now: Duration::ZERO,
            decoder: FrameDecoder::new(),
            to_host: VecDeque::new(),
            requests: Vec::new(),
            answer,
        }
    }
}

impl<F: FnMut(Envelope, &Request<'_>) -> Vec<Answer>> Transport for Script<F> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for &byte in bytes {
            let Some(payload) = self.decoder.feed(byte) else {
                continue;
            };
            let (envelope, body) = frame::open(payload.unwrap()).unwrap();
            self.requests.push((self.now, envelope));
            for (ms, envelope, message) in (self.answer)(envelope, &frame::read(body).unwrap()) {
                let mut buffer = [0; MAX_FRAME_BYTES];
                let bytes = frame::encode(envelope, &message, &mut buffer).unwrap();
                let arrival = self.now + Duration::from_millis(ms);
                self.to_host.push_back((arrival, bytes.to_vec()));
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let deadline = self.now + timeout;
        let next = (0..self.to_host.len()).min_by_key(|&index| self.to_host[index].0);
        match next.filter(|&index| self.to_host[index].0 < deadline) {
            Some(index) => {
                let (arrival, bytes) = self.to_host.remove(index).unwrap();
                self.now = self.now.max(arrival);
                buffer[..bytes.len()].copy_from_slice(&bytes);
                Ok(bytes.len())
            }
            None => {
                self.now = deadline;
                Ok(0)
            }
        }
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        Ok(())
    }
}

fn identity(session: u16, window: u8) -> Message {
    Message::Response(Response::Hello(Identity {
        greeting: Greeting {
            versions: Versions::OWN,
            session,
            board: "script".try_into().unwrap(),
            firmware: "1".try_into().unwrap(),
            build_id: 0,
        },
        axes: 2,
        period_ticks: 2_500,
        capacities: Capacities::new(window, 0),
        state: State::Idle,
        limits_hash: 0,
        loaded: None,
        stored: Default::default(),
    }))
}

fn done() -> Message {
    Message::Response(Response::Done)
}

/// Greets in session 7 with a window of 2, and leaves everything else to `answer`.
fn board(
    mut answer: impl FnMut(Envelope, &Request<'_>) -> Vec<Answer>,
) -> Session<Script<impl FnMut(Envelope, &Request<'_>) -> Vec<Answer>>> {
    let script = Script::new(move |envelope, request: &Request<'_>| match request {
        Request::Hello(_) => vec![(1, envelope, identity(7, 2))],
        request => answer(envelope, request),
    });
    Session::open(script, settings(1)).unwrap()
}

fn telemetry(tick: u64) -> Message {
    Message::Telemetry(Telemetry {
        tick,
        dropped: 0,
        state: State::Idle,
        path_ticks: 0,
        path_speed: 0.0,
        channels: Channels::NONE,
        values: Default::default(),
        limited: Default::default(),
    })
}

#[test]
fn a_request_is_sent_again_under_its_number_as_often_as_allowed() {
    let mut session = board(|_, _| Vec::new());
    let before = session.transport().requests.len();
    let began = session.transport().now();
    let error = session.ask(&Request::KeepAlive).unwrap_err();
    let waited = 5 * SECOND;
    assert!(
        matches!(error, DeviceError::Unanswered { attempts: 5, waited: found } if found == waited),
        "{error:?}"
    );
    let sent = &session.transport().requests[before..];
    let at: Vec<_> = sent.iter().map(|(at, _)| *at - began).collect();
    assert_eq!(at, [0, 1, 2, 3, 4].map(|seconds| seconds * SECOND));
    assert!(sent.iter().all(|(_, envelope)| *envelope == sent[0].1));
    assert_eq!(sent[0].1.session, 7);
    // The next one has the next number.
    let _ = session.ask(&Request::KeepAlive);
    let next = session.transport().requests[before + 5].1;
    assert_eq!(
        next.sequence,
        sent_sequence(&session, before).wrapping_add(1)
    );
}

fn sent_sequence<F>(session: &Session<Script<F>>, index: usize) -> u16
where
    F: FnMut(Envelope, &Request<'_>) -> Vec<Answer>,
{
    session.transport().requests[index].1.sequence
}

#[test]
fn one_attempt_is_the_least() {
    let script = Script::new(|envelope, request: &Request<'_>| match request {
        Request::Hello(_) => vec![(1, envelope, identity(7, 2))],
        _ => Vec::new(),
    });
    let mut patience = settings(1);
    patience.attempts = 0;
    let mut session = Session::open(script, patience).unwrap();
    let error = session.upload(&quintic(1, 0.3), |_| {}).unwrap_err();
    assert!(!matches!(error, DeviceError::Denied(_)), "{error:?}");
}

#[test]
fn requests_that_write_flash_are_waited_for() {
    let flash = [
        Request::Store,
        Request::Erase { content_hash: None },
        Request::SetLimits(Default::default()),
        Request::SetConfig(stillpoint_shared::config::Config::default()),
        Request::SetDrives {
            bus: Default::default(),
            axes: Default::default(),
        },
    ];
    for request in flash {
        // As slow as an erase; less patience would send the request three times.
        let mut session = board(|envelope, _| vec![(2_500, envelope, done())]);
        let before = session.transport().requests.len();
        session.order(&request).unwrap();
        assert_eq!(
            session.transport().requests.len() - before,
            1,
            "{request:?}"
        );
        assert_eq!(session.reception().late, 0);
    }
}

#[test]
fn answers_that_nobody_waits_for_are_counted_and_nothing_else() {
    let mut session = board(|envelope, request| {
        let other = |change: fn(&mut Envelope)| {
            let mut other = envelope;
            change(&mut other);
            other
        };
        match request {
            Request::KeepAlive => vec![
                // An older request's, another session's, and a greeting's, before its own.
                (1, other(|other| other.sequence -= 1), done()),
                (2, other(|other| other.session = 6), done()),
                (3, envelope, identity(7, 2)),
                (4, envelope, done()),
                // Twice.
                (5, envelope, done()),
            ],
            _ => vec![(1, envelope, done())],
        }
    });
    assert_eq!(
        session.reception(),
        Reception {
            messages: 1,
            ..Reception::default()
        }
    );
    assert_eq!(session.ask(&Request::KeepAlive).unwrap(), Response::Done);
    assert_eq!(session.reception().late, 3);
    session.wait(SECOND).unwrap();
    assert_eq!(session.reception().late, 4);
    assert_eq!(session.reception().messages, 6);
    let _ = session.ask(&Request::KeepAlive);
    assert_eq!(session.telemetry(SECOND).unwrap(), None);
    assert_eq!(session.reception().late, 8);
}

#[test]
fn telemetry_counts_gaps_but_not_what_was_overtaken_or_belongs_to_another_session() {
    let mut session = board(|envelope, _| {
        let of = |sequence| Envelope {
            sequence,
            session: 7,
        };
        let old = Envelope {
            sequence: 900,
            session: 6,
        };
        vec![
            (1, of(65_534), telemetry(1)),
            (2, old, telemetry(2)),
            (3, of(65_535), telemetry(3)),
            // One is lost over the turn of the numbers; another comes late.
            (4, of(1), telemetry(4)),
            (5, of(0), telemetry(5)),
            (6, of(1), telemetry(6)),
            (7, envelope, done()),
            (8, of(4), telemetry(7)),
        ]
    });
    session.order(&Request::KeepAlive).unwrap();
    let mut seen = Vec::new();
    while let Some(received) = session.telemetry(SECOND).unwrap() {
        seen.push((received.telemetry.tick, received.lost));
    }
    assert_eq!(seen, [(1, 0), (3, 0), (4, 1), (5, 0), (6, 0), (7, 2)]);
    // A new session counts anew, and forgets what it had.
    session.order(&Request::KeepAlive).unwrap();
    session.reconnect().unwrap();
    assert_eq!(session.telemetry(Duration::ZERO).unwrap(), None);
    session.order(&Request::KeepAlive).unwrap();
    let first = session.telemetry(SECOND).unwrap().unwrap();
    assert_eq!((first.telemetry.tick, first.lost), (1, 0));
}

#[test]
fn a_board_that_loses_every_session_is_given_up() {
    let mut session = board(|envelope, _| {
        let (named, open) = (envelope.session, 0);
        let denial = Response::Denied(Denial::Session { named, open });
        vec![(1, envelope, Message::Response(denial))]
    });
    let before = session.transport().requests.len();
    let error = session.ask(&Request::KeepAlive).unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::SessionLost {
                denial: Denial::Session { named: 7, open: 0 }
            }
        ),
        "{error:?}"
    );
    // Each time a question and a greeting.
    assert_eq!(session.transport().requests.len() - before, 10);
}

#[test]
fn a_board_of_another_version_opens_no_session() {
    let script = Script::new(|envelope, _: &Request<'_>| vec![(1, envelope, identity(0, 2))]);
    let error = Session::open(script, settings(1)).err().unwrap();
    assert!(matches!(error, DeviceError::Versions { .. }), "{error:?}");
}

/// When something was sent, and which block it was.
type Sent = (Duration, Option<u8>);

/// A board that takes an upload of three blocks, each answered after `ms`, never the one named `lost`.
fn upload(window: u8, ms: u64, lost: Option<u8>) -> (Result<u32, DeviceError>, Vec<Sent>) {
    let trajectory = quintic(1, 0.3);
    let tag = Outline::of(&trajectory).tag();
    let mut bits = 0;
    let log = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    let blocks = std::rc::Rc::clone(&log);
    let script = Script::new(move |envelope, request: &Request<'_>| {
        let arrived = |bits| {
            let blocks = 3;
            Message::Response(Response::Upload(Arrived { tag, blocks, bits }))
        };
        match request {
            Request::Hello(_) => vec![(1, envelope, identity(7, window))],
            Request::UploadBlock(block) => {
                blocks.borrow_mut().push(Some(block.block));
                if lost == Some(block.block) {
                    return Vec::new();
                }
                bits |= 1 << block.block;
                vec![(ms, envelope, arrived(bits))]
            }
            Request::UploadBegin(_) => vec![(1, envelope, arrived(0))],
            _ => vec![(1, envelope, done())],
        }
    });
    let mut patience = settings(1);
    patience.reconnects = 0;
    let mut session = Session::open(script, patience).unwrap();
    let before = session.transport().requests.len();
    let result = session
        .upload(&trajectory, |_| {})
        .map(|uploaded| uploaded.sent);
    let times = session.transport().requests[before + 1..]
        .iter()
        .map(|(at, _)| *at);
    let sent = times.zip(log.borrow().iter().copied()).collect();
    (result, sent)
}

#[test]
fn an_upload_leaves_as_many_blocks_unanswered_as_the_board_allows() {
    // Answers take 100 ms: the blocks leave together, in pairs, or one by one.
    for (window, together) in [
        (3, [0, 0, 0]),
        (2, [0, 0, 100]),
        (1, [0, 100, 200]),
        (0, [0, 100, 200]),
    ] {
        let (result, sent) = upload(window, 100, None);
        assert_eq!(result.unwrap(), 3);
        let first = sent[0].0;
        let at: Vec<_> = sent
            .iter()
            .map(|(at, _)| (*at - first).as_millis())
            .collect();
        assert_eq!(at, together, "window {window}");
    }
}

#[test]
fn a_block_that_is_never_answered_is_sent_as_often_as_allowed() {
    let (result, sent) = upload(2, 1, Some(1));
    let error = result.unwrap_err();
    let waited = 5 * SECOND;
    assert!(
        matches!(error, DeviceError::Unanswered { attempts: 5, waited: found } if found == waited),
        "{error:?}"
    );
    let again: Vec<_> = sent.iter().filter(|(_, block)| *block == Some(1)).collect();
    let at: Vec<_> = again.iter().map(|(at, _)| *at - again[0].0).collect();
    assert_eq!(at, [0, 1, 2, 3, 4].map(|seconds| seconds * SECOND));
    // The others are sent once.
    assert_eq!(sent.len(), 7);
}
