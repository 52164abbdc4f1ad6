//! Every command in every state: its answer, the state afterwards, and that a refusal changes
//! nothing.

mod common;

use common::{AXES, Drives, FINE, begin, brought_to, limits, start, trajectory};
use nalgebra::SVector;
use stillpoint_firmware::{Command, Config, Executor, FaultCause, Refusal, StartRequest, State};
use stillpoint_shared::assembly::{Arrived, Outline};

fn end() -> SVector<f32, AXES> {
    SVector::<f32, AXES>::from_fn(|axis, _| {
        (common::START_RAD[axis] + common::REACH_RAD[axis]) as f32
    })
}

/// Gives the command as the host would, with everything else in order.
fn order(executor: &mut Executor<AXES>, command: Command) -> Result<(), Refusal> {
    let header = *trajectory().header();
    match command {
        Command::BeginLoad => executor.begin_load(&Outline::of(&trajectory())),
        Command::CommitLoad => {
            // The upload is complete wherever one may be under way.
            if executor.allows(Command::CommitLoad).is_ok() {
                begin(executor, &trajectory());
            }
            executor.commit_load(header.content_hash, &start())
        }
        Command::AbortLoad => {
            executor.abort_load();
            Ok(())
        }
        Command::Load => executor.load(&trajectory(), &start()),
        Command::Arm => executor.arm(),
        Command::Disarm => executor.disarm(),
        Command::Start => executor.start(&executor.start_request()),
        Command::DryRun => executor.start(&StartRequest {
            dry_run: true,
            ..executor.start_request()
        }),
        Command::Hold => executor.hold(),
        Command::Resume => executor.resume(),
        Command::Override => executor.set_override(50),
        Command::QuickStop => {
            executor.quick_stop();
            Ok(())
        }
        Command::Clear => executor.clear(),
        Command::Configure => executor.configure(&limits(), &Config::default()),
        // Carried out by whoever has the flash, who asks first.
        Command::Store | Command::Erase => executor.allows(command),
        other => panic!("no test for {other:?}"),
    }
}

const NO: Option<State> = None;

/// The state after each command, in the order of `State::ALL`; `NO` if it is refused.
fn table(command: Command) -> [Option<State>; 10] {
    use State::*;
    let s = Some;
    match command {
        Command::BeginLoad => [
            s(Loading),
            s(Loading),
            s(Loading),
            s(Armed),
            s(Running),
            s(Holding),
            s(Held),
            s(Done),
            NO,
            NO,
        ],
        Command::CommitLoad => [NO, s(Ready), NO, s(Armed), NO, NO, NO, s(Armed), NO, NO],
        Command::AbortLoad => [
            s(Idle),
            s(Ready),
            s(Ready),
            s(Armed),
            s(Running),
            s(Holding),
            s(Held),
            s(Done),
            s(Stopping),
            s(Fault),
        ],
        Command::Load => [
            s(Ready),
            NO,
            s(Ready),
            s(Armed),
            NO,
            NO,
            NO,
            s(Armed),
            NO,
            NO,
        ],
        Command::Arm => [NO, NO, s(Armed), NO, NO, NO, NO, NO, NO, NO],
        Command::Disarm => [NO, NO, NO, s(Ready), NO, NO, NO, s(Ready), NO, NO],
        Command::Start => [NO, NO, NO, s(Running), NO, NO, NO, NO, NO, NO],
        Command::DryRun => [NO, NO, s(Running), NO, NO, NO, NO, NO, NO, NO],
        Command::Hold => [NO, NO, NO, NO, s(Holding), s(Holding), s(Held), NO, NO, NO],
        Command::Resume => [NO, NO, NO, NO, NO, s(Running), s(Running), NO, NO, NO],
        Command::Override => [
            s(Idle),
            s(Loading),
            s(Ready),
            s(Armed),
            s(Running),
            s(Holding),
            s(Held),
            s(Done),
            s(Stopping),
            s(Fault),
        ],
        Command::QuickStop => [
            s(Fault),
            s(Fault),
            s(Fault),
            s(Fault),
            s(Stopping),
            s(Stopping),
            s(Stopping),
            s(Fault),
            s(Stopping),
            s(Fault),
        ],
        Command::Clear => [
            s(Idle),
            s(Loading),
            s(Ready),
            NO,
            NO,
            NO,
            NO,
            NO,
            NO,
            s(Ready),
        ],
        Command::Store => [NO, NO, s(Ready), NO, NO, NO, NO, NO, NO, NO],
        Command::Erase => [s(Idle), NO, s(Ready), NO, NO, NO, NO, NO, NO, NO],
        Command::Configure => [s(Idle), NO, s(Idle), NO, NO, NO, NO, NO, NO, NO],
        other => panic!("no row for {other:?}"),
    }
}

