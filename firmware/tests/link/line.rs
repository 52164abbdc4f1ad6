//! Sessions, repetitions, and bytes that are none of ours.

use proptest::prelude::*;
use stillpoint_firmware::State;
use stillpoint_firmware::link::{BoardInfo, Link, WINDOW};
use stillpoint_shared::assembly::{Arrived, Outline};
use stillpoint_shared::protocol::{
    Block, Denial, Envelope, FrameDecoder, Hello, MAX_FRAME_BYTES, Request, Response, SCHEMA_HASH,
    TelemetryConfig, Versions,
};
use stillpoint_shared::status::CommsPolicy;

use crate::common::{block_bytes, trajectory};
use crate::rig::{INFO, Rig, framed};

#[test]
fn a_greeting_opens_a_session_and_its_repetition_the_same_one() {
    let mut rig = Rig::silent();
    let identity = rig.hello(7);
    let first = identity.greeting.session;
    assert_ne!(first, 0);
    assert_eq!(identity.greeting.board, "box");
    assert_eq!(identity.greeting.firmware, "1.2.3");
    assert_eq!(identity.greeting.build_id, 0x1234);
    assert_eq!(identity.greeting.versions, Versions::OWN);
    assert_eq!((identity.axes, identity.period_ticks), (2, 2_500));
    assert_eq!(identity.state, State::Idle);
    assert_eq!(rig.hello(7).greeting.session, first);
    let second = rig.hello(8).greeting.session;
    assert_ne!(second, first);

    // What is left of the first session does nothing.
    let late = Envelope {
        session: first,
        sequence: rig.sequence.wrapping_add(9),
    };
    let denied = rig.exchange(late, &Request::QuickStop);
    let denial = Denial::Session {
        named: first,
        open: second,
    };
    assert_eq!(denied, Response::Denied(denial));
    assert_eq!(rig.state(), State::Idle);
}

#[test]
fn without_a_greeting_nothing_is_obeyed() {
    let mut rig = Rig::silent();
    for session in [0, 41, 42] {
        let envelope = Envelope {
            session,
            sequence: 1,
        };
        let denied = rig.exchange(envelope, &Request::QuickStop);
        let denial = Denial::Session {
            named: session,
            open: 0,
        };
        assert_eq!(denied, Response::Denied(denial));
    }
    assert_eq!(rig.state(), State::Idle);
}

#[test]
fn no_session_after_a_reset_has_the_number_of_one_before() {
    let mut numbers = std::collections::HashMap::new();
    for start in 40..44 {
        let mut rig = Rig::silent();
        rig.link = Link::new(BoardInfo { start, ..INFO });
        // A host that counts its nonces instead of drawing them.
        for nonce in 1..9 {
            let number = rig.hello(nonce).greeting.session;
            let before = numbers.insert(number, (start, nonce));
            assert_eq!(before, None, "{number} again at {start}, {nonce}");
        }
    }
}

#[test]
fn an_order_from_before_a_reset_does_nothing() {
    let mut rig = Rig::new();
    rig.hello(5);
    let old = Envelope {
        session: rig.session,
        sequence: rig.sequence.wrapping_add(100),
    };
    let mut rig = rig.restarted();
    rig.link = Link::new(BoardInfo {
        start: INFO.start + 1,
        ..INFO
    });
    rig.hello(6);
    rig.upload(&trajectory());
    let answer = rig.exchange(old, &Request::Arm);
    let (named, open) = (old.session, rig.session);
    let denied = Response::Denied(Denial::Session { named, open });
    assert_eq!((answer, rig.state()), (denied, State::Ready));
}

#[test]
fn another_version_opens_no_session_and_ends_none() {
    let mut rig = Rig::new();
    let own = Versions::OWN;
    let strangers = [
        Versions {
            oldest: own.newest + 1,
            newest: own.newest + 3,
            ..own
        },
        Versions {
            schema_hash: SCHEMA_HASH ^ 1,
            ..own
        },
    ];
    for versions in strangers {
        let hello = Hello { versions, nonce: 5 };
        let envelope = Envelope {
            session: 0,
            sequence: 3,
        };
        let Response::Hello(identity) = rig.exchange(envelope, &Request::Hello(hello)) else {
            panic!("no greeting");
        };
        assert_eq!(identity.greeting.session, 0);
        assert_eq!(identity.greeting.versions, own);
    }
    rig.done(&Request::KeepAlive);
}

#[test]
fn versions_meet_in_the_newest_common_one() {
    let versions = |oldest, newest, schema_hash| Versions {
        oldest,
        newest,
        schema_hash,
    };
    for (ours, theirs, common) in [
        (versions(1, 1, 5), versions(1, 1, 5), Some(1)),
        (versions(1, 1, 5), versions(1, 1, 6), None),
        (versions(1, 3, 5), versions(2, 2, 6), Some(2)),
        (versions(2, 2, 6), versions(1, 3, 5), Some(2)),
        (versions(1, 3, 5), versions(3, 4, 6), Some(3)),
        (versions(1, 2, 5), versions(3, 4, 6), None),
        (versions(3, 4, 6), versions(1, 2, 5), None),
    ] {
        assert_eq!(ours.common(theirs), common, "{ours} and {theirs}");
        assert_eq!(theirs.common(ours), common, "{theirs} and {ours}");
    }
}

