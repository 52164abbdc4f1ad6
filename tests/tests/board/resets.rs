//! What outlives a reset of the emulated board: the store, the limits and the fault record.

use stillpoint_firmware::bench::{Action, Record};
use stillpoint_firmware::{FaultCause, State};
use stillpoint_shared::protocol::Request;

use super::bench::{Bench, PATIENCE, first_rad, paper, start_request};

/// Resets the board and greets it again.
fn reset(bench: &mut Bench) {
    bench.act(Action::Reset);
    loop {
        let records = bench.session.transport().records();
        match records.recv_timeout(PATIENCE) {
            Ok(Record::Up) => break,
            Ok(_) => {}
            Err(error) => panic!("the board does not start again: {error}"),
        }
    }
    bench.seen.clear();
    bench.session.reconnect().unwrap();
}

#[test]
fn a_fault_record_outlives_a_reset() {
    let mut bench = Bench::under_way();
    bench.act(Action::Fault { axis: 1 });
    bench.until_state(State::Fault);
    let before = bench.session.fault_report().unwrap().unwrap();
    reset(&mut bench);
    let status = bench.status();
    assert_eq!((status.state, status.fault), (State::Idle, None));
    assert_eq!(bench.session.fault_report().unwrap(), Some(before));
}

/// The record says so itself, since nobody could write it down.
#[test]
fn a_reset_during_a_move_leaves_the_drives_off_and_is_recorded() {
    let mut bench = Bench::under_way();
    reset(&mut bench);
    assert_eq!(bench.status().state, State::Idle);
    bench.wait_ticks(100);
    bench.drain();
    assert!(bench.seen.iter().all(|record| record.sent.is_none()));
    let report = bench.session.fault_report().unwrap().unwrap();
    assert_eq!(report.head.fault.cause, FaultCause::Restart);
    assert_eq!(report.head.trajectory_hash, paper().1.header().content_hash);
    assert!(report.samples.len() > 10);
}

#[test]
fn limits_and_stored_moves_outlive_a_reset() {
    let mut bench = Bench::loaded();
    bench.session.order(&Request::Store).unwrap();
    reset(&mut bench);
    let content_hash = paper().1.header().content_hash;
    let identity = bench.session.identity();
    assert_eq!(identity.limits_hash, paper().0.hash());
    assert_eq!(identity.stored, [content_hash]);
    assert_eq!(identity.loaded, None);
    let first = first_rad(&paper().1);
    bench.session.transport_mut().turn_to(&first).unwrap();
    bench.until_measured(&first);
    bench
        .session
        .order(&Request::Load { content_hash })
        .unwrap();
    bench.session.order(&Request::Arm).unwrap();
    bench.start(&start_request());
    bench.until_state(State::Done);
}
