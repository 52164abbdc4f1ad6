//! What a board refuses, through the wire: on the emulated board and, the same again, on the simulated one.

use std::collections::BTreeSet;
use std::fmt::Debug;

use stillpoint::device::{DeviceError, Session, Settings, Simulated, Transport};
use stillpoint_firmware::bench::{AXES, Action};
use stillpoint_firmware::{Command, FaultCause, Refusal, Rejection, State};
use stillpoint_shared::assembly::{AssemblyError, Outline};
use stillpoint_shared::protocol::{
    Block, Denial, Envelope, FrameDecoder, Hello, Message, Request, Response, SCHEMA, StoreError,
    Versions, frame,
};
use stillpoint_shared::status::{CommsPolicy, Limit, Quantity, StartRequest};
use stillpoint_shared::trajectory::Span;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder, TrajectoryError};

use super::bench::{Bench, first_rad, paper, start_request};

const POINTS: usize = 8;
const INTERVALS: usize = 2;
const INTERVAL_TICKS: u32 = 100_000;

/// A move that stays at the start of the paper's, with values changed: by interval, node, quantity (as in a row) and
/// axis.
fn changed(
    limits: &Limits,
    change: impl Fn(usize, usize, Quantity, usize) -> Option<f64>,
) -> Trajectory {
    let axes = limits.axes().len();
    let first = first_rad(&paper().1);
    let mut builder = TrajectoryBuilder::new(7, limits);
    for interval in 0..INTERVALS {
        let mut values = Vec::new();
        for node in 0..=POINTS {
            for quantity in Quantity::ALL {
                for axis in 0..axes {
                    let usual = match quantity {
                        Quantity::Position => f64::from(first[axis]),
                        _ => 0.0,
                    };
                    values.push(change(interval, node, quantity, axis).unwrap_or(usual));
                }
            }
        }
        builder.interval(INTERVAL_TICKS, POINTS, &values).unwrap();
    }
    builder.finish().unwrap()
}

/// The same with one value of one node in the first interval.
fn with_value(node: usize, quantity: Quantity, value: f64) -> Trajectory {
    changed(&paper().0, |i, n, q, a| {
        (i == 0 && n == node && q == quantity && a == 1).then_some(value)
    })
}

/// The same with one quantity of one axis throughout.
fn throughout(quantity: Quantity, value: f64) -> Trajectory {
    changed(&paper().0, |_, _, q, a| {
        (q == quantity && a == 1).then_some(value)
    })
}

fn refusal(error: DeviceError) -> Refusal {
    match error {
        DeviceError::Denied(Denial::Executor(refusal)) => refusal,
        error => panic!("{error}"),
    }
}

fn rejected<T: Transport>(session: &mut Session<T>, trajectory: &Trajectory) -> Rejection {
    let error = session.upload(trajectory, |_| {}).unwrap_err();
    match refusal(error) {
        Refusal::Rejected(rejection) => rejection,
        refusal => panic!("{refusal}"),
    }
}

/// Name of a variant.
fn name(value: &impl Debug) -> String {
    let debug = format!("{value:?}");
    let end = debug.find(|c: char| !c.is_ascii_alphanumeric());
    debug[..end.unwrap_or(debug.len())].to_owned()
}

/// Names of an enum's variants by the protocol's schema.
fn variants(of: &str) -> BTreeSet<String> {
    let heading = format!("{of} enum");
    let lines = SCHEMA.lines().skip_while(|line| *line != heading).skip(1);
    let lines = lines.take_while(|line| line.starts_with(' '));
    let names = lines.map(|line| line.split_whitespace().nth(1).unwrap());
    let end = |name: &str| {
        name.find(|c: char| !c.is_ascii_alphanumeric())
            .unwrap_or(name.len())
    };
    names.map(|name| name[..end(name)].to_owned()).collect()
}

fn is_at_axis_1(rejection: &Rejection, wanted: Quantity) -> bool {
    match *rejection {
        Rejection::NotFinite { at, quantity }
        | Rejection::Jump { at, quantity, .. }
        | Rejection::NotStill { at, quantity, .. } => at.axis == 1 && quantity == wanted,
        _ => false,
    }
}

