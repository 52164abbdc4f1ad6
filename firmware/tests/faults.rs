//! Every cause in every state with the drives on: the right state, the first cause kept, recorded,
//! and nothing but safe drives afterwards until `clear`.

mod common;

use common::{AXES, Drives, FINE, brought_to};
use stillpoint_firmware::{DriveStatus, Executor, FaultCause, State, TickInputs};

const ENERGISED: [State; 6] = [
    State::Armed,
    State::Running,
    State::Holding,
    State::Held,
    State::Done,
    State::Stopping,
];

/// What goes wrong, before a tick.
type Trouble = fn(&mut Executor<AXES>, &mut Drives, &mut TickInputs);

/// What goes wrong, its cause, and the states in which it is a fault at once, or after the move has
/// slowed down.
struct Case {
    trouble: Trouble,
    cause: FaultCause,
    at_once: &'static [State],
    later: &'static [State],
}

fn cases() -> Vec<Case> {
    use State::{Armed, Done, Held, Holding, Running, Stopping};
    let case = |trouble: Trouble, cause| Case {
        trouble,
        cause,
        at_once: &ENERGISED,
        later: &[],
    };
    vec![
        case(
            |_, _, inputs| inputs.emergency_stop = true,
            FaultCause::EmergencyStop,
        ),
        case(
            |executor, _, _| executor.emergency_stop(),
            FaultCause::EmergencyStop,
        ),
        case(
            |_, drives, _| drives.bus_broken = true,
            FaultCause::ExchangeFailed,
        ),
        case(
            |_, drives, _| {
                drives.spoil(|feedback| feedback[1].status = DriveStatus::Fault { code: 0x7500 });
            },
            FaultCause::DriveFault {
                axis: 1,
                code: 0x7500,
            },
        ),
        case(
            |_, drives, _| drives.spoil(|feedback| feedback[0].position_rad = f32::NAN),
            FaultCause::FeedbackNotFinite { axis: 0 },
        ),
        case(
            |_, drives, _| drives.spoil(|feedback| feedback[1].velocity_rad_per_s = f32::INFINITY),
            FaultCause::FeedbackNotFinite { axis: 1 },
        ),
        case(
            |_, drives, _| drives.spoil(|feedback| feedback[1].age_ticks = 3),
            FaultCause::FeedbackStale {
                axis: 1,
                age_ticks: 3,
                limit_ticks: 2,
            },
        ),
        case(
            |_, drives, _| drives.spoil(|feedback| feedback[0].status = DriveStatus::Disabled),
            FaultCause::DriveDisabled { axis: 0 },
        ),
        Case {
            at_once: &[Running, Holding, Held, Stopping],
            ..case(
                |_, _, inputs| inputs.missed_ticks = 3,
                FaultCause::TicksMissed { missed: 3 },
            )
        },
        Case {
            at_once: &[Running, Holding, Held, Stopping],
            ..case(
                |_, _, inputs| inputs.busy_ticks = 2_001,
                FaultCause::LoopOverrun {
                    duration_ticks: 2_001,
                    limit_ticks: 2_000,
                },
            )
        },
        Case {
            at_once: &[Armed, Done],
            later: &[Running, Holding, Held, Stopping],
            ..case(
                |executor, _, _| executor.quick_stop(),
                FaultCause::QuickStop,
            )
        },
    ]
}

/// Whatever is asked for, but `clear`, and whatever is measured: nothing moves.
fn stays_off(executor: &mut Executor<AXES>, drives: &mut Drives, context: &str) {
    let (fault, exchanges, safes) = (executor.fault(), drives.exchanges, drives.safes);
    drives.spoil(|feedback| feedback[0].position_rad = f32::NAN);
    for _ in 0..20 {
        let _ = executor.resume();
        let _ = executor.arm();
        let _ = executor.start(&executor.start_request());
        let _ = executor.hold();
        executor.quick_stop();
        executor.emergency_stop();
        let report = executor.tick(drives, &FINE);
        assert_eq!(
            (report.state, report.fault),
            (State::Fault, fault),
            "{context}"
        );
        let mut setpoints = report.setpoints.iter();
        assert!(setpoints.all(|setpoint| setpoint.position_rad.is_finite()));
    }
    assert_eq!(
        (drives.exchanges, drives.safes),
        (exchanges, safes + 20),
        "{context}: no set-point, and safe in every tick"
    );
}