#[test]
fn every_command_has_an_answer_in_every_state() {
    for command in Command::ALL {
        for (state, after) in State::ALL.into_iter().zip(table(command)) {
            let (mut executor, _) = brought_to(state);
            let answer = order(&mut executor, command);
            let allowed = command.allowed_in().contains(&state);
            assert_eq!(allowed, after.is_some(), "{command:?} in {state:?}");
            match after {
                Some(after) => assert_eq!(
                    (answer, executor.state()),
                    (Ok(()), after),
                    "{command:?} in {state:?}"
                ),
                None => {
                    let refused = Err(Refusal::WrongState { command, state });
                    assert_eq!(
                        (answer, executor.state()),
                        (refused, state),
                        "{command:?} in {state:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_emergency_stop_is_a_fault_in_every_state_and_only_clear_leaves_it() {
    for state in State::ALL {
        let (mut executor, mut drives) = brought_to(state);
        let before = executor.fault();
        let pressed = stillpoint_firmware::TickInputs {
            emergency_stop: true,
            ..FINE
        };
        let (exchanges, safes) = (drives.exchanges, drives.safes);
        let report = executor.tick(&mut drives, &pressed);
        assert_eq!(report.state, State::Fault, "in {state:?}");
        assert_eq!(
            (drives.exchanges, drives.safes),
            (exchanges, safes + 1),
            "in {state:?}: torque off in the very tick"
        );
        match before {
            Some(first) => assert_eq!(report.fault, Some(first), "the first cause stays"),
            None => assert_eq!(
                report.fault.map(|fault| fault.cause),
                Some(FaultCause::EmergencyStop)
            ),
        }
        assert_eq!(
            executor.clear(),
            Err(Refusal::EmergencyStop),
            "still pressed"
        );
        executor.tick(&mut drives, &FINE);
        assert_eq!(executor.state(), State::Fault, "released, but not cleared");
        executor.clear().unwrap();
        let loaded = if state == State::Idle {
            State::Idle
        } else {
            State::Ready
        };
        assert_eq!((executor.state(), executor.fault()), (loaded, None));
    }
}

#[test]
fn an_upload_under_way_in_any_state_can_be_committed_where_nothing_moves() {
    for state in [State::Armed, State::Running, State::Held, State::Done] {
        let (mut executor, mut drives) = brought_to(state);
        begin(&mut executor, &trajectory());
        assert_eq!(executor.state(), state);
        let hash = trajectory().header().content_hash;
        let moving = state.is_under_way();
        let answer = executor.commit_load(hash, &start());
        assert_eq!(answer.is_err(), moving, "{state:?}: {answer:?}");
        if !moving {
            continue;
        }
        // It waits until the move is over.
        if state == State::Held {
            executor.resume().unwrap();
        }
        while executor.state() != State::Done {
            executor.tick(&mut drives, &FINE);
        }
        let arrived = executor.arrived();
        assert!(arrived.blocks > 0 && arrived.missing() == 0, "{arrived:?}");
        assert!(matches!(
            executor.commit_load(hash, &end()),
            Err(Refusal::Rejected(_))
        ));
        executor.commit_load(hash, &start()).unwrap();
        assert_eq!(
            (executor.state(), executor.arrived()),
            (State::Armed, Arrived::default())
        );
    }
}

#[test]
fn an_executor_without_limits_takes_its_configuration_and_nothing_else() {
    let mut executor = Executor::<AXES>::unconfigured();
    let mut drives = Drives::at(&start());
    executor.tick(&mut drives, &FINE);
    assert_eq!(
        executor.begin_load(&Outline::of(&trajectory())),
        Err(Refusal::NotConfigured)
    );
    assert_eq!(
        executor.load(&trajectory(), &start()),
        Err(Refusal::NotConfigured)
    );
    executor.configure(&limits(), &Config::default()).unwrap();
    executor.load(&trajectory(), &start()).unwrap();
    assert_eq!(executor.state(), State::Ready);
    executor.configure(&limits(), &Config::default()).unwrap();
    assert_eq!(executor.state(), State::Idle, "accepted under other limits");
    assert!(matches!(executor.arm(), Err(Refusal::WrongState { .. })));
}