/// Uploads a trajectory with a value that no builder takes, under the hash that its bytes then have.
fn upload_raw<T: Transport>(session: &mut Session<T>, node: usize, value: f32) -> Refusal {
    let sound = throughout(Quantity::Torque, 0.0);
    let mut values = sound.coefficients().to_vec();
    values[node * 3 * AXES + 2 * AXES + 1] = value;
    let mut outline = Outline::of(&sound);
    // The board says which hash it finds.
    loop {
        session
            .order(&Request::UploadBegin(outline.clone()))
            .unwrap();
        for (block, values) in (0..).zip(values.chunks(128)) {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let tag = outline.tag();
            let values = &bytes;
            let block = Request::UploadBlock(Block { tag, block, values });
            session.order(&block).unwrap();
        }
        let content_hash = outline.content_hash;
        let commit = Request::UploadCommit { content_hash };
        match refusal(session.order(&commit).unwrap_err()) {
            Refusal::Upload(AssemblyError::Trajectory(TrajectoryError::ContentHash {
                stored,
                computed,
            })) => {
                assert_eq!(stored, content_hash);
                outline.content_hash = computed;
            }
            refusal => return refusal,
        }
    }
}

/// Every reason of acceptance, with the place and the number.
fn rejections<T: Transport>(session: &mut Session<T>) {
    let (limits, trajectory) = paper();
    let mut seen = BTreeSet::new();
    let mut limits_seen = BTreeSet::new();
    let mut see = |rejection: Rejection, fits: bool| {
        assert!(fits, "{rejection:?}");
        seen.insert(name(&rejection));
        if let Rejection::Exceeds { limit, .. } = rejection {
            limits_seen.insert(name(&limit));
        }
    };
    // What is loaded stays loaded, whatever is refused afterwards.
    session.upload(trajectory, |_| {}).unwrap();

    let two = Limits::new(&limits.axes()[..2]).unwrap();
    let found = rejected(session, &changed(&two, |_, _, _, _| None));
    let (trajectory_axes, machine) = (2, 3);
    let wanted = Rejection::Axes {
        trajectory: trajectory_axes,
        machine,
    };
    see(found, found == wanted);

    let mut weaker = limits.axes().to_vec();
    weaker[0].torque_nm *= 0.5;
    let weaker = Limits::new(&weaker).unwrap();
    let found = rejected(session, &changed(&weaker, |_, _, _, _| None));
    let wanted = Rejection::LimitsHash {
        trajectory: weaker.hash(),
        machine: limits.hash(),
    };
    see(found, found == wanted);

    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let Refusal::Rejected(found) = upload_raw(session, 3, value) else {
            panic!("{value} is no torque");
        };
        see(found, is_at_axis_1(&found, Quantity::Torque));
    }

    for quantity in Quantity::ALL {
        let usual = match quantity {
            Quantity::Position => f64::from(first_rad(trajectory)[1]),
            _ => 0.0,
        };
        let found = rejected(session, &with_value(POINTS, quantity, usual + 1e-3));
        let at_the_joint = matches!(found, Rejection::Jump { at, .. } if at.interval == 1);
        see(found, is_at_axis_1(&found, quantity) && at_the_joint);
    }

    let elsewhere_rad = f64::from(first_rad(trajectory)[1]) + 0.01;
    let found = rejected(session, &throughout(Quantity::Position, elsewhere_rad));
    let fits = matches!(
        found,
        Rejection::StartsElsewhere { at, measured_rad, tolerance_rad, .. }
            if at.axis == 1 && measured_rad == first_rad(trajectory)[1] && tolerance_rad == 1e-3
    );
    see(found, fits);

    for (quantity, value) in [(Quantity::Velocity, 1.0), (Quantity::Torque, 5.0)] {
        let found = rejected(session, &throughout(quantity, value));
        see(found, is_at_axis_1(&found, quantity));
    }

    // The limits, each by a value just beyond it that no other one forbids.
    let axis = limits.axes()[1];
    let speed = f64::from(axis.speed_rad_per_s);
    let knee = f64::from(axis.knee_speed_rad_per_s);
    let half_way = 0.5 * (knee + speed);
    let available = f64::from(axis.available_torque_nm(half_way as f32));
    let torque = f64::from(axis.torque_nm);
    let fast_and_strong = |velocity: f64, torque: f64| {
        changed(limits, |_, _, q, a| match q {
            Quantity::Velocity if a == 1 => Some(velocity),
            Quantity::Torque if a == 1 => Some(torque),
            _ => None,
        })
    };
    // From nothing to this in two nodes of 10 ms: far too fast.
    let steep = with_value(4, Quantity::Torque, 0.5 * torque);
    for (trajectory, wanted) in [
        (fast_and_strong(1.01 * speed, 0.0), Limit::Speed),
        (fast_and_strong(0.0, -1.01 * torque), Limit::Torque),
        (
            fast_and_strong(half_way, 1.01 * available),
            Limit::TorqueSpeed,
        ),
        (steep, Limit::TorqueRate),
    ] {
        let found = rejected(session, &trajectory);
        let fits = matches!(
            found,
            Rejection::Exceeds { at, limit, value, allowed }
                if at.axis == 1 && limit == wanted && value.abs() > allowed
        );
        see(found, fits);
    }
    assert_eq!(seen, variants("Rejection"));
    assert_eq!(limits_seen, variants("Limit"));
    let loaded = session.status().unwrap().loaded;
    assert_eq!(loaded, Some(trajectory.header().content_hash));
}

