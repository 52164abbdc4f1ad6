//! Greetings of another version.

use std::time::Duration;

use stillpoint::device::{Session, Transport};
use stillpoint_shared::protocol::{
    Envelope, FrameDecoder, Hello, Message, Request, Response, Versions, frame,
};

use super::super::bench::PATIENCE;

/// Greets by hand, and returns the session that the board opens: 0 for none.
fn greet<T: Transport>(line: &mut T, versions: Versions) -> (u16, Versions) {
    let hello = Request::Hello(Hello { versions, nonce: 5 });
    let envelope = Envelope {
        session: 0,
        sequence: 77,
    };
    let mut buffer = [0; 256];
    line.send(frame::encode(envelope, &hello, &mut buffer).unwrap())
        .unwrap();
    let mut decoder = FrameDecoder::new();
    let mut bytes = [0; 64];
    let deadline = line.now() + PATIENCE;
    while line.now() < deadline {
        let timeout = Duration::from_millis(50);
        let count = line.receive(&mut bytes, timeout).unwrap();
        for &byte in &bytes[..count] {
            let Some(Ok(payload)) = decoder.feed(byte) else {
                continue;
            };
            let (_, body) = frame::open(payload).unwrap();
            let Ok(Message::Response(Response::Hello(identity))) = frame::read(body) else {
                continue;
            };
            return (identity.greeting.session, identity.greeting.versions);
        }
    }
    panic!("no answer to the greeting");
}

/// Another version, or other messages under the same number, open no session.
pub(super) fn versions<T: Transport>(session: &mut Session<T>) {
    let own = Versions::OWN;
    let line = session.transport_mut();
    let newer = Versions {
        oldest: own.newest + 1,
        newest: own.newest + 1,
        ..own
    };
    let odd = Versions {
        schema_hash: own.schema_hash ^ 1,
        ..own
    };
    for versions in [newer, odd] {
        assert_eq!(greet(line, versions), (0, own));
    }
    assert_ne!(greet(line, own).0, 0);
}
