//! Every request, and what it leaves behind.

use heapless::Vec as Few;
use stillpoint_firmware::bench::{Action, BenchDrives, DRIVE_FAULT};
use stillpoint_firmware::{
    Command, Config, ConfigError, DriveStatus, FaultCause, Refusal, State, TickInputs,
};
use stillpoint_shared::assembly::{AssemblyError, Outline};
use stillpoint_shared::drive_config::{
    AxisDrive, BusConfig, DriveConfig, DriveConfigError, Mapping,
};
use stillpoint_shared::protocol::{
    Block, Denial, Request, Response, Status, StoreError, TelemetryConfig,
};
use stillpoint_shared::status::CommsPolicy;
use stillpoint_shared::{
    AxisLimits, LimitName, Limits, LimitsError, Trajectory, TrajectoryBuilder, TrajectoryError,
};

use crate::common::{FINE, axis_limits, block_bytes, changed, limits, start, trajectory};
use crate::rig::{Rig, framed};

fn hash() -> u64 {
    trajectory().header().content_hash
}

fn denied(refusal: impl Into<Denial>) -> Response {
    Response::Denied(refusal.into())
}

fn drive(node: u8) -> AxisDrive {
    AxisDrive {
        bus: 0,
        node,
        counts_per_turn: 1e6,
        reversed: true,
        home_counts: -3,
        home_rad: 0.5,
        gear_ratio: 33.0,
        rated_torque_nm: 1.27,
        torque_limit_permille: 3_000,
        mapping: Mapping::Write,
        tells_following: true,
    }
}

fn set_drives(axes: &[AxisDrive]) -> Request<'static> {
    Request::SetDrives {
        bus: BusConfig::default(),
        axes: axes.iter().copied().collect(),
    }
}

/// Every request once, whatever it means here.
pub(crate) fn all(rig: &Rig) -> Vec<Request<'static>> {
    vec![
        Request::Status,
        Request::KeepAlive,
        Request::UploadBegin(Outline::of(&trajectory())),
        Request::UploadBlock(Block {
            tag: 1,
            block: 0,
            values: &[0; 512],
        }),
        Request::UploadProgress,
        Request::UploadCommit { content_hash: 1 },
        Request::UploadAbort,
        Request::Arm,
        Request::Disarm,
        Request::Start(rig.start_request(CommsPolicy::Hold)),
        Request::Hold,
        Request::Resume,
        Request::Override { percent: 100 },
        Request::QuickStop,
        Request::Clear,
        Request::Store,
        Request::List,
        Request::Load { content_hash: 1 },
        Request::Erase { content_hash: None },
        Request::SetTelemetry(TelemetryConfig::OFF),
        Request::GetLimits,
        Request::SetLimits(limits().axes().iter().copied().collect()),
        Request::GetConfig,
        Request::SetConfig(Config::default()),
        Request::GetDrives,
        set_drives(&[drive(1), drive(2)]),
        Request::GetFault,
        Request::GetFaultSamples { first: 0 },
    ]
}

/// `exchange` of the rig checks that it is exactly one.
#[test]
fn every_request_has_one_response_in_every_state() {
    let count = all(&Rig::new()).len();
    for state in State::ALL {
        for index in 0..count {
            let mut rig = Rig::new();
            bring_to(&mut rig, state);
            let request = all(&rig).remove(index);
            let response = rig.ask(&request);
            assert!(!matches!(
                response,
                Response::Denied(Denial::NotUnderstood { .. })
            ));
        }
    }
}

pub(crate) fn bring_to(rig: &mut Rig, state: State) {
    match state {
        State::Idle => return,
        State::Loading => {
            rig.ask(&Request::UploadBegin(Outline::of(&trajectory())));
        }
        State::Fault => rig.done(&Request::QuickStop),
        _ => {
            assert_eq!(rig.upload(&trajectory()), Response::Done);
            match state {
                State::Ready => {}
                State::Armed => rig.done(&Request::Arm),
                _ => {
                    rig.run(CommsPolicy::Continue);
                    rig.tick(50);
                }
            }
        }
    }
    match state {
        State::Holding | State::Held => rig.done(&Request::Hold),
        State::Stopping => rig.done(&Request::QuickStop),
        _ => {}
    }
    rig.until(state);
}