/// Uploads that are no trajectories, or do not fit together.
fn uploads<T: Transport>(session: &mut Session<T>) {
    let sound = throughout(Quantity::Torque, 0.0);
    let outline = Outline::of(&sound);
    let mut seen = BTreeSet::new();
    let span = |duration_ticks, points| Span {
        duration_ticks,
        points,
    };
    let cases: [(&[Span], TrajectoryError); 6] = [
        (&[], TrajectoryError::NoIntervals),
        (
            &[span(9, 8), span(9, 1)],
            TrajectoryError::Points {
                interval: 1,
                points: 1,
            },
        ),
        (
            &[span(9, 8), span(0, 8)],
            TrajectoryError::NoDuration { interval: 1 },
        ),
        (
            &[span(u32::MAX, 8), span(1, 8)],
            TrajectoryError::TooLong { interval: 1 },
        ),
        (
            &[2, 3, 4, 5, 6, 7, 8, 9, 10].map(|points| span(9, points)),
            TrajectoryError::TooManyBases { interval: 8 },
        ),
        (
            &[span(9, 32); 11],
            TrajectoryError::TooManyCoefficients {
                interval: 10,
                needed: 11 * 33 * 9,
            },
        ),
    ];
    for (spans, wanted) in cases {
        let mut outline = outline.clone();
        outline.spans = spans.iter().copied().collect();
        let error = session.order(&Request::UploadBegin(outline)).unwrap_err();
        let Refusal::Trajectory(error) = refusal(error) else {
            panic!("{wanted}");
        };
        assert_eq!(error, wanted);
        seen.insert(name(&error));
    }
    for points in [0, 33, 255] {
        let mut outline = outline.clone();
        outline.spans = [span(9, points)].into_iter().collect();
        let error = session.order(&Request::UploadBegin(outline)).unwrap_err();
        assert!(matches!(
            refusal(error),
            Refusal::Trajectory(TrajectoryError::Points { interval: 0, .. })
        ));
    }
    // Those that cannot be said in an outline, and those of encoded trajectories, which do not cross the wire.
    let unsayable = [
        "Axes",
        "Coefficients",
        "NotFinite",
        "OtherAxes",
        "TooManyIntervals",
    ];
    let of_bytes = [
        "BufferTooSmall",
        "Duration",
        "Magic",
        "Malformed",
        "Trailing",
        "Truncated",
        "Version",
    ];
    seen.extend(
        [unsayable.as_slice(), &of_bytes]
            .concat()
            .into_iter()
            .map(str::to_owned),
    );
    seen.insert("ContentHash".to_owned()); // below
    assert_eq!(seen, variants("TrajectoryError"));

    let mut seen = BTreeSet::from(["Trajectory".to_owned()]);
    let mut refused = |session: &mut Session<T>, request: &Request<'_>| -> AssemblyError {
        let Refusal::Upload(error) = refusal(session.order(request).unwrap_err()) else {
            panic!("{request:?}");
        };
        seen.insert(name(&error));
        error
    };
    let tag = outline.tag();
    let content_hash = outline.content_hash;
    let commit = Request::UploadCommit { content_hash };
    let bytes = [0; 512];
    let block = |tag, block, values| Request::UploadBlock(Block { tag, block, values });
    session.order(&Request::UploadAbort).unwrap();
    let error = refused(session, &block(tag, 0, &bytes));
    assert_eq!(error, AssemblyError::NothingBegun);
    session
        .order(&Request::UploadBegin(outline.clone()))
        .unwrap();
    // Start while loading.
    let wrong = refusal(session.order(&Request::Start(start_request())).unwrap_err());
    let (command, state) = (Command::Start, State::Loading);
    assert_eq!(wrong, Refusal::WrongState { command, state });
    let error = refused(session, &block(tag ^ 1, 0, &bytes));
    assert!(matches!(error, AssemblyError::OtherTag { .. }));
    let error = refused(session, &block(tag, 2, &bytes));
    assert_eq!(
        error,
        AssemblyError::NoSuchBlock {
            block: 2,
            blocks: 2
        }
    );
    let error = refused(session, &block(tag, 0, &bytes[..508]));
    assert!(matches!(
        error,
        AssemblyError::BlockLength { found: 508, .. }
    ));
    session.order(&block(tag, 0, &bytes)).unwrap();
    let error = refused(session, &commit);
    assert!(matches!(error, AssemblyError::Missing(arrived) if arrived.missing() == 1));
    // All is there, and it is not what was announced.
    let rest = 4 * (sound.coefficients().len() - 128);
    session.order(&block(tag, 1, &bytes[..rest])).unwrap();
    let error = refused(session, &commit);
    assert!(matches!(
        error,
        AssemblyError::Trajectory(TrajectoryError::ContentHash { stored, .. })
            if stored == content_hash
    ));
    assert_eq!(seen, variants("AssemblyError"));
    session.order(&Request::UploadAbort).unwrap();
}

