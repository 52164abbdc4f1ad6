//! Bytes to begin with: sound ones, of every kind.

use super::trajectory::limits;
use std::sync::OnceLock;
use stillpoint_shared::assembly::Outline;
use stillpoint_shared::protocol::{
    Channels, Denial, Envelope, Hello, MAX_FRAME_BYTES, Message, Request, Response, Telemetry,
    TelemetryConfig, Versions, frame,
};
use stillpoint_shared::status::{LimitFlags, Refusal, State};
use stillpoint_shared::{Trajectory, TrajectoryBuilder, lgr};

/// Bytes for one of the targets, with a name.
pub struct Seed {
    /// Name of the target.
    pub target: &'static str,
    /// Name of the seed.
    pub name: &'static str,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Where the moves start, in rad.
pub(super) fn start_rad() -> [f32; 2] {
    [0.25, -1.0]
}

/// A quintic from rest to rest on two axes.
fn quintic(id: u32, reach_rad: f64, intervals: usize, points: usize) -> Trajectory {
    let mut nodes = vec![0.0; points + 1];
    lgr::support_nodes(&mut nodes).expect("these are points");
    let interval_ticks = 400_000 / intervals as u32;
    let duration_s = f64::from(interval_ticks) * intervals as f64 * 1e-7;
    let mut builder = TrajectoryBuilder::new(id, limits());
    for interval in 0..intervals {
        let mut rows = Vec::new();
        for node in &nodes {
            let s = (interval as f64 + (node + 1.0) / 2.0) / intervals as f64;
            let position = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let velocity = 30.0 * s * s * (1.0 - s).powi(2) / duration_s;
            let torque = 6.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration_s.powi(2);
            rows.extend(start_rad().map(|start| f64::from(start) + reach_rad * position));
            rows.extend([reach_rad * velocity; 2]);
            rows.extend([reach_rad * torque; 2]);
        }
        builder
            .interval(interval_ticks, points, &rows)
            .expect("it fits");
    }
    builder.finish().expect("it has intervals")
}

/// Two moves that are accepted.
pub(super) fn valid_move(which: u8) -> &'static Trajectory {
    static MOVES: OnceLock<[Trajectory; 2]> = OnceLock::new();
    let moves = MOVES.get_or_init(|| [quintic(1, 0.1, 2, 6), quintic(2, 0.05, 1, 12)]);
    &moves[usize::from(which % 2)]
}

/// A short one of this name; `version` tells it from another of the same name.
pub(super) fn small_move(id: u32, version: u32) -> Trajectory {
    let mut builder = TrajectoryBuilder::new(id, limits());
    let rows = [0.25, -1.0, 0.0, 0.0, 0.0, 0.0].repeat(3);
    builder
        .interval(10_000 + version, 2, &rows)
        .expect("it fits");
    builder.finish().expect("it has an interval")
}

/// A trajectory as the target of that name reads it.
fn as_upload(trajectory: &Trajectory, during: &[u8]) -> Vec<u8> {
    let spans = Outline::of(trajectory).spans;
    let mut bytes = vec![spans.len() as u8];
    for span in &spans {
        bytes.extend(span.duration_ticks.to_le_bytes());
        bytes.push(span.points);
    }
    for value in trajectory.coefficients() {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(during);
    bytes
}

fn body(message: &impl serde::Serialize) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    postcard::to_slice(message, &mut buffer)
        .expect("it fits")
        .to_vec()
}

