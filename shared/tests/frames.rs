//! Frames on a stream of bytes that loses, changes and adds some.

use proptest::prelude::*;
use stillpoint_shared::assembly::{Arrived, BLOCK_VALUES, Outline};
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, DriveConfig, Mapping};
use stillpoint_shared::protocol::frame::{self, MAX_PAYLOAD_BYTES};
use stillpoint_shared::protocol::{
    AxisStatus, Block, Capacities, Channels, Denial, Envelope, FaultAxis, FaultHead, FaultSample,
    FrameDecoder, FrameError, Greeting, Hello, Identity, LinkCounters, MAX_FRAME_BYTES,
    MAX_TELEMETRY_BYTES, Message, Request, Response, Status, StoredMove, Telemetry, Versions,
};
use stillpoint_shared::status::{
    Command, CommsPolicy, DriveStatus, Fault, FaultCause, HoldReason, LimitFlags, Place, Quantity,
    Refusal, Rejection, StartRequest, State,
};
use stillpoint_shared::trajectory::{MAX_INTERVALS, Span};
use stillpoint_shared::{AxisLimits, Limits};

const ENVELOPE: Envelope = Envelope {
    session: 300,
    sequence: 7,
};

/// Raw bytes as a body: postcard writes a tuple of bytes as they are.
struct Raw<'a>(&'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

fn framed(body: &impl serde::Serialize) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    frame::encode(ENVELOPE, body, &mut buffer).unwrap().to_vec()
}

/// What a decoder makes of a stream: payloads and errors in order.
fn decoded(stream: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
    let mut decoder = FrameDecoder::new();
    let frames = stream
        .iter()
        .filter_map(|&byte| decoder.feed(byte).map(|frame| frame.map(<[u8]>::to_vec)));
    frames.collect()
}

/// The body of a stream with one sound frame among whatever else.
fn sound(stream: &[u8]) -> Vec<Vec<u8>> {
    let whole = decoded(stream).into_iter().flatten();
    whole
        .map(|payload| {
            let (envelope, body) = frame::open(&payload).unwrap();
            assert_eq!(envelope, ENVELOPE);
            body.to_vec()
        })
        .collect()
}

/// The wire as bytes, computed by another program: when one of these changes, so does the protocol.
#[test]
fn golden_bytes() {
    let start = Request::Start(StartRequest {
        trajectory_hash: 0x0102_0304_0506_0708,
        limits_hash: 3,
        comms: CommsPolicy::Hold,
        comms_timeout_ticks: 4000,
        dry_run: false,
    });
    let refused = Message::Response(Response::Denied(Denial::Executor(Refusal::WrongState {
        command: Command::Start,
        state: State::Ready,
    })));
    let block = Request::UploadBlock(Block {
        tag: 0xff,
        block: 2,
        values: &1.0f32.to_le_bytes(),
    });
    let golden: [(Vec<u8>, &str); 4] = [
        (framed(&Request::Hold), "09ac02070b80e2eefd00"),
        (
            framed(&start),
            "12ac02070a888e98a8c0e08081010301a01f05f6fc7f1200",
        ),
        (framed(&refused), "04ac0207030103070602511c9af400"),
        (framed(&block), "09ac020704ff0102040107803fad73e45400"),
    ];
    for (frame, expected) in golden {
        let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(hex, expected);
    }
}

#[test]
fn the_largest_messages_fit() {
    let outline = Outline {
        id: u32::MAX,
        axes: 6,
        limits_hash: u64::MAX,
        content_hash: u64::MAX,
        spans: [Span {
            duration_ticks: u32::MAX,
            points: 32,
        }; MAX_INTERVALS]
            .into_iter()
            .collect(),
    };
    let block = Block {
        tag: u32::MAX,
        block: 31,
        values: &[0xff; 4 * BLOCK_VALUES],
    };
    let hello = Request::Hello(Hello {
        versions: Versions::OWN,
        nonce: u32::MAX,
    });
    for request in [
        Request::UploadBegin(outline),
        Request::UploadBlock(block),
        hello,
    ] {
        let frame = framed(&request);
        let bodies = sound(&frame);
        assert_eq!(frame::read(&bodies[0]), Ok(request));
    }
}