/// A response that got lost: the host asks again with the same number.
#[test]
fn an_order_that_comes_again_is_obeyed_once_and_answered_alike() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.run(CommsPolicy::Continue);
    let start = Request::Start(rig.start_request(CommsPolicy::Continue));
    rig.until(State::Done);
    let repeated = rig.exchange(rig.envelope(), &start);
    assert_eq!(repeated, Response::Done);
    assert_eq!(rig.state(), State::Done, "no second move");
    assert_eq!(rig.link.counters().repeated, 1);

    // A refusal, too, is kept, though the order would be taken by now.
    let refused = rig.ask(&Request::Clear);
    assert!(matches!(refused, Response::Denied(_)));
    rig.machine.executor.emergency_stop();
    let again = rig.exchange(rig.envelope(), &Request::Clear);
    assert_eq!(again, refused);
    assert_eq!(rig.state(), State::Fault);
    rig.done(&Request::Clear);
}

/// An order that was late on the line: a start sent before a quick stop.
#[test]
fn an_order_overtaken_by_another_is_not_obeyed() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    rig.tick(10);
    let start = Request::Start(rig.start_request(CommsPolicy::Continue));
    rig.sequence = rig.sequence.wrapping_add(1);
    let late = rig.envelope();
    rig.done(&Request::Disarm);
    rig.done(&Request::Arm);
    rig.tick(10);
    let denied = rig.exchange(late, &start);
    let denial = Denial::Overtaken {
        sequence: late.sequence,
        latest: rig.sequence,
    };
    assert_eq!(denied, Response::Denied(denial));
    assert_eq!(rig.state(), State::Armed);
    // Questions may come late.
    assert!(matches!(
        rig.exchange(late, &Request::Status),
        Response::Status(_)
    ));
    rig.done(&start);
}

#[test]
fn only_new_requests_are_signs_of_life() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.run(CommsPolicy::Hold);
    rig.done(&Request::Override { percent: 10 });
    let last = rig.envelope();
    for _ in 0..3 {
        rig.tick(90);
        rig.done(&Request::KeepAlive);
        assert_eq!(rig.state(), State::Running);
    }
    let alive = rig.envelope();
    // Late frames, damaged ones and those of other sessions are none.
    rig.tick(60);
    rig.exchange(last, &Request::Status);
    rig.exchange(alive, &Request::KeepAlive);
    rig.receive(b"\x05abcd\0");
    let other = Envelope {
        session: 7,
        sequence: alive.sequence.wrapping_add(5),
    };
    rig.exchange(other, &Request::KeepAlive);
    rig.tick(60);
    assert!(matches!(rig.state(), State::Holding | State::Held));
}

#[test]
fn greetings_and_telemetry_alone_are_no_signs_of_life() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.run(CommsPolicy::Hold);
    for nonce in 100..105 {
        assert_eq!(rig.state(), State::Running);
        rig.tick(12);
        rig.hello(nonce);
        rig.tick(12);
        rig.done(&Request::SetTelemetry(TelemetryConfig::OFF));
    }
    assert!(matches!(rig.state(), State::Holding | State::Held));
}

#[test]
fn an_interrupted_upload_goes_on_in_the_next_session() {
    let mut rig = Rig::new();
    let trajectory = trajectory();
    let outline = Outline::of(&trajectory);
    let tag = outline.tag();
    let begin = Request::UploadBegin(outline.clone());
    let blocks = trajectory.coefficients().len().div_ceil(128) as u8;
    let arrived = |bits| Response::Upload(Arrived { tag, blocks, bits });
    assert_eq!(rig.ask(&begin), arrived(0));
    let bytes = block_bytes(&trajectory, 1);
    let block = Block {
        tag,
        block: 1,
        values: &bytes,
    };
    assert_eq!(rig.ask(&Request::UploadBlock(block)), arrived(0b10));
    assert_eq!(rig.ask(&Request::UploadBlock(block)), arrived(0b10));
    rig.hello(99);
    assert_eq!(rig.ask(&Request::UploadProgress), arrived(0b10));
    assert_eq!(rig.ask(&begin), arrived(0b10));
    assert_eq!(rig.upload(&trajectory), Response::Done);
    assert_eq!(rig.machine.executor.trajectory(), &trajectory);
    assert_eq!(
        rig.ask(&Request::UploadProgress),
        Response::Upload(Arrived::default())
    );
}

