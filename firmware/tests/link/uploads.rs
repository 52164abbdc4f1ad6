//! How a trajectory comes to the board, and stays there.

use crate::common::{block_bytes, changed, limits, trajectory};
use crate::requests::{denied, hash};
use crate::rig::Rig;
use heapless::Vec as Few;
use stillpoint_firmware::{Command, Refusal, State};
use stillpoint_shared::assembly::{AssemblyError, Outline};
use stillpoint_shared::protocol::{Block, Denial, Request, Response, StoreError};
use stillpoint_shared::{Trajectory, TrajectoryBuilder, TrajectoryError};

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