#[test]
fn a_move_from_greeting_to_rest() {
    let mut rig = Rig::new();
    assert_eq!(rig.upload(&trajectory()), Response::Done);
    let identity = rig.hello(3);
    assert_eq!(identity.loaded, Some(hash()));
    assert_eq!(identity.limits_hash, limits().hash());
    rig.run(CommsPolicy::Continue);
    rig.tick(40);
    rig.done(&Request::Hold);
    rig.until(State::Held);
    let Response::Status(status) = rig.ask(&Request::Status) else {
        panic!("no status");
    };
    assert_eq!(status.state, State::Held);
    assert_eq!(status.loaded, Some(hash()));
    assert!(status.path_ticks > 0 && status.path_ticks < status.duration_ticks);
    assert_eq!(status.axes.len(), 2);
    rig.done(&Request::Override { percent: 30 });
    rig.done(&Request::Resume);
    rig.until(State::Done);
    rig.done(&Request::Disarm);
    assert_eq!(rig.state(), State::Ready);
    let refused = rig.ask(&Request::Override { percent: 101 });
    assert_eq!(refused, denied(Refusal::Override { percent: 101 }));
}

#[test]
fn a_start_has_to_mean_what_is_loaded() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    rig.tick(10);
    let good = rig.start_request(CommsPolicy::Hold);
    let mut other = good;
    other.trajectory_hash ^= 1;
    assert_eq!(
        rig.ask(&Request::Start(other)),
        denied(Refusal::OtherTrajectory {
            quoted: hash() ^ 1,
            loaded: hash()
        })
    );
    let mut other = good;
    other.limits_hash ^= 1;
    assert!(matches!(
        rig.ask(&Request::Start(other)),
        Response::Denied(Denial::Executor(Refusal::OtherLimits { .. }))
    ));
    rig.done(&Request::Start(good));
}

#[test]
fn an_upload_is_refused_with_the_reason() {
    let mut rig = Rig::new();
    let block = Request::UploadBlock(Block {
        tag: 1,
        block: 0,
        values: &[0; 512],
    });
    let nothing = denied(Refusal::Upload(AssemblyError::NothingBegun));
    assert_eq!(rig.ask(&block), nothing);
    let commit = Request::UploadCommit {
        content_hash: hash(),
    };
    assert!(matches!(
        rig.ask(&commit),
        Response::Denied(Denial::Executor(Refusal::WrongState {
            command: Command::CommitLoad,
            state: State::Idle
        }))
    ));

    let mut outline = Outline::of(&trajectory());
    outline.limits_hash ^= 1;
    let refused = rig.ask(&Request::UploadBegin(outline.clone()));
    assert!(matches!(
        refused,
        Response::Denied(Denial::Executor(Refusal::Rejected(_)))
    ));
    let mut outline = Outline::of(&trajectory());
    outline.spans[1].points = 1;
    assert_eq!(
        rig.ask(&Request::UploadBegin(outline)),
        denied(Refusal::Trajectory(TrajectoryError::Points {
            interval: 1,
            points: 1
        }))
    );
    assert_eq!(rig.state(), State::Idle);

    rig.ask(&Request::UploadBegin(Outline::of(&trajectory())));
    assert!(matches!(
        rig.ask(&commit),
        Response::Denied(Denial::Executor(Refusal::Upload(AssemblyError::Missing(
            arrived
        )))) if arrived.bits == 0
    ));
    // A whole one that this machine may not run, and the one before stays loaded.
    assert_eq!(rig.upload(&trajectory()), Response::Done);
    let jumping = changed(&limits(), |(interval, ..), value| {
        value + if interval == 1 { 0.5 } else { 0.0 }
    });
    assert!(matches!(
        rig.upload(&jumping),
        Response::Denied(Denial::Executor(Refusal::Rejected(_)))
    ));
    rig.done(&Request::UploadAbort);
    assert_eq!(rig.state(), State::Ready);
    assert_eq!(rig.machine.executor.trajectory(), &trajectory());
}

/// Nothing of one upload is taken for a part of another one, whatever the second buffer has been
/// used for in between.
#[test]
fn an_upload_begins_anew_after_the_buffer_was_used() {
    let mut rig = Rig::new();
    let other = changed(&limits(), |(interval, node, quantity, _), value| {
        value + f64::from((interval, node, quantity) == (1, 3, 2))
    });
    // The buffers have changed places.
    assert_eq!(rig.upload(&trajectory()), Response::Done);
    assert_eq!(rig.upload(&other), Response::Done);
    assert_eq!(begun(&mut rig, &other), 0);
    rig.done(&Request::UploadAbort);

    // A stored one came in, and was refused for where it starts.
    rig.done(&Request::Store);
    assert_eq!(rig.upload(&trajectory()), Response::Done);
    rig.done(&Request::Arm);
    rig.tick(10);
    let tag = Outline::of(&trajectory()).tag();
    assert_eq!(begun(&mut rig, &trajectory()), 0);
    let values = block_bytes(&trajectory(), 0);
    rig.ask(&Request::UploadBlock(Block {
        tag,
        block: 0,
        values: &values,
    }));
    assert_eq!(begun(&mut rig, &trajectory()), 1);
    let elsewhere = changed(&limits(), |(_, _, quantity, _), value| {
        value + f64::from(quantity == 0)
    });
    rig.store.put(&elsewhere).unwrap();
    let load = Request::Load {
        content_hash: elsewhere.header().content_hash,
    };
    assert!(matches!(
        rig.ask(&load),
        Response::Denied(Denial::Executor(Refusal::Rejected(_)))
    ));
    assert_eq!(begun(&mut rig, &trajectory()), 0);
}

