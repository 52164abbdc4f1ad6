//! Uploads to the emulated board over a bad line: complete and identical, or refused.

use std::time::Duration;

use stillpoint::device::Qemu;
use stillpoint::device::{DeviceError, Faults, Faulty, Session, Settings};
use stillpoint_shared::protocol::Request;

use super::bench::{Bench, paper, still};

/// Content hash of what is loaded, over a good line.
fn loaded(session: &mut Session<Faulty<Qemu>>) -> Option<u64> {
    session.transport_mut().set_faults(Faults::NONE);
    session.reconnect().unwrap();
    session.status().unwrap().loaded
}

/// The thousand uploads of the simulated board are in the host's tests; here are a few on the image itself.
#[test]
fn uploads_over_a_bad_line_are_whole_or_given_up() {
    let settings = Settings {
        // A byte takes the emulator a turn of two threads: milliseconds on a busy computer.
        response_timeout: Duration::from_millis(300),
        attempts: 20,
        ..Settings::default()
    };
    let board = Bench::board();
    let mut session = Session::open(Faulty::new(board, Faults::NONE), settings).unwrap();
    let axes = paper().0.axes().iter().copied().collect();
    session.order(&Request::SetLimits(axes)).unwrap();
    let mut before = None;
    let mut complete = 0;
    for id in 0..10 {
        let trajectory = still(id);
        let hash = Some(trajectory.header().content_hash);
        session.transport_mut().set_faults(Faults::each(0.05, 0));
        let result = session.upload(&trajectory, |_| {});
        let now = loaded(&mut session);
        match result {
            Ok(_) => {
                assert_eq!(now, hash, "upload {id}");
                complete += 1;
            }
            Err(
                error @ (DeviceError::Unanswered { .. }
                | DeviceError::Silent { .. }
                | DeviceError::SessionLost { .. }),
            ) => assert!(now == before || now == hash, "upload {id}: {error}"),
            Err(error) => panic!("upload {id}: {error}"),
        }
        before = now;
    }
    let injected = session.transport().injected();
    assert!(complete >= 7, "{complete} complete; {injected}");
    let status = session.status().unwrap();
    assert!(
        status.link.damaged > 0 && status.link.repeated > 0,
        "{injected}"
    );
}
