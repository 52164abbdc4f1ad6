//! Every message.

use serde::{Deserialize, Serialize};
use stillpoint_shared::protocol::{
    Denial, Envelope, MAX_FRAME_BYTES, Message, Request, Response, frame,
};

const ENVELOPE: Envelope = Envelope {
    session: u16::MAX,
    sequence: u16::MAX,
};

/// Whatever bytes are read as a message: no panic; what is a message fits a frame, and written and read again it is
/// the same; a refusal has words.
pub fn messages(data: &[u8]) {
    if let Some(Request::SetLimits(axes)) = same::<Request<'_>>(data) {
        let _ = stillpoint_shared::Limits::new(&axes).map_err(|error| error.to_string());
    }
    if let Some(Message::Response(Response::Denied(denial))) = same::<Message>(data) {
        assert!(!denial.to_string().is_empty());
    }
    if let Some(denial) = same::<Denial>(data) {
        assert!(!denial.to_string().is_empty());
    }
}

fn same<'a, T: Deserialize<'a> + Serialize>(data: &'a [u8]) -> Option<T> {
    let value: T = frame::read(data).ok()?;
    let mut first = [0; MAX_FRAME_BYTES];
    frame::encode(ENVELOPE, &value, &mut first).expect("every message fits a frame");
    // Numbers can be written longer than needed, and NaN is not equal to itself: bytes are compared, after one turn.
    let mut bytes = [0; 2 * MAX_FRAME_BYTES];
    let written = postcard::to_slice(&value, &mut bytes).expect("it fits");
    assert!(written.len() <= data.len());
    Some(value)
}
