//! Every request, and what it leaves behind.

use crate::common::{FINE, limits, start, trajectory};
use crate::rig::Rig;
use stillpoint_firmware::bench::{Action, BenchDrives, DRIVE_FAULT};
use stillpoint_firmware::{Config, DriveStatus, FaultCause, Refusal, State, TickInputs};
use stillpoint_shared::assembly::Outline;
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, Mapping};
use stillpoint_shared::protocol::{Block, Denial, Request, Response, Status, TelemetryConfig};
use stillpoint_shared::status::CommsPolicy;

pub(crate) fn hash() -> u64 {
    trajectory().header().content_hash
}

pub(crate) fn denied(refusal: impl Into<Denial>) -> Response {
    Response::Denied(refusal.into())
}

pub(crate) fn drive(node: u8) -> AxisDrive {
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

pub(crate) fn set_drives(axes: &[AxisDrive]) -> Request<'static> {
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