/// Begins an upload; the blocks that have arrived.
fn begun(rig: &mut Rig, trajectory: &Trajectory) -> u32 {
    match rig.ask(&Request::UploadBegin(Outline::of(trajectory))) {
        Response::Upload(arrived) => arrived.bits,
        other => panic!("{other:?}"),
    }
}

/// A move that stays where it is.
fn still(id: u32, position_rad: [f64; 2]) -> Trajectory {
    let mut builder = TrajectoryBuilder::new(id, &limits());
    let [first, second] = position_rad;
    let rows: Vec<f64> = (0..9)
        .flat_map(|_| [first, second, 0.0, 0.0, 0.0, 0.0])
        .collect();
    for _ in 0..5 {
        builder.interval(10_000, 8, &rows).unwrap();
    }
    builder.finish().unwrap()
}

#[test]
fn a_stored_move_is_there_after_a_restart() {
    let mut rig = Rig::new();
    let load = Request::Load {
        content_hash: hash(),
    };
    let content_hash = hash();
    let not_stored = denied(StoreError::NotStored { content_hash });
    assert_eq!(rig.ask(&load), not_stored);
    rig.upload(&trajectory());
    rig.done(&Request::Store);
    let mut rig = rig.restarted();
    assert_eq!(rig.state(), State::Idle);
    assert_eq!(rig.hello(4).stored, [hash()]);
    let Response::Stored(stored) = rig.ask(&Request::List) else {
        panic!("no list");
    };
    assert_eq!(stored.len(), 1);
    assert_eq!(stored[0].id, 42);
    assert_eq!(stored[0].duration_ticks, trajectory().duration_ticks());
    rig.done(&load);
    assert_eq!(rig.state(), State::Ready);
    assert_eq!(rig.machine.executor.trajectory(), &trajectory());

    // Not while the drives are on.
    rig.done(&Request::Arm);
    let erase = Request::Erase {
        content_hash: Some(hash()),
    };
    for request in [&erase, &Request::Store] {
        assert!(matches!(
            rig.ask(request),
            Response::Denied(Denial::Executor(Refusal::WrongState {
                state: State::Armed,
                ..
            }))
        ));
    }
    rig.tick(10);
    rig.done(&Request::Disarm);
    rig.done(&erase);
    assert_eq!(rig.ask(&erase), not_stored);
    assert_eq!(rig.ask(&Request::List), Response::Stored(Few::new()));
}

#[test]
fn a_full_store_is_named() {
    let mut rig = Rig::new();
    let mut refused = None;
    // Names 0, 1, 2 …: the test's flash holds a few of them.
    for id in 0..10 {
        assert_eq!(rig.upload(&still(id, [0.25, -1.0])), Response::Done);
        let response = rig.ask(&Request::Store);
        if response != Response::Done {
            refused = Some(response);
            break;
        }
    }
    assert!(matches!(
        refused,
        Some(Response::Denied(Denial::Store(StoreError::NoRoom { .. })))
    ));
    rig.done(&Request::Erase { content_hash: None });
    rig.done(&Request::Store);
}

#[test]
fn limits_are_changed_and_kept() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(limits()));
    let other = AxisLimits {
        torque_nm: 70.0,
        ..axis_limits()
    };
    let set = |axes: &[AxisLimits]| Request::SetLimits(axes.iter().copied().collect());
    let impossible = AxisLimits {
        speed_rad_per_s: -1.0,
        ..other
    };
    assert_eq!(
        rig.ask(&set(&[other, impossible])),
        Response::Denied(Denial::Limits(LimitsError::Value {
            axis: 1,
            name: LimitName::Speed,
            value: -1.0
        }))
    );
    assert_eq!(
        rig.ask(&set(&[other; 3])),
        denied(Refusal::Configuration(ConfigError::Axes {
            limits: 3,
            executor: 2
        }))
    );
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    assert!(matches!(
        rig.ask(&set(&[other; 2])),
        Response::Denied(Denial::Executor(Refusal::WrongState { .. }))
    ));
    rig.tick(5);
    rig.done(&Request::Disarm);
    assert_eq!(rig.store.limits(), None, "a refused one is not kept");
    rig.done(&set(&[other; 2]));
    let new = Limits::new(&[other; 2]).unwrap();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(new.clone()));
    assert_eq!(rig.state(), State::Idle, "what was loaded is forgotten");

    let mut rig = rig.restarted();
    rig.link.restore(&mut *rig.machine, &rig.store).unwrap();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(new));
}

