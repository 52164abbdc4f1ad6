//! What a session does where the line or the board fails.

use super::{A_MOMENT, START_RAD, board, limits, loaded, quintic, session, settings};
use crate::device::{DeviceError, Faults, FaultsError, Faulty, Session, Transport, TransportError};
use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;
use stillpoint_firmware::State;
use stillpoint_shared::protocol::{Channels, Denial, Request, TelemetryConfig, Versions};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

fn start(session: &Session<super::Line>, comms: CommsPolicy) -> StartRequest {
    StartRequest {
        trajectory_hash: loaded(session).header().content_hash,
        limits_hash: limits().hash(),
        comms,
        comms_timeout_ticks: 400,
        dry_run: false,
    }
}

/// A start whose answers are all lost is obeyed once; the session does not know and says so.
#[test]
fn an_order_without_an_answer_is_obeyed_once_at_most() {
    let mut session = session(1);
    session.upload(&quintic(1, 0.3), |_| {}).unwrap();
    session.order(&Request::Arm).unwrap();
    session.wait(A_MOMENT).unwrap();
    let starts = Rc::new(Cell::new(0));
    let seen = starts.clone();
    let mut before = State::Armed;
    session.transport_mut().inner_mut().on_tick(move |report| {
        if report.state == State::Running && before != State::Running {
            seen.set(seen.get() + 1);
        }
        before = report.state;
    });
    // Nothing comes back.
    let request = start(&session, CommsPolicy::Continue);
    session.transport_mut().inner_mut().mute(true);
    let error = session.order(&Request::Start(request)).unwrap_err();
    assert!(
        matches!(error, DeviceError::Unanswered { attempts: 5, .. }),
        "{error:?}"
    );
    assert!(error.to_string().contains("not known"), "{error}");
    session.transport_mut().inner_mut().mute(false);
    assert_eq!(session.status().unwrap().state, State::Done);
    assert_eq!(starts.get(), 1);
}

/// Somebody else connects: questions go on in a new session, orders are not repeated.
#[test]
fn a_session_taken_away_is_opened_again_but_no_order_is_repeated() {
    let mut session = session(1);
    session.upload(&quintic(1, 0.3), |_| {}).unwrap();
    let steal = |session: &mut Session<super::Line>| {
        session.transport_mut().inner_mut().restart().unwrap();
    };
    steal(&mut session);
    assert_eq!(session.status().unwrap().state, State::Idle);
    session.upload(&quintic(1, 0.3), |_| {}).unwrap();
    steal(&mut session);
    let error = session.order(&Request::Arm).unwrap_err();
    let DeviceError::SessionLost { denial } = error else {
        panic!("{error:?}");
    };
    assert!(matches!(denial, Denial::Session { open: 0, .. }));
    // It is open again.
    assert_eq!(session.status().unwrap().state, State::Idle);
    session.order(&Request::QuickStop).unwrap();
    steal(&mut session);
    session.order(&Request::QuickStop).unwrap();
    assert_eq!(session.status().unwrap().state, State::Fault);
}

/// The session sends nothing by itself: a program that only watches lets the board's policy act.
#[test]
fn watching_is_no_sign_of_life() {
    let mut session = session(1);
    session.upload(&quintic(1, 0.3), |_| {}).unwrap();
    session.order(&Request::Arm).unwrap();
    session.wait(A_MOMENT).unwrap();
    session.order(&Request::Override { percent: 10 }).unwrap();
    let telemetry = TelemetryConfig {
        every_ticks: 10,
        channels: Channels::NONE,
    };
    session.order(&Request::SetTelemetry(telemetry)).unwrap();
    let request = start(&session, CommsPolicy::Hold);
    session.order(&Request::Start(request)).unwrap();
    let mut held_at = None;
    let mut first = None;
    while held_at.is_none() {
        let sample = session
            .telemetry(Duration::from_secs(1))
            .unwrap()
            .unwrap()
            .telemetry;
        let first = *first.get_or_insert(sample.tick);
        if sample.state != State::Running && sample.state != State::Armed {
            held_at = Some(sample.tick - first);
        }
    }
    let silent_ticks = held_at.unwrap();
    assert!((400..440).contains(&silent_ticks), "{silent_ticks}");
    // With signs of life it goes on.
    session.order(&Request::Resume).unwrap();
    for _ in 0..8 {
        session.wait(Duration::from_millis(50)).unwrap();
        session.order(&Request::KeepAlive).unwrap();
    }
    assert_eq!(session.status().unwrap().state, State::Running);
}