#[test]
fn a_window_of_the_longest_frames_is_not_lost() {
    let mut rig = Rig::new();
    let values = [0xff; 512];
    let block = Request::UploadBlock(Block {
        tag: u32::MAX,
        block: 31,
        values: &values,
    });
    for _ in 0..WINDOW {
        rig.sequence = rig.sequence.wrapping_add(1);
        let frame = framed(rig.envelope(), &block);
        rig.receive(&frame);
    }
    assert_eq!(rig.drain().len(), usize::from(WINDOW));
    assert_eq!(rig.link.counters().overrun_bytes, 0);

    // More than that is counted, and the next whole frame is answered again.
    for _ in 0..=WINDOW {
        rig.receive(&[1; MAX_FRAME_BYTES]);
    }
    assert_eq!(rig.link.counters().overrun_bytes, MAX_FRAME_BYTES as u32);
    assert_eq!(rig.drain(), []);
    rig.receive(&[0]);
    rig.done(&Request::KeepAlive);
    assert_eq!(rig.link.counters().damaged, 1);

    // So is what the board lost on the way to the link, as far as it can be counted.
    let before = rig.link.counters().overrun_bytes;
    rig.link.count_lost(3);
    assert_eq!(rig.link.counters().overrun_bytes, before + 3);
    rig.link.count_lost(u32::MAX);
    assert_eq!(rig.link.counters().overrun_bytes, u32::MAX);
}

/// A host that does not read: requests wait, nothing is lost, no response is left out.
#[test]
fn a_full_outbox_holds_requests_back() {
    let mut rig = Rig::new();
    let mut sent = 0;
    for _ in 0..400 {
        rig.sequence = rig.sequence.wrapping_add(1);
        let frame = framed(rig.envelope(), &Request::Status);
        if rig.link.free() < frame.len() {
            break;
        }
        rig.receive(&frame);
        sent += 1;
        rig.poll();
    }
    assert!(sent < 400);
    assert_eq!(rig.drain().len(), sent);
    assert_eq!(rig.link.counters().overrun_bytes, 0);
}

/// The host's side of the line takes a few bytes at a time.
#[test]
fn frames_are_whole_however_they_are_sent() {
    let mut rig = Rig::new();
    let mut bytes = Vec::new();
    let mut asked = 0;
    for step in 0..5_000 {
        if step % 20 == 0 && rig.link.free() > 100 {
            rig.sequence = rig.sequence.wrapping_add(1);
            let frame = framed(rig.envelope(), &Request::Status);
            rig.receive(&frame);
            asked += 1;
        }
        rig.poll();
        let taken = rig.link.transmit().len().min(step % 7);
        bytes.extend(&rig.link.transmit()[..taken]);
        rig.link.sent(taken);
    }
    while rig.poll() || !rig.link.transmit().is_empty() {
        bytes.extend(rig.link.transmit());
        // More than there is to send.
        rig.link.sent(usize::MAX);
    }
    assert_eq!(rig.link.transmit(), []);
    let mut decoder = FrameDecoder::new();
    let mut answered = 0;
    for byte in bytes {
        if let Some(payload) = decoder.feed(byte) {
            payload.unwrap();
            answered += 1;
        }
    }
    assert_eq!(answered, asked);
    rig.done(&Request::KeepAlive);
}

#[test]
fn a_sound_frame_that_is_no_request_is_answered_so() {
    let mut rig = Rig::new();
    let denied = |bytes| Response::Denied(Denial::NotUnderstood { bytes });
    let mut buffer = [0; MAX_FRAME_BYTES];
    for (body, bytes) in [([99u8, 0, 0, 0, 0], 5), ([1, 1, 1, 1, 1], 5)] {
        rig.sequence = rig.sequence.wrapping_add(1);
        let frame = stillpoint_shared::protocol::frame::encode(rig.envelope(), &body, &mut buffer);
        rig.receive(frame.unwrap());
        let messages = rig.drain();
        assert_eq!(messages.len(), 1);
        assert_eq!(
            messages[0].1,
            stillpoint_shared::protocol::Message::Response(denied(bytes))
        );
    }
}

proptest! {
    /// Arbitrary bytes do nothing but count.
    #[test]
    fn arbitrary_bytes_only_count(bytes in prop::collection::vec(any::<u8>(), 0..4000)) {
        let mut rig = Rig::new();
        let before = rig.ask(&Request::Status);
        for piece in bytes.chunks(500) {
            rig.receive(piece);
            prop_assert_eq!(rig.drain(), []);
        }
        rig.receive(&[0]);
        rig.drain();
        let after = rig.ask(&Request::Status);
        let (Response::Status(before), Response::Status(after)) = (before, after) else {
            panic!("no status");
        };
        prop_assert_eq!(after.link.overrun_bytes, 0);
        prop_assert_eq!(after.link.requests, before.link.requests + 1);
        let zeroed = |mut status: stillpoint_shared::protocol::Status| {
            status.link = Default::default();
            status
        };
        prop_assert_eq!(zeroed(after), zeroed(before));
    }
}