/// Starts that mean something else, too early, or without what they need.
fn starts<T: Transport>(session: &mut Session<T>) {
    let (limits, trajectory) = paper();
    let content_hash = trajectory.header().content_hash;
    let mut start =
        |request: StartRequest| refusal(session.order(&Request::Start(request)).unwrap_err());
    let sound = start_request();
    let (command, state) = (Command::Start, State::Ready);
    assert_eq!(start(sound), Refusal::WrongState { command, state });
    session.order(&Request::Arm).unwrap();
    let mut start =
        |request: StartRequest| refusal(session.order(&Request::Start(request)).unwrap_err());
    let other = StartRequest {
        trajectory_hash: content_hash ^ 1,
        ..sound
    };
    let wanted = Refusal::OtherTrajectory {
        quoted: content_hash ^ 1,
        loaded: content_hash,
    };
    assert_eq!(start(other), wanted);
    let other = StartRequest {
        limits_hash: 0,
        ..sound
    };
    let wanted = Refusal::OtherLimits {
        quoted: 0,
        machine: limits.hash(),
    };
    assert_eq!(start(other), wanted);
    let other = StartRequest {
        comms: CommsPolicy::QuickStop,
        ..sound
    };
    assert_eq!(start(other), Refusal::NoCommsTimeout);
    let percent = 101;
    let error = session.order(&Request::Override { percent }).unwrap_err();
    assert_eq!(refusal(error), Refusal::Override { percent });
    session.order(&Request::Disarm).unwrap();
}

