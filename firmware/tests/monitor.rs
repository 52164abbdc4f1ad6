//! The following-error limit ramps with speed, and its peak is kept.

mod common;

use common::AXES;
use stillpoint_firmware::monitor::{Monitor, MonitorConfig, alive};
use stillpoint_firmware::{DriveStatus, FaultCause, Feedback, Setpoint};

fn at(position_rad: f32, status: DriveStatus) -> Feedback {
    Feedback {
        position_rad,
        velocity_rad_per_s: 0.0,
        age_ticks: 0,
        status,
    }
}

#[test]
fn the_following_error_limit_ramps_with_speed_and_its_peak_is_kept() {
    let config = MonitorConfig {
        following_at_rest_rad: 0.01,
        following_lag_s: 0.002,
        feedback_age_ticks: 2,
        ..MonitorConfig::default()
    };
    let mut monitor = Monitor::<AXES>::default();
    for (speed, error, allowed) in [
        (0.0, 0.009, true),
        (0.0, 0.011, false),
        (10.0, 0.029, true),
        (-10.0, -0.029, true),
        (10.0, 0.031, false),
    ] {
        let setpoint = Setpoint {
            position_rad: 1.0 + error,
            velocity_rad_per_s: speed,
            torque_nm: 0.0,
        };
        let feedback = [
            at(1.0, DriveStatus::Enabled),
            at(1.0 + error, DriveStatus::Enabled),
        ];
        let found = monitor.check(&config, &[setpoint; AXES], &feedback, &[true; AXES]);
        assert_eq!(
            found.is_ok(),
            allowed,
            "{error} rad at {speed} rad/s: {found:?}"
        );
    }
    let peaks = monitor.peak_following_error_rad();
    assert!((peaks[0] - 0.031).abs() < 1e-6 && peaks[1] == 0.0);
}

#[test]
fn a_disabled_drive_is_a_fault_only_where_it_has_to_follow() {
    let far = Setpoint {
        position_rad: 3.0,
        ..Setpoint::default()
    };
    let feedback = [at(0.0, DriveStatus::Disabled); AXES];
    let mut monitor = Monitor::<AXES>::default();
    let config = MonitorConfig::default();
    assert_eq!(
        monitor.check(&config, &[far; AXES], &feedback, &[false; AXES]),
        Ok(())
    );
    let disabled = Err(FaultCause::DriveDisabled { axis: 1 });
    assert_eq!(
        monitor.check(&config, &[far; AXES], &feedback, &[false, true]),
        disabled
    );
}

#[test]
fn what_is_told_of_feedback_that_is_wrong_in_several_ways() {
    let config = MonitorConfig::default();
    let mut feedback = at(f32::NAN, DriveStatus::Enabled);
    assert_eq!(
        alive(&config, 1, &feedback),
        Err(FaultCause::FeedbackNotFinite { axis: 1 })
    );
    // Numbers that came too long ago say nothing about the encoder of today.
    feedback.age_ticks = config.feedback_age_ticks + 1;
    assert_eq!(
        alive(&config, 1, &feedback),
        Err(FaultCause::FeedbackStale {
            axis: 1,
            age_ticks: feedback.age_ticks,
            limit_ticks: config.feedback_age_ticks,
        })
    );
    feedback.status = DriveStatus::Fault { code: 7 };
    assert_eq!(
        alive(&config, 1, &feedback),
        Err(FaultCause::DriveFault { axis: 1, code: 7 })
    );
}