/// All numbers as long as they can be.
#[test]
fn the_largest_responses_fit() {
    let versions = Versions {
        oldest: u16::MAX,
        newest: u16::MAX,
        schema_hash: u32::MAX,
    };
    let name = || "sixteen bytes ..".try_into().unwrap();
    let capacities = Capacities::new(u8::MAX, u32::MAX);
    let identity = Identity {
        greeting: Greeting {
            versions,
            session: u16::MAX,
            board: name(),
            firmware: name(),
            build_id: u64::MAX,
        },
        axes: u8::MAX,
        period_ticks: u32::MAX,
        capacities,
        state: State::Fault,
        limits_hash: u64::MAX,
        loaded: Some(u64::MAX),
        stored: all(u64::MAX),
    };
    let at = Place {
        axis: u8::MAX,
        interval: u8::MAX,
        ticks: u32::MAX,
    };
    let rejection = Rejection::Jump {
        at,
        quantity: Quantity::Torque,
        before: 1.0,
        after: 1.0,
        tolerance: 1.0,
    };
    let fault = Fault {
        cause: FaultCause::CommsLost {
            silent_ticks: u32::MAX,
            limit_ticks: u32::MAX,
        },
        tick: u64::MAX,
    };
    let limited = LimitFlags::from_bits(u8::MAX);
    let axis = AxisStatus {
        drive: Some(DriveStatus::Fault { code: u16::MAX }),
        measured_rad: Some(1.0),
        following_peak_rad: 1.0,
        limited,
    };
    let counters = LinkCounters {
        requests: u32::MAX,
        damaged: u32::MAX,
        overrun_bytes: u32::MAX,
        repeated: u32::MAX,
        dropped: u32::MAX,
    };
    let status = Status {
        state: State::Fault,
        held_by: Some(HoldReason::CommsLost),
        fault: Some(fault),
        tick: u64::MAX,
        path_ticks: u32::MAX,
        duration_ticks: u32::MAX,
        loaded: Some(u64::MAX),
        limits_hash: u64::MAX,
        override_percent: u8::MAX,
        dry_run: true,
        axes: all(axis),
        upload: Arrived {
            tag: u32::MAX,
            blocks: u8::MAX,
            bits: u32::MAX,
        },
        link: counters,
    };
    let stored = StoredMove {
        id: u32::MAX,
        content_hash: u64::MAX,
        limits_hash: u64::MAX,
        duration_ticks: u32::MAX,
        bytes: u32::MAX,
    };
    let limits = AxisLimits {
        torque_nm: 1.0,
        torque_rate_nm_per_s: 1.0,
        speed_rad_per_s: 1.0,
        knee_speed_rad_per_s: 1.0,
        slope_nm_s_per_rad: 1.0,
    };
    let drives = [0, 0, 0, 1, 1, 1]
        .into_iter()
        .zip(100..)
        .map(|(bus, node)| AxisDrive {
            bus,
            node,
            counts_per_turn: 1e6,
            reversed: true,
            home_counts: i32::MIN,
            home_rad: 0.5,
            gear_ratio: 33.0,
            rated_torque_nm: 1.27,
            torque_limit_permille: 32_767,
            mapping: Mapping::Write,
            tells_following: true,
        });
    let drives: Vec<_> = drives.collect();
    let bus = BusConfig {
        period_us: 20_000,
        heartbeat_ms: 20_000,
        heartbeat_timeout_ms: 65_535,
        ..BusConfig::default()
    };
    let drives = DriveConfig::new(bus, &drives).unwrap();
    let head = FaultHead {
        fault,
        build_id: u64::MAX,
        trajectory_hash: u64::MAX,
        period_ticks: u32::MAX,
        samples: u16::MAX,
    };
    let axis = FaultAxis {
        following_error_rad: 1.0,
        velocity_rad_per_s: 1.0,
        torque_nm: 1.0,
    };
    let sample = FaultSample {
        tick: u32::MAX,
        path_ticks: u32::MAX,
        state: Some(State::Fault),
        limited,
        path_speed: u8::MAX,
        age_ticks: u8::MAX,
        axes: all(axis),
    };
    for response in [
        Response::Hello(identity),
        Response::Denied(Denial::Executor(Refusal::Rejected(rejection))),
        Response::Status(status),
        Response::Stored(all(stored)),
        Response::Limits(Limits::new(&[limits; 6]).unwrap()),
        Response::Drives(Some(drives)),
        Response::Fault(Some(head)),
        Response::FaultSamples(all(sample)),
    ] {
        let message = Message::Response(response);
        let bodies = sound(&framed(&message));
        assert_eq!(frame::read(&bodies[0]), Ok(message));
    }

    let telemetry = Message::Telemetry(Telemetry {
        tick: u64::MAX,
        dropped: u32::MAX,
        state: State::Fault,
        path_ticks: u32::MAX,
        path_speed: 1.0,
        channels: Channels::ALL,
        values: all(1.0),
        limited: all(limited),
    });
    let mut buffer = [0; MAX_FRAME_BYTES];
    let envelope = Envelope {
        session: u16::MAX,
        sequence: u16::MAX,
    };
    let frame = frame::encode(envelope, &telemetry, &mut buffer).unwrap();
    assert!(frame.len() <= MAX_TELEMETRY_BYTES, "{}", frame.len());
}

