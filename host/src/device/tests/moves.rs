//! Moves over the wire.

use super::{A_MOMENT, loaded, quintic, session};
use crate::device::DeviceError;
use std::time::Duration;
use stillpoint_firmware::{FaultCause, State};
use stillpoint_shared::Player;
use stillpoint_shared::protocol::{
    Channels, Denial, Request, Response, StoreError, TelemetryConfig,
};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

#[test]
fn a_move_is_played_and_seen() {
    let mut session = session(1);
    let trajectory = quintic(1, 0.3);
    session.upload(&trajectory, |_| {}).unwrap();
    assert_eq!(loaded(&session), &trajectory);
    session.order(&Request::Arm).unwrap();
    session.wait(A_MOMENT).unwrap();
    let telemetry = TelemetryConfig {
        every_ticks: 8,
        channels: Channels::SETPOINT_POSITION | Channels::MEASURED_POSITION,
    };
    session.order(&Request::SetTelemetry(telemetry)).unwrap();
    let request = StartRequest {
        trajectory_hash: trajectory.header().content_hash,
        limits_hash: trajectory.header().limits_hash,
        comms: CommsPolicy::Continue,
        comms_timeout_ticks: 0,
        dry_run: false,
    };
    session.order(&Request::Start(request)).unwrap();
    let player = Player::<2>::new(&trajectory).unwrap();
    let mut running = 0;
    loop {
        let sample = session
            .telemetry(Duration::from_secs(1))
            .unwrap()
            .unwrap()
            .telemetry;
        let wanted = player.sample(sample.path_ticks).unwrap().position_rad;
        if sample.state == State::Running {
            assert_eq!(sample.channel(Channels::SETPOINT_POSITION), wanted);
            assert_eq!(sample.channel(Channels::MEASURED_POSITION), wanted);
            running += 1;
        }
        if sample.state == State::Done {
            break;
        }
    }
    // 80 ms at 4 kHz, every eighth.
    assert!((35..=41).contains(&running), "{running}");
}

#[test]
fn a_stored_move_and_the_limits_are_there_after_a_restart() {
    let mut session = session(1);
    let trajectory = quintic(5, 0.3);
    let content_hash = trajectory.header().content_hash;
    let load = Request::Load { content_hash };
    let error = session.order(&load).unwrap_err();
    let DeviceError::Denied(Denial::Store(StoreError::NotStored { .. })) = error else {
        panic!("{error:?}");
    };
    session.upload(&trajectory, |_| {}).unwrap();
    session.order(&Request::Store).unwrap();
    session.transport_mut().inner_mut().restart().unwrap();
    let identity = session.reconnect().unwrap();
    assert_eq!(
        (identity.loaded, &identity.stored[..]),
        (None, &[content_hash][..])
    );
    session.wait(A_MOMENT).unwrap();
    session.order(&load).unwrap();
    assert_eq!(loaded(&session), &trajectory);
    let limits = session.ask(&Request::GetLimits).unwrap();
    assert_eq!(limits, Response::Limits(super::limits()));
}

#[test]
fn the_fault_record_is_read_whole() {
    let mut session = session(1);
    assert_eq!(session.fault_report().unwrap(), None);
    let trajectory = quintic(5, 0.3);
    session.upload(&trajectory, |_| {}).unwrap();
    session.order(&Request::Arm).unwrap();
    session.wait(Duration::from_millis(300)).unwrap();
    session.transport_mut().inner_mut().inputs.emergency_stop = true;
    session.wait(A_MOMENT).unwrap();
    let report = session.fault_report().unwrap().unwrap();
    assert_eq!(report.head.fault.cause, FaultCause::EmergencyStop);
    assert_eq!(
        report.head.trajectory_hash,
        trajectory.header().content_hash
    );
    assert_eq!(report.samples.len(), usize::from(report.head.samples));
    assert!(report.samples.len() > 64);
    assert!(report.samples.is_sorted_by_key(|sample| sample.tick));
}
