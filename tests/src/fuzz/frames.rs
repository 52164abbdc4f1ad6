//! The frame decoder.

use serde::ser::{Serialize, SerializeTuple, Serializer};
use stillpoint_shared::protocol::frame::{self, MAX_PAYLOAD_BYTES};
use stillpoint_shared::protocol::{Envelope, FrameDecoder, MAX_FRAME_BYTES};

/// Bytes as they are.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Whatever bytes arrive: no panic, nothing longer than a payload comes out, and what comes out is a frame again.
/// The same bytes as a body: they come back.
pub fn frames(data: &[u8]) {
    let mut decoder = FrameDecoder::new();
    for &byte in data {
        if let Some(Ok(payload)) = decoder.feed(byte) {
            assert!(payload.len() <= MAX_PAYLOAD_BYTES);
            if let Ok((envelope, body)) = frame::open(payload) {
                comes_back(envelope, body);
            }
        }
    }
    let envelope = Envelope {
        session: data.first().map_or(0, |&byte| u16::from(byte) << 7),
        sequence: data.len() as u16,
    };
    comes_back(envelope, &data[..data.len().min(MAX_PAYLOAD_BYTES - 6)]);
}

/// A frame with any bytes as its body.
pub(super) fn framed<'b>(envelope: Envelope, body: &[u8], buffer: &'b mut [u8]) -> &'b mut [u8] {
    frame::encode(envelope, &Raw(body), buffer).expect("it fits")
}

fn comes_back(envelope: Envelope, body: &[u8]) {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let written = framed(envelope, body, &mut buffer);
    let (last, inside) = written.split_last().expect("a frame has bytes");
    assert!(*last == 0 && !inside.contains(&0));
    let mut decoder = FrameDecoder::new();
    for &byte in inside {
        assert!(decoder.feed(byte).is_none());
    }
    let payload = decoder
        .feed(0)
        .expect("the frame ends")
        .expect("it is sound");
    assert_eq!(frame::open(payload), Ok((envelope, body)));
}