/// As many as fit.
fn all<T: Clone, const N: usize>(value: T) -> heapless::Vec<T, N> {
    std::iter::repeat_n(value, N).collect()
}

#[test]
fn a_message_too_long_for_a_frame_or_its_buffer_is_refused() {
    let mut buffer = [0; 2 * MAX_FRAME_BYTES];
    let envelope_bytes = 3;
    let most = MAX_PAYLOAD_BYTES - envelope_bytes;
    let fits = frame::encode(ENVELOPE, &Raw(&vec![1; most]), &mut buffer).unwrap();
    assert_eq!(fits.len(), MAX_FRAME_BYTES);
    assert_eq!(sound(fits), [vec![1; most]]);
    let refused = frame::encode(ENVELOPE, &Raw(&vec![1; most + 1]), &mut buffer);
    assert_eq!(
        refused,
        Err(FrameError::TooLong {
            most: MAX_FRAME_BYTES
        })
    );
    for available in 0..10 {
        let refused = frame::encode(ENVELOPE, &Request::Hold, &mut buffer[..available]);
        assert!(refused.is_err(), "{available} bytes");
    }
}

#[test]
fn an_overlong_frame_is_refused_and_the_next_is_whole() {
    let mut stream = vec![1; 5 * MAX_FRAME_BYTES];
    stream.push(0);
    stream.extend(framed(&Request::Status));
    let frames = decoded(&stream);
    let most = MAX_FRAME_BYTES;
    assert_eq!(frames[0], Err(FrameError::TooLong { most }));
    assert!(frames[1].is_ok());
    assert_eq!(frames.len(), 2);
}

#[test]
fn a_body_with_bytes_left_over_is_none() {
    let mut body = vec![1];
    assert_eq!(frame::read(&body), Ok(Request::Status));
    body.push(0);
    assert_eq!(
        frame::read::<Request<'_>>(&body),
        Err(FrameError::Body { bytes: 2 })
    );
    // A bool of 2, a string that is no UTF-8, an enum without such a variant.
    assert!(frame::read::<bool>(&[2]).is_err());
    assert!(frame::read::<Request<'_>>(&[99]).is_err());
}

proptest! {
    #[test]
    fn any_body_comes_back(body in prop::collection::vec(any::<u8>(), 0..=MAX_PAYLOAD_BYTES - 3)) {
        let frame = framed(&Raw(&body));
        prop_assert!(frame.len() <= MAX_FRAME_BYTES);
        prop_assert_eq!(frame.iter().position(|&byte| byte == 0), Some(frame.len() - 1));
        prop_assert_eq!(sound(&frame), [body]);
    }

    #[test]
    fn a_frame_after_any_bytes_and_a_zero_is_whole(
        before in prop::collection::vec(any::<u8>(), 0..1500),
        body in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let mut stream = before;
        stream.push(0);
        stream.extend(framed(&Raw(&body)));
        let frames = decoded(&stream);
        let last = frames.last().unwrap().as_ref().unwrap();
        prop_assert_eq!(frame::open(last).unwrap(), (ENVELOPE, body.as_slice()));
    }

    /// One wrong byte anywhere: no frame comes out that was not sent.
    #[test]
    fn a_changed_byte_is_noticed(
        body in prop::collection::vec(any::<u8>(), 0..300),
        place in any::<prop::sample::Index>(),
        change in 1u8..,
    ) {
        let mut stream = framed(&Raw(&body));
        let place = place.index(stream.len());
        stream[place] ^= change;
        stream.push(0);
        prop_assert_eq!(sound(&stream), Vec::<Vec<u8>>::new());
    }

    #[test]
    fn a_cut_frame_is_noticed(
        body in prop::collection::vec(any::<u8>(), 0..300),
        place in any::<prop::sample::Index>(),
    ) {
        let mut stream = framed(&Raw(&body));
        stream.truncate(place.index(stream.len() - 1));
        stream.push(0);
        prop_assert_eq!(sound(&stream), Vec::<Vec<u8>>::new());
    }
}