#[test]
fn telemetry_tells_what_was_lost() {
    let mut session = session(5);
    let telemetry = TelemetryConfig {
        every_ticks: 20,
        channels: Channels::ALL,
    };
    session.order(&Request::SetTelemetry(telemetry)).unwrap();
    let mut faults = Faults::each(0.0, 5);
    faults.drop = 0.3;
    session.transport_mut().set_faults(faults);
    let (mut came, mut lost) = (0u32, 0);
    let mut last = None;
    for _ in 0..500 {
        let received = session.telemetry(Duration::from_secs(1)).unwrap().unwrap();
        let tick = received.telemetry.tick;
        if let Some(last) = last {
            assert_eq!(tick - last, 20 * (1 + u64::from(received.lost)));
        }
        last = Some(tick);
        came += 1;
        lost += u32::from(received.lost);
    }
    assert!(lost > came / 4, "{came} {lost}");
}

#[test]
fn another_version_is_refused_with_the_remedy() {
    let own = Versions::OWN;
    let of = |theirs| {
        let board = "f405".to_owned();
        let firmware = "9.9.9".to_owned();
        let ours = own;
        DeviceError::Versions {
            board,
            firmware,
            theirs,
            ours,
        }
        .to_string()
    };
    let newer = Versions {
        oldest: own.newest + 1,
        newest: own.newest + 2,
        ..own
    };
    assert!(of(newer).ends_with("update this program"), "{}", of(newer));
    let older = Versions {
        oldest: 0,
        newest: own.oldest - 1,
        ..own
    };
    assert!(
        of(older).ends_with("update the board's firmware"),
        "{}",
        of(older)
    );
    let odd = Versions {
        schema_hash: own.schema_hash ^ 1,
        ..own
    };
    let words = of(odd);
    assert!(
        words.contains("same source") && words.contains("f405 9.9.9"),
        "{words}"
    );
}

#[test]
fn the_same_seed_gives_the_same_faults() {
    let run = |seed| {
        let mut session = session(seed);
        session.transport_mut().set_faults(Faults::each(0.1, 0));
        let _ = session.upload(&quintic(1, 0.3), |_| {});
        (session.transport().injected(), session.transport().now())
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

#[test]
fn faults_are_read_from_text() {
    assert_eq!("5%".parse(), Ok(Faults::each(0.05, 1)));
    let some = Faults {
        drop: 0.02,
        cut: 0.5,
        seed: 9,
        ..Faults::NONE
    };
    assert_eq!("drop=2%, cut=0.5,seed=9".parse(), Ok(some));
    for wrong in [
        "",
        "drop",
        "drop=x",
        "drop=101%",
        "burn=1%",
        "seed=-1",
        "drop=NaN",
    ] {
        let error: FaultsError = wrong.parse::<Faults>().unwrap_err();
        assert!(error.to_string().contains("such as 5%"), "{error}");
    }
}

/// A transport whose line goes away now and then.
struct Loose {
    board: crate::device::Simulated<2>,
    calls: u32,
}

impl Transport for Loose {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.calls += 1;
        if self.calls.is_multiple_of(9) {
            return Err(TransportError::Closed {
                port: "loose".into(),
            });
        }
        self.board.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        self.board.receive(buffer, timeout)
    }

    fn now(&self) -> Duration {
        self.board.now()
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        Ok(())
    }
}

#[test]
fn a_connection_that_closes_is_opened_again_by_an_upload() {
    let loose = Loose {
        board: board(),
        calls: 0,
    };
    let mut session = Session::open(loose, settings(3)).unwrap();
    let mut reconnects = 0;
    for id in 0..6 {
        let trajectory = quintic(id, 0.3);
        reconnects += session.upload(&trajectory, |_| {}).unwrap().reconnects;
        let found = session.transport().board.machine.executor.trajectory();
        assert_eq!(found, &trajectory);
    }
    assert!(reconnects >= 3, "{reconnects}");
    assert_eq!(START_RAD.len(), 2);
}

#[test]
fn damaged_frames_are_counted_on_both_sides() {
    let mut faults = Faults::NONE;
    faults.corrupt = 0.1;
    let mut patience = settings(3);
    patience.attempts = 20;
    let mut session = Session::open(Faulty::new(board(), faults), patience).unwrap();
    for _ in 0..100 {
        session.status().unwrap();
    }
    let link = session.status().unwrap().link;
    assert!(link.damaged > 10, "{link:?}");
    assert!(session.reception().damaged > 10);
    assert_eq!(session.reception().not_understood, 0);
}