/// All seeds.
pub fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    let mut seed = |target, name, bytes| {
        seeds.push(Seed {
            target,
            name,
            bytes,
        });
    };

    let hello = Request::Hello(Hello {
        versions: Versions::OWN,
        nonce: 7,
    });
    let begin = Request::UploadBegin(Outline::of(valid_move(0)));
    let telemetry = Message::Telemetry(Telemetry {
        tick: 1_000_000,
        dropped: 3,
        state: State::Running,
        path_ticks: 250_000,
        path_speed: 1.0,
        channels: Channels::ALL,
        values: (0..10u8).map(f32::from).collect(),
        limited: [LimitFlags::NONE, LimitFlags::TORQUE].into_iter().collect(),
    });
    let refusal = Denial::Executor(Refusal::NoFeedback);
    let denied = Message::Response(Response::Denied(refusal));
    let set = Request::SetTelemetry(TelemetryConfig {
        every_ticks: 10,
        channels: Channels::ALL,
    });
    let limits_of = Request::SetLimits(limits().axes().iter().copied().collect());
    let config = Request::SetConfig(Default::default());
    for (name, bytes) in [
        ("hello", body(&hello)),
        ("begin", body(&begin)),
        ("set-telemetry", body(&set)),
        ("limits", body(&limits_of)),
        ("config", body(&config)),
        ("telemetry", body(&telemetry)),
        ("denied", body(&denied)),
        ("done", body(&Message::Response(Response::Done))),
    ] {
        seed("messages", name, bytes);
    }

    let envelope = Envelope {
        session: 300,
        sequence: 1,
    };
    let mut buffer = [0; MAX_FRAME_BYTES];
    let mut stream = frame::encode(envelope, &hello, &mut buffer)
        .expect("it fits")
        .to_vec();
    seed("frames", "hello", stream.clone());
    stream.extend_from_slice(frame::encode(envelope, &begin, &mut buffer).expect("it fits"));
    seed("frames", "two", stream);
    seed("frames", "long-run", vec![1; 600]);

    seed("trajectory", "one-interval", as_upload(valid_move(1), &[]));
    seed(
        "trajectory",
        "held",
        as_upload(valid_move(0), &[0, 1, 0, 0, 0, 0, 0, 0, 2]),
    );
    seed(
        "trajectory",
        "slowed",
        as_upload(valid_move(0), &[130, 0, 0, 110, 100, 0, 0, 200]),
    );
    seed("trajectory", "still", as_upload(&small_move(1, 1), &[]));

    seed(
        "store",
        "blank",
        vec![0, 0, 0, 0, 5, 10, 0, 5, 10, 15, 2, 3, 0, 4],
    );
    let mut stored = vec![3, 0, 0];
    let moves = [small_move(1, 1), small_move(2, 1)];
    stored.push(2);
    for trajectory in &moves {
        let mut encoded = vec![0; 1024];
        let encoded = trajectory.encode(&mut encoded).expect("it fits");
        stored.extend([2, 1, 1, trajectory.header().id as u8]);
        stored.extend((encoded.len() as u16).to_le_bytes());
        stored.extend_from_slice(encoded);
    }
    let content = (stored.len() - 3) as u16;
    stored[1..3].copy_from_slice(&content.to_le_bytes());
    stored.extend([0, 5, 2, 3, 4]);
    seed("store", "records", stored);

    // A move with everything that belongs to it, then a hold, a fault and a store.
    let order = |choice: u8| [200, choice];
    let upload = [0, 3, 4, 5, 6, 7, 8, 9].map(order).concat();
    let play = [
        &order(13)[..],
        &[5, 20],
        &order(16),
        &[5, 250, 5, 250, 5, 250],
    ]
    .concat();
    seed("board", "move", [&upload[..], &play, &order(15)].concat());
    let hold = [
        &order(19)[..],
        &[5, 250],
        &order(20),
        &order(22),
        &[5, 250],
        &order(23),
    ]
    .concat();
    let held = [
        &upload[..],
        &order(13),
        &[5, 20],
        &order(16),
        &[5, 50],
        &hold,
        &order(25),
        &order(26),
    ]
    .concat();
    seed("board", "held", held);
    let raw = [
        100, 3, 20, 10, 63, 0, 0, 5, 40, 5, 40, 62, 4, 1, 2, 3, 4, 60, 1, 0, 0, 0,
    ];
    seed("board", "noise", [&upload[..], &raw].concat());
    seeds
}
