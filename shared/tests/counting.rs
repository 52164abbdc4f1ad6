//! Texts for people count axes and intervals from 1, whatever the numbers inside count from.

use stillpoint_shared::drive_config::{DriveConfigError, Problem};
use stillpoint_shared::status::{FaultCause, Limit, Place, Quantity, Refusal, Rejection};
use stillpoint_shared::{LimitName, LimitsError, TrajectoryError};

/// Every text that names an axis or an interval, for the ones of this index.
fn texts(axis: u8, interval: u8) -> Vec<String> {
    let at = Place {
        axis,
        interval,
        ticks: 0,
    };
    let quantity = Quantity::Torque;
    let (value, allowed, tolerance) = (9.5, 9.5, 9.5);
    let index = usize::from(interval);
    let node = 77;
    let mut texts: Vec<String> = [
        Rejection::NotFinite { at, quantity },
        Rejection::Jump {
            at,
            quantity,
            before: 9.5,
            after: 9.5,
            tolerance,
        },
        Rejection::StartsElsewhere {
            at,
            planned_rad: 9.5,
            measured_rad: 9.5,
            tolerance_rad: 9.5,
        },
        Rejection::NotStill {
            at,
            quantity,
            value,
            tolerance,
        },
        Rejection::Exceeds {
            at,
            limit: Limit::Torque,
            value,
            allowed,
        },
    ]
    .map(|error| error.to_string())
    .into();
    let causes = [
        FaultCause::DriveFault { axis, code: 77 },
        FaultCause::DriveDisabled { axis },
        FaultCause::FeedbackNotFinite { axis },
        FaultCause::FeedbackStale {
            axis,
            age_ticks: 77,
            limit_ticks: 77,
        },
        FaultCause::FollowingError {
            axis,
            error_rad: 9.5,
            limit_rad: 9.5,
        },
        FaultCause::LeftStart {
            axis,
            distance_rad: 9.5,
            tolerance_rad: 9.5,
        },
        FaultCause::NotEnabled {
            axis,
            waited_ticks: 77,
            limit_ticks: 77,
        },
    ];
    texts.extend(causes.map(|cause| cause.to_string()));
    let refusals = [
        Refusal::NotEnabled { axis },
        Refusal::NotAtStart {
            axis,
            measured_rad: 9.5,
            first_rad: 9.5,
            tolerance_rad: 9.5,
        },
        Refusal::Approaching {
            axis,
            distance_rad: 9.5,
        },
    ];
    texts.extend(refusals.map(|refusal| refusal.to_string()));
    let limits = LimitsError::Value {
        axis: axis.into(),
        name: LimitName::Torque,
        value,
    };
    texts.push(limits.to_string());
    let drives = [
        DriveConfigError::NodeIsBoards { axis, node },
        DriveConfigError::NodeTwice { axis, bus: 0, node },
        DriveConfigError::Axis {
            axis,
            problem: Problem::Node(node),
        },
    ];
    texts.extend(drives.map(|error| error.to_string()));
    let trajectories = [
        TrajectoryError::Points {
            interval: index,
            points: 77,
        },
        TrajectoryError::TooManyBases { interval: index },
        TrajectoryError::NoDuration { interval: index },
        TrajectoryError::TooLong { interval: index },
        TrajectoryError::Coefficients {
            interval: index,
            found: 77,
            expected: 77,
        },
        TrajectoryError::TooManyCoefficients {
            interval: index,
            needed: 77,
        },
        TrajectoryError::NotFinite {
            interval: index,
            index: 77,
            value: 9.5,
        },
    ];
    texts.extend(trajectories.map(|error| error.to_string()));
    texts
}

/// The numbers behind a word.
fn after<'t>(text: &'t str, word: &str) -> Vec<&'t str> {
    let mut numbers = Vec::new();
    let mut rest = text;
    while let Some(place) = rest.find(word) {
        rest = &rest[place + word.len()..];
        let end = rest.find(|c: char| !c.is_ascii_digit());
        numbers.push(&rest[..end.unwrap_or(rest.len())]);
    }
    numbers.retain(|number| !number.is_empty());
    numbers
}

#[test]
fn people_count_from_1() {
    for (axis, interval, first, second) in [(0, 0, "1", "1"), (2, 4, "3", "5")] {
        for text in texts(axis, interval) {
            let (axes, intervals) = (after(&text, "axis "), after(&text, "interval "));
            assert!(
                axes.len() + intervals.len() >= 1,
                "no axis, no interval: {text}"
            );
            assert!(axes.iter().all(|number| *number == first), "{text}");
            assert!(intervals.iter().all(|number| *number == second), "{text}");
        }
    }
    // Whatever comes over the wire can be shown.
    assert!(texts(u8::MAX, u8::MAX)[0].starts_with("axis 256, interval 256"));
    let interval = usize::MAX;
    assert!(
        !TrajectoryError::NoDuration { interval }
            .to_string()
            .is_empty()
    );
}