/// Moves until the store takes no more, which leaves those there are.
fn full_store<T: Transport>(session: &mut Session<T>) -> StoreError {
    let mut stored = Vec::new();
    let refused = (0..100).find_map(|id| {
        let limits = &paper().0;
        let mut builder = TrajectoryBuilder::new(id, limits);
        let mut row = first_rad(&paper().1).map(f64::from).to_vec();
        row.resize(9, 0.0);
        for _ in 0..6 {
            builder.interval(80_000, 10, &row.repeat(11)).unwrap();
        }
        let trajectory = builder.finish().unwrap();
        session.upload(&trajectory, |_| {}).unwrap();
        match session.order(&Request::Store) {
            Ok(()) => {
                stored.push(trajectory.header().content_hash);
                None
            }
            Err(DeviceError::Denied(Denial::Store(error))) => Some(error),
            Err(error) => panic!("{error}"),
        }
    });
    session.reconnect().unwrap();
    assert_eq!(session.identity().stored.as_slice(), stored);
    let load = |content_hash| Request::Load { content_hash };
    for &content_hash in &stored {
        session.order(&load(content_hash)).unwrap();
    }
    let error = session.order(&load(1)).unwrap_err();
    assert!(matches!(
        error,
        DeviceError::Denied(Denial::Store(StoreError::NotStored { content_hash: 1 }))
    ));
    refused.expect("the store is full some time")
}

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
    let deadline = line.now() + super::bench::PATIENCE;
    while line.now() < deadline {
        let timeout = std::time::Duration::from_millis(50);
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
fn versions<T: Transport>(session: &mut Session<T>) {
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

fn simulated() -> Session<Simulated<AXES>> {
    let (limits, trajectory) = paper();
    let board = Simulated::new(Some(limits.clone()), first_rad(trajectory)).unwrap();
    Session::open(board, Settings::default()).unwrap()
}

fn all<T: Transport>(session: &mut Session<T>) -> StoreError {
    rejections(session);
    uploads(session);
    starts(session);
    let error = full_store(session);
    versions(session);
    error
}

#[test]
fn the_simulated_board_refuses_with_the_reason() {
    let most = stillpoint_shared::protocol::MAX_STORED as u8;
    assert_eq!(all(&mut simulated()), StoreError::TooMany { most });
}

#[test]
fn the_emulated_board_refuses_with_the_reason() {
    let error = all(&mut Bench::configured().session);
    assert!(matches!(error, StoreError::NoRoom { needed, available } if needed > available));
}

#[test]
fn a_board_without_limits_refuses_moves() {
    let mut bench = Bench::new();
    let error = bench.session.upload(&paper().1, |_| {}).unwrap_err();
    assert_eq!(refusal(error), Refusal::NotConfigured);
    let axes = [AxisLimits {
        torque_nm: -1.0,
        ..paper().0.axes()[0]
    }; 3];
    let limits = Request::SetLimits(axes.into_iter().collect());
    let error = bench.session.order(&limits).unwrap_err();
    assert!(
        matches!(error, DeviceError::Denied(Denial::Limits(_))),
        "{error}"
    );
}

/// The axes were turned after the upload.
#[test]
fn an_axis_that_stands_elsewhere_is_not_switched_on() {
    let mut bench = Bench::loaded();
    let mut turned = first_rad(&paper().1);
    turned[2] += 0.02;
    bench.session.transport_mut().turn_to(&turned).unwrap();
    bench.until_measured(&turned);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    let wanted = Refusal::NotAtStart {
        axis: 2,
        measured_rad: turned[2],
        first_rad: first_rad(&paper().1)[2],
        tolerance_rad: 1e-3,
    };
    assert_eq!(refusal(error), wanted);
}

#[test]
fn drives_that_are_ill_or_unheard_are_not_switched_on() {
    let mut bench = Bench::loaded();
    bench.act(Action::CutBus);
    bench.wait_ticks(4);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    assert_eq!(refusal(error), Refusal::NoFeedback);
    bench.act(Action::Repair);
    bench.act(Action::Silence { axis: 1 });
    bench.wait_ticks(10);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    assert!(matches!(
        refusal(error),
        Refusal::Feedback(FaultCause::FeedbackStale { axis: 1, .. })
    ));
}