#[test]
fn a_board_without_limits_takes_them() {
    let mut rig = Rig::silent();
    *rig.machine = stillpoint_firmware::Machine::unconfigured();
    assert_eq!(
        rig.link.restore(&mut *rig.machine, &rig.store),
        Err(Refusal::NotConfigured)
    );
    rig.tick(1);
    rig.hello(1);
    for request in [
        Request::GetLimits,
        Request::GetConfig,
        Request::SetConfig(Config::default()),
        Request::UploadBegin(Outline::of(&trajectory())),
    ] {
        assert_eq!(rig.ask(&request), denied(Refusal::NotConfigured));
    }
    let axes = limits().axes().iter().copied().collect();
    rig.done(&Request::SetLimits(axes));
    assert_eq!(
        rig.ask(&Request::GetConfig),
        Response::Config(Config::default())
    );
    assert_eq!(rig.upload(&trajectory()), Response::Done);
}

#[test]
fn the_configuration_is_changed_and_kept() {
    let mut rig = Rig::new();
    let mut config = Config::default();
    config.monitor.following_at_rest_rad = 0.02;
    rig.done(&Request::SetConfig(config));
    assert_eq!(rig.ask(&Request::GetConfig), Response::Config(config));
    let mut wrong = config;
    wrong.ramp_s = 0.0;
    assert!(matches!(
        rig.ask(&Request::SetConfig(wrong)),
        Response::Denied(Denial::Executor(Refusal::Configuration(
            ConfigError::Value { .. }
        )))
    ));
    let mut wrong = config;
    wrong.period_ticks = 10_000;
    assert_eq!(
        rig.ask(&Request::SetConfig(wrong)),
        denied(Refusal::Configuration(ConfigError::Period {
            given_ticks: 10_000,
            board_ticks: 2_500
        }))
    );
    let axes = limits().axes().iter().copied().collect();
    rig.done(&Request::SetLimits(axes));
    let mut rig = rig.restarted();
    rig.link.restore(&mut *rig.machine, &rig.store).unwrap();
    assert_eq!(rig.ask(&Request::GetConfig), Response::Config(config));
}

#[test]
fn drives_are_configured_and_kept() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask(&Request::GetDrives), Response::Drives(None));
    rig.done(&set_drives(&[drive(1), drive(2)]));
    let kept = DriveConfig::new(BusConfig::default(), &[drive(1), drive(2)]).unwrap();
    let kept = Response::Drives(Some(kept));
    let mut rig = rig.restarted();
    assert_eq!(rig.ask(&Request::GetDrives), kept);

    let one = rig.ask(&set_drives(&[drive(1)]));
    assert_eq!(
        one,
        Response::Denied(Denial::DriveAxes { given: 1, board: 2 })
    );
    let same = rig.ask(&set_drives(&[drive(1), drive(1)]));
    assert_eq!(
        same,
        Response::Denied(Denial::Drives(DriveConfigError::NodeTwice {
            axis: 0,
            bus: 0,
            node: 1
        }))
    );
    // Possible as such, but no multiple of the board's tick of 250 µs.
    let bus = BusConfig {
        period_us: 2_100,
        ..BusConfig::default()
    };
    let axes = [drive(1), drive(2)].into_iter().collect();
    assert!(matches!(
        rig.ask(&Request::SetDrives { bus, axes }),
        Response::Denied(Denial::Drives(DriveConfigError::NotTicks { .. }))
    ));
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    assert!(matches!(
        rig.ask(&set_drives(&[drive(3), drive(4)])),
        Response::Denied(Denial::Executor(Refusal::WrongState { .. }))
    ));
    assert_eq!(rig.ask(&Request::GetDrives), kept);
}