#[test]
fn every_cause_in_every_state_with_the_drives_on() {
    for case in cases() {
        for state in ENERGISED {
            let context = format!("{:?} in {state:?}", case.cause);
            let (mut executor, mut drives) = brought_to(state);
            let before = executor.fault().map(|fault| fault.cause);
            let mut inputs = FINE;
            (case.trouble)(&mut executor, &mut drives, &mut inputs);
            let safes = drives.safes;
            executor.tick(&mut drives, &inputs);
            if case.at_once.contains(&state) {
                assert_eq!(executor.state(), State::Fault, "{context}");
                assert_eq!(drives.safes, safes + 1, "{context}: in the very tick");
            } else if case.later.contains(&state) {
                while executor.state() != State::Fault {
                    assert_eq!(executor.state(), State::Stopping, "{context}");
                    executor.tick(&mut drives, &FINE);
                }
            } else {
                assert_eq!((executor.state(), executor.fault()), (state, None));
                continue;
            }

            let fault = executor.fault().unwrap();
            assert_eq!(fault.cause, before.unwrap_or(case.cause), "{context}");
            let record = executor.fault_record().expect(&context);
            assert_eq!(record.fault(), Some(fault), "{context}");
            let last = record.samples().last().unwrap();
            assert_eq!(last.state, Some(State::Fault), "{context}");

            stays_off(&mut executor, &mut drives, &context);
            assert_eq!(executor.fault_record().unwrap().fault(), Some(fault));
            executor.clear().unwrap();
            assert_eq!(
                (executor.state(), executor.fault()),
                (State::Ready, None),
                "{context}"
            );
        }
    }
}

#[test]
fn a_following_error_in_every_state_with_the_drives_on() {
    for state in ENERGISED {
        let (mut executor, mut drives) = brought_to(state);
        let before = executor.fault().map(|fault| fault.cause);
        drives.spoil(|feedback| feedback[1].position_rad -= 0.5);
        executor.tick(&mut drives, &FINE);
        assert_eq!(executor.state(), State::Fault, "{state:?}");
        let cause = executor.fault().unwrap().cause;
        let expected = matches!(cause, FaultCause::FollowingError { axis: 1, error_rad, .. }
            if (error_rad - 0.5).abs() < 0.01);
        assert!(expected || Some(cause) == before, "{cause:?} in {state:?}");
        stays_off(&mut executor, &mut drives, "following error");
    }
}

#[test]
fn a_fault_between_two_ticks_is_in_the_record_at_once() {
    let emergency: fn(&mut Executor<AXES>) = Executor::emergency_stop;
    let cases = ENERGISED.map(|state| (state, emergency));
    let quick: fn(&mut Executor<AXES>) = Executor::quick_stop;
    let at_once = [State::Armed, State::Done].map(|state| (state, quick));
    for (state, stop) in cases.into_iter().chain(at_once) {
        let (mut executor, mut drives) = brought_to(state);
        stop(&mut executor);
        let fault = executor.fault().unwrap();
        let closed = executor.fault_record().unwrap();
        assert_eq!(closed.fault(), Some(fault), "{state:?}");
        let samples: Vec<_> = closed.samples().collect();
        let last = samples.last().unwrap();
        assert_eq!(last.state, Some(State::Fault), "{state:?}");
        assert_eq!(u64::from(last.tick), executor.ticks(), "{state:?}");

        executor.clear().unwrap();
        let (exchanges, safes) = (drives.exchanges, drives.safes);
        executor.tick(&mut drives, &FINE);
        assert_eq!(executor.state(), State::Ready, "{state:?}");
        assert_eq!((drives.exchanges, drives.safes), (exchanges, safes + 1));
        let record = executor.fault_record().unwrap();
        assert_eq!(record.fault(), Some(fault), "{state:?}");
        assert!(!record.is_recording());
        assert!(record.samples().eq(samples), "{state:?}: as it was closed");
    }
}
