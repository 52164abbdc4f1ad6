//! The test: uploads over a line with faults of every kind.

use super::{board, loaded, quintic, session, settings};
use crate::device::{DeviceError, Faults, Faulty, Progress, Session, Transport};
use std::time::Duration;
use stillpoint_firmware::{Rejection, State};
use stillpoint_shared::protocol::{Denial, Request};
use stillpoint_shared::status::Refusal;
use stillpoint_shared::{Trajectory, assembly};

/// A trajectory that this machine may not run: it starts elsewhere.
fn elsewhere(id: u32) -> Trajectory {
    let mut builder = stillpoint_shared::TrajectoryBuilder::new(id, &super::limits());
    let rows: Vec<f64> = [2.0, 2.0, 0.0, 0.0, 0.0, 0.0].repeat(31);
    builder.interval(100_000, 30, &rows).unwrap();
    builder.interval(100_000, 30, &rows).unwrap();
    builder.finish().unwrap()
}

/// A thousand uploads with 5 % of every kind of fault in each direction: each ends complete and identical or refused,
/// and whatever is loaded then is whole. A board that hangs would never answer the status at the end.
#[test]
fn a_thousand_uploads_on_a_bad_line_are_whole_or_refused() {
    let mut session = session(1);
    let (mut complete, mut refused, mut given_up, mut reconnects, mut sent) = (0, 0, 0, 0, 0);
    let mut whole = Trajectory::empty();
    for upload in 0..1_000 {
        let bad = upload % 10 == 9;
        let trajectory = if bad {
            elsewhere(upload)
        } else {
            quintic(upload, 0.2 + 1e-4 * f64::from(upload))
        };
        session.transport_mut().set_faults(Faults::each(0.05, 0));
        let result = session.upload(&trajectory, |_| {});
        // What is loaded is the new one or the one before, to the bit, whatever was reported.
        let found = loaded(&session).clone();
        match result {
            Ok(uploaded) => {
                assert!(!bad);
                assert_eq!(found, trajectory, "upload {upload}");
                reconnects += uploaded.reconnects;
                sent += uploaded.sent;
                complete += 1;
            }
            Err(DeviceError::Denied(Denial::Executor(Refusal::Rejected(
                Rejection::StartsElsewhere { .. },
            )))) => {
                assert!(bad);
                assert_eq!(found, whole, "upload {upload}");
                refused += 1;
            }
            Err(error) => {
                let of_the_line = matches!(
                    error,
                    DeviceError::Unanswered { .. }
                        | DeviceError::Silent { .. }
                        | DeviceError::SessionLost { .. }
                );
                assert!(of_the_line, "upload {upload}: {error}");
                assert!(found == whole || found == trajectory, "upload {upload}");
                session.transport_mut().set_faults(Faults::NONE);
                session.reconnect().unwrap();
                given_up += 1;
            }
        }
        whole = loaded(&session).clone();
    }
    session.transport_mut().set_faults(Faults::NONE);
    session.reconnect().unwrap();
    let status = session.status().unwrap();
    assert!(matches!(status.state, State::Ready | State::Loading));
    let injected = session.transport().injected();
    println!(
        "{complete} complete, {refused} refused, {given_up} given up, {reconnects} sessions opened anew, \
         {sent} blocks sent, {} s; {injected}; board: {:?}, host: {:?}",
        session.transport().now().as_secs_f64(),
        status.link,
        session.reception(),
    );
    assert!(complete > 850 && refused > 90, "{complete} {refused}");
    for count in [
        injected.dropped,
        injected.duplicated,
        injected.reordered,
        injected.corrupted,
        injected.delayed,
        injected.cut,
    ] {
        assert!(count > 500, "{injected}");
    }
}

/// The board loses power in the middle, at many places: afterwards the upload starts anew and succeeds.
#[test]
fn a_board_that_restarts_in_the_middle_gets_the_whole() {
    let trajectory = quintic(1, 0.3);
    let mut interrupted = 0;
    for after in 0..12 {
        let mut session = session(after);
        let mut frames = 0;
        session.transport_mut().set_faults(Faults::each(0.0, 0));
        let board = session.transport_mut().inner_mut();
        board.restart_after_requests(after as u32);
        let uploaded = session.upload(&trajectory, |_| frames += 1).unwrap();
        assert_eq!(loaded(&session), &trajectory, "after {after} requests");
        interrupted += uploaded.reconnects;
        assert!(frames > 0);
    }
    assert!(interrupted >= 3, "{interrupted}");
}

#[test]
fn blocks_that_arrived_are_not_sent_again() {
    let mut session = session(3);
    let trajectory = quintic(1, 0.3);
    assert_eq!(assembly::block(&trajectory, 2).len(), 312 - 256);
    // Everything is lost as soon as two blocks have arrived.
    session
        .order(&Request::UploadBegin(assembly::Outline::of(&trajectory)))
        .unwrap();
    let outline = assembly::Outline::of(&trajectory);
    for block in [0, 2] {
        let values = assembly::block(&trajectory, block).iter();
        let values: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
        let tag = outline.tag();
        let block = stillpoint_shared::protocol::Block {
            tag,
            block,
            values: &values,
        };
        session.order(&Request::UploadBlock(block)).unwrap();
    }
    session.reconnect().unwrap();
    let mut seen = Vec::new();
    let uploaded = session
        .upload(&trajectory, |progress| seen.push(progress))
        .unwrap();
    assert_eq!((uploaded.blocks, uploaded.sent), (3, 1));
    let progress = |arrived| Progress { arrived, blocks: 3 };
    assert_eq!(seen.first(), Some(&progress(2)));
    assert_eq!(seen.last(), Some(&progress(3)));
    assert_eq!(loaded(&session), &trajectory);
}

/// 1 Mbit/s carries a move in the time its bytes take: the window keeps the line busy.
#[test]
fn a_good_line_is_used() {
    let mut session = session(4);
    let trajectory = quintic(1, 0.3);
    let uploaded = session.upload(&trajectory, |_| {}).unwrap();
    assert_eq!((uploaded.sent, uploaded.reconnects), (3, 0));
    // 1,248 bytes of values and little else.
    assert!(
        uploaded.time < Duration::from_millis(25),
        "{:?}",
        uploaded.time
    );
}

#[test]
fn a_line_without_a_board_is_given_up() {
    let mut faults = Faults::NONE;
    faults.drop = 1.0;
    let error = Session::open(Faulty::new(board(), faults), settings(1))
        .err()
        .unwrap();
    assert!(
        matches!(
            error,
            DeviceError::Silent {
                attempts: 5,
                damaged: 0,
                ..
            }
        ),
        "{error:?}"
    );
    let words = error.to_string();
    assert!(
        words.contains("does not answer") && words.contains("wiring"),
        "{words}"
    );

    let mut session = session(9);
    session.transport_mut().set_faults(faults);
    let trajectory = quintic(1, 0.3);
    let error = session.upload(&trajectory, |_| {}).err().unwrap();
    assert!(matches!(error, DeviceError::Silent { .. }), "{error:?}");
    assert_eq!(loaded(&session), &Trajectory::empty());
}
