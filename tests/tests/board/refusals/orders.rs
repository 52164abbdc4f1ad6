//! Orders that come too early, mean something else, or find no room.

use stillpoint::device::{DeviceError, Session, Transport};
use stillpoint_firmware::{Command, Refusal, State};
use stillpoint_shared::protocol::{Denial, Request, StoreError};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

use super::super::bench::{paper, start_request, still};
use super::refusal;

/// Starts that mean something else, too early, or without what they need.
pub(super) fn starts<T: Transport>(session: &mut Session<T>) {
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
pub(super) fn full_store<T: Transport>(session: &mut Session<T>) -> StoreError {
    let mut stored = Vec::new();
    let refused = (0..100).find_map(|id| {
        let trajectory = still(id);
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
