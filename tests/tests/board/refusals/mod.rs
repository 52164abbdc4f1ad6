//! What a board refuses, through the wire: on the emulated board and, the same again, on the simulated one.

mod orders;
mod rejections;
mod uploads;
mod versions;

use std::collections::BTreeSet;
use std::fmt::Debug;

use stillpoint::device::{DeviceError, Session, Settings, Simulated, Transport};
use stillpoint_firmware::bench::{AXES, Action};
use stillpoint_firmware::{FaultCause, Refusal, Rejection};
use stillpoint_shared::protocol::{Denial, Request, SCHEMA, StoreError};
use stillpoint_shared::status::Quantity;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder};

use super::bench::{Bench, first_rad, paper};

const POINTS: usize = 8;
const INTERVALS: usize = 2;
const INTERVAL_TICKS: u32 = 100_000;

/// A move that stays at the start of the paper's, with values changed: by interval, node, quantity (as in a row) and
/// axis.
fn changed(
    limits: &Limits,
    change: impl Fn(usize, usize, Quantity, usize) -> Option<f64>,
) -> Trajectory {
    let axes = limits.axes().len();
    let first = first_rad(&paper().1);
    let mut builder = TrajectoryBuilder::new(7, limits);
    for interval in 0..INTERVALS {
        let mut values = Vec::new();
        for node in 0..=POINTS {
            for quantity in Quantity::ALL {
                for (axis, &first_rad) in first.iter().enumerate().take(axes) {
                    let usual = match quantity {
                        Quantity::Position => f64::from(first_rad),
                        _ => 0.0,
                    };
                    values.push(change(interval, node, quantity, axis).unwrap_or(usual));
                }
            }
        }
        builder.interval(INTERVAL_TICKS, POINTS, &values).unwrap();
    }
    builder.finish().unwrap()
}

/// The same with one value of one node in the first interval.
fn with_value(node: usize, quantity: Quantity, value: f64) -> Trajectory {
    changed(&paper().0, |i, n, q, a| {
        (i == 0 && n == node && q == quantity && a == 1).then_some(value)
    })
}

/// The same with one quantity of one axis throughout.
fn throughout(quantity: Quantity, value: f64) -> Trajectory {
    changed(&paper().0, |_, _, q, a| {
        (q == quantity && a == 1).then_some(value)
    })
}

fn refusal(error: DeviceError) -> Refusal {
    match error {
        DeviceError::Denied(Denial::Executor(refusal)) => refusal,
        error => panic!("{error}"),
    }
}

fn rejected<T: Transport>(session: &mut Session<T>, trajectory: &Trajectory) -> Rejection {
    let error = session.upload(trajectory, |_| {}).unwrap_err();
    match refusal(error) {
        Refusal::Rejected(rejection) => rejection,
        refusal => panic!("{refusal}"),
    }
}

/// Name of a variant.
fn name(value: &impl Debug) -> String {
    let debug = format!("{value:?}");
    let end = debug.find(|c: char| !c.is_ascii_alphanumeric());
    debug[..end.unwrap_or(debug.len())].to_owned()
}

/// Names of an enum's variants by the protocol's schema.
fn variants(of: &str) -> BTreeSet<String> {
    let heading = format!("{of} enum");
    let lines = SCHEMA.lines().skip_while(|line| *line != heading).skip(1);
    let lines = lines.take_while(|line| line.starts_with(' '));
    let names = lines.map(|line| line.split_whitespace().nth(1).unwrap());
    let end = |name: &str| {
        name.find(|c: char| !c.is_ascii_alphanumeric())
            .unwrap_or(name.len())
    };
    names.map(|name| name[..end(name)].to_owned()).collect()
}

fn simulated() -> Session<Simulated<AXES>> {
    let (limits, trajectory) = paper();
    let board = Simulated::new(Some(limits.clone()), first_rad(trajectory)).unwrap();
    Session::open(board, Settings::default()).unwrap()
}

fn all<T: Transport>(session: &mut Session<T>) -> StoreError {
    rejections::rejections(session);
    uploads::uploads(session);
    orders::starts(session);
    let error = orders::full_store(session);
    versions::versions(session);
    error
}

#[test]
fn the_simulated_board_refuses_with_the_reason() {
    let most = stillpoint_shared::protocol::MAX_STORED as u8;
    assert_eq!(all(&mut simulated()), StoreError::TooMany { most });
}

#[test]
fn the_emulated_board_refuses_with_the_reason() {
    let error = all(&mut Bench::configured().session);
    assert!(matches!(error, StoreError::NoRoom { needed, available } if needed > available));
}

#[test]
fn a_board_without_limits_refuses_moves() {
    let mut bench = Bench::new();
    let error = bench.session.upload(&paper().1, |_| {}).unwrap_err();
    assert_eq!(refusal(error), Refusal::NotConfigured);
    let axes = [AxisLimits {
        torque_nm: -1.0,
        ..paper().0.axes()[0]
    }; 3];
    let limits = Request::SetLimits(axes.into_iter().collect());
    let error = bench.session.order(&limits).unwrap_err();
    assert!(
        matches!(error, DeviceError::Denied(Denial::Limits(_))),
        "{error}"
    );
}

/// The axes were turned after the upload.
#[test]
fn an_axis_that_stands_elsewhere_is_not_switched_on() {
    let mut bench = Bench::loaded();
    let mut turned = first_rad(&paper().1);
    turned[2] += 0.02;
    bench.session.transport_mut().turn_to(&turned).unwrap();
    bench.until_measured(&turned);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    let wanted = Refusal::NotAtStart {
        axis: 2,
        measured_rad: turned[2],
        first_rad: first_rad(&paper().1)[2],
        tolerance_rad: 1e-3,
    };
    assert_eq!(refusal(error), wanted);
}

#[test]
fn drives_that_are_ill_or_unheard_are_not_switched_on() {
    let mut bench = Bench::loaded();
    bench.act(Action::CutBus);
    bench.wait_ticks(4);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    assert_eq!(refusal(error), Refusal::NoFeedback);
    bench.act(Action::Repair);
    bench.act(Action::Silence { axis: 1 });
    bench.wait_ticks(10);
    let error = bench.session.order(&Request::Arm).unwrap_err();
    assert!(matches!(
        refusal(error),
        Refusal::Feedback(FaultCause::FeedbackStale { axis: 1, .. })
    ));
}