#[test]
fn other_drives_ask_for_a_start_of_the_board_once_the_answer_is_sent() {
    let mut rig = Rig::new();
    let set = |rig: &mut Rig, nodes: [u8; 2]| {
        let response = rig.ask(&set_drives(&nodes.map(drive)));
        (response, rig.link.wants_start())
    };
    let (refused, wants) = set(&mut rig, [1, 1]);
    assert!(matches!(refused, Response::Denied(_)) && !wants);
    assert_eq!(set(&mut rig, [1, 2]), (Response::Done, true));
    let mut rig = rig.restarted();
    assert!(!rig.link.wants_start());
    assert_eq!(set(&mut rig, [1, 2]), (Response::Done, false), "the same");

    rig.sequence += 1;
    let other = set_drives(&[drive(1), drive(3)]);
    rig.receive(&framed(rig.envelope(), &other));
    while rig.poll() {}
    assert!(!rig.link.wants_start(), "the answer is still to be sent");
    assert_eq!(rig.messages().len(), 1);
    assert!(rig.link.wants_start());
    let starting = (Response::Denied(Denial::Starting), true);
    assert_eq!(set(&mut rig, [1, 3]), starting, "too late");
    assert_eq!(rig.ask(&Request::Arm), starting.0);
    assert!(matches!(rig.ask(&Request::Status), Response::Status(_)));
}

#[test]
fn a_drive_in_its_fault_is_seen_while_the_board_is_ready_and_clear_resets_it() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    let mut drives = BenchDrives::at(&start());
    drives.act(Action::Fault { axis: 1 });
    let mut status = |rig: &mut Rig| {
        rig.machine.tick(&mut drives, &FINE);
        match rig.ask(&Request::Status) {
            Response::Status(status) => status,
            other => panic!("{other:?}"),
        }
    };
    let seen = status(&mut rig);
    let drive = |status: &Status| [status.axes[0].drive, status.axes[1].drive];
    let fault = DriveStatus::Fault { code: DRIVE_FAULT };
    let off = Some(DriveStatus::Disabled);
    assert_eq!((seen.state, seen.fault), (State::Ready, None));
    assert_eq!(drive(&seen), [off, Some(fault)]);
    let code = DRIVE_FAULT;
    let refused = Refusal::Feedback(FaultCause::DriveFault { axis: 1, code });
    assert_eq!(rig.ask(&Request::Arm), denied(refused));
    assert_eq!(drive(&status(&mut rig)), [off, Some(fault)]);
    rig.done(&Request::Clear);
    assert_eq!(drive(&status(&mut rig)), [off; 2]);
    rig.done(&Request::Arm);
}

#[test]
fn an_axis_is_shown_where_it_stands_only_if_its_drive_is_heard() {
    let mut rig = Rig::new();
    let mut drives = BenchDrives::at(&start());
    drives.act(Action::Silence { axis: 0 });
    let mut positions = |rig: &mut Rig| {
        rig.machine.tick(&mut drives, &FINE);
        match rig.ask(&Request::Status) {
            Response::Status(status) => [0, 1].map(|axis| status.axes[axis].measured_rad),
            other => panic!("{other:?}"),
        }
    };
    let [first, second] = [0, 1].map(|axis| Some(start()[axis]));
    // Two messages may be lost.
    for heard in [first, first, None] {
        assert_eq!(positions(&mut rig), [heard, second]);
    }
}

#[test]
fn the_fault_record_is_read_in_pieces() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask(&Request::GetFault), Response::Fault(None));
    let none = Denial::FaultSample {
        first: 0,
        samples: 0,
    };
    let ask = |first| Request::GetFaultSamples { first };
    assert_eq!(rig.ask(&ask(0)), Response::Denied(none));
    rig.upload(&trajectory());
    rig.run(CommsPolicy::Continue);
    rig.tick(120);
    let pressed = TickInputs {
        emergency_stop: true,
        ..FINE
    };
    rig.machine.tick(&mut rig.drives, &pressed);
    let Response::Fault(Some(head)) = rig.ask(&Request::GetFault) else {
        panic!("no fault");
    };
    assert_eq!(head.fault.cause, FaultCause::EmergencyStop);
    assert_eq!(head.trajectory_hash, hash());
    assert!(head.samples > 10, "{head:?}");
    let mut samples = Vec::new();
    while samples.len() < usize::from(head.samples) {
        match rig.ask(&ask(samples.len() as u16)) {
            Response::FaultSamples(piece) => samples.extend(piece),
            other => panic!("{other:?}"),
        }
    }
    let record = rig.machine.executor.fault_record().unwrap();
    assert!(
        record
            .samples()
            .map(|sample| sample.tick)
            .eq(samples.iter().map(|sample| sample.tick))
    );
    assert!(samples.iter().any(|sample| sample.axes[0].torque_nm != 0.0));
    let beyond = Denial::FaultSample {
        first: head.samples,
        samples: head.samples,
    };
    assert_eq!(rig.ask(&ask(head.samples)), Response::Denied(beyond));
}
