//! The state machine and its tick, on ideal and on misbehaving drives.

mod common;

use common::{
    AXES, DURATION_TICKS, Drives, FINE, START_RAD, brought_to, changed, executor, limits, start,
    trajectory,
};
use nalgebra::SVector;
use stillpoint_firmware::accept::{self, AcceptConfig};
use stillpoint_firmware::{
    Config, ConfigError, ConfigField, Executor, Fault, FaultCause, IdealDrives, LimitFlags,
    Refusal, Rejection, Setpoint, State, TickReport,
};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;
use stillpoint_shared::{AxisLimits, Limits, Player, Trajectory, TrajectoryBuilder, lgr};

/// What a report says, kept.
#[derive(Debug, PartialEq)]
struct Kept {
    state: State,
    path_ticks: u32,
    setpoints: [Setpoint; AXES],
    limited: [LimitFlags; AXES],
    fault: Option<Fault>,
}

fn kept(report: &TickReport<AXES>) -> Kept {
    Kept {
        state: report.state,
        path_ticks: report.path_ticks,
        setpoints: *report.setpoints,
        limited: *report.limited,
        fault: report.fault,
    }
}

fn play() -> Vec<Kept> {
    let (mut executor, mut drives) = brought_to(State::Running);
    let mut reports = Vec::new();
    while executor.state() == State::Running {
        reports.push(kept(&executor.tick(&mut drives, &FINE)));
    }
    reports.push(kept(&executor.tick(&mut drives, &FINE)));
    reports
}

#[test]
fn set_points_are_the_trajectory_bit_for_bit() {
    let reports = play();
    let player = Player::<AXES>::new(&trajectory()).unwrap();
    assert_eq!(
        reports.len() as u32,
        DURATION_TICKS / DRIVE_PERIOD_TICKS + 2
    );
    for (tick, report) in (0..).zip(&reports) {
        assert_eq!(
            report.path_ticks,
            (tick * DRIVE_PERIOD_TICKS).min(DURATION_TICKS)
        );
        let sample = player.sample(report.path_ticks).unwrap();
        for (axis, setpoint) in report.setpoints.iter().enumerate() {
            assert_eq!(
                setpoint.position_rad.to_bits(),
                sample.position_rad[axis].to_bits()
            );
            assert_eq!(
                setpoint.velocity_rad_per_s.to_bits(),
                sample.velocity_rad_per_s[axis].to_bits()
            );
            assert_eq!(
                setpoint.torque_nm.to_bits(),
                sample.torque_nm[axis].to_bits()
            );
        }
        assert_eq!(report.limited, [LimitFlags::NONE; AXES]);
    }
    let last = reports.last().unwrap();
    assert_eq!((last.state, last.fault), (State::Done, None));
    let end = &trajectory().coefficients()[trajectory().coefficients().len() - 3 * AXES..][..AXES]
        .to_vec();
    assert_eq!(
        last.setpoints
            .map(|setpoint| setpoint.position_rad)
            .as_slice(),
        end
    );
}

#[test]
fn playing_twice_gives_the_same_reports() {
    assert_eq!(play(), play());
}

#[test]
fn a_duration_between_ticks_ends_exactly_at_the_last_node() {
    let period_ticks = 7_001;
    let mut executor = Executor::<AXES>::new(
        limits(),
        Config {
            period_ticks,
            ..Config::default()
        },
    )
    .unwrap();
    let mut drives = Drives::at(&start());
    executor.tick(&mut drives, &FINE);
    executor.load(&trajectory(), &start()).unwrap();
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    executor.start(&executor.start_request()).unwrap();
    let mut ticks = 0;
    while executor.state() == State::Running {
        let report = executor.tick(&mut drives, &FINE);
        assert_eq!(
            report.path_ticks,
            (ticks * period_ticks).min(DURATION_TICKS)
        );
        ticks += 1;
    }
    assert_eq!(ticks, DURATION_TICKS.div_ceil(period_ticks) + 1);
}

#[test]
fn enabling_is_no_jump_and_the_axis_creeps_to_the_first_node() {
    let mut measured = start();
    measured[0] += 0.9e-3;
    let (mut executor, mut drives) = (executor(), Drives::at(&measured));
    drives.enabling_ticks = 5;
    executor.load(&trajectory(), &measured).unwrap();
    assert_eq!(executor.arm(), Err(Refusal::NoFeedback));
    executor.tick(&mut drives, &FINE);
    executor.arm().unwrap();
    for _ in 0..6 {
        let report = executor.tick(&mut drives, &FINE);
        assert_eq!(
            report.setpoints[0].position_rad, measured[0],
            "until the drive is enabled"
        );
        assert!(executor.start(&executor.start_request()).is_err());
    }
    assert!(matches!(
        executor.start(&executor.start_request()),
        Err(Refusal::Approaching { axis: 0, .. })
    ));
    let mut previous_rad = measured[0];
    let mut ticks = 0;
    while executor.start(&executor.start_request()).is_err() {
        let now_rad = executor.tick(&mut drives, &FINE).setpoints[0].position_rad;
        assert!(
            (previous_rad - now_rad) * 4_000.0 <= 0.051,
            "faster than it may creep"
        );
        previous_rad = now_rad;
        ticks += 1;
        assert!(ticks < 100);
    }
    assert_eq!(previous_rad, START_RAD[0] as f32);
    assert_eq!(executor.state(), State::Running);
}

#[test]
fn an_axis_that_sags_before_its_drive_holds_it_is_not_pulled_back() {
    let (mut executor, mut drives) = brought_to(State::Ready);
    drives.enabling_ticks = 2;
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    let mut sagged = start();
    sagged[1] -= 0.5e-3;
    drives.ideal = IdealDrives::at(&sagged);
    executor.tick(&mut drives, &FINE);
    assert_eq!(
        executor.tick(&mut drives, &FINE).setpoints[1].position_rad,
        sagged[1]
    );
}

#[test]
fn start_waits_for_the_drives() {
    let (mut executor, mut drives) = (executor(), Drives::at(&start()));
    drives.enabling_ticks = 3;
    executor.load(&trajectory(), &start()).unwrap();
    executor.tick(&mut drives, &FINE);
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    assert_eq!(
        executor.start(&executor.start_request()),
        Err(Refusal::NotEnabled { axis: 0 })
    );
}

#[test]
fn arming_needs_fresh_feedback_near_the_first_node() {
    let (mut executor, mut drives) = brought_to(State::Ready);
    drives.spoil(|feedback| feedback[1].age_ticks = 3);
    executor.tick(&mut drives, &FINE);
    let stale = FaultCause::FeedbackStale {
        axis: 1,
        age_ticks: 3,
        limit_ticks: 2,
    };
    assert_eq!(executor.arm(), Err(Refusal::Feedback(stale)));

    drives.spoil(|feedback| feedback[1].position_rad = -0.9);
    executor.tick(&mut drives, &FINE);
    let (measured_rad, first_rad) = (-0.9, -1.0);
    assert_eq!(
        executor.arm(),
        Err(Refusal::NotAtStart {
            axis: 1,
            measured_rad,
            first_rad,
            tolerance_rad: 1e-3
        })
    );

    drives.bus_broken = true;
    executor.tick(&mut drives, &FINE);
    assert_eq!(executor.arm(), Err(Refusal::NoFeedback));
    assert_eq!((executor.state(), drives.exchanges), (State::Ready, 0));
}

#[test]
fn a_rejected_trajectory_leaves_the_loaded_one() {
    let (mut executor, _) = brought_to(State::Ready);
    let jump = changed(&limits(), |index, value| {
        if index == (1, 0, 0, 0) {
            value + 0.1
        } else {
            value
        }
    });
    assert!(matches!(
        executor.load(&jump, &start()),
        Err(Refusal::Rejected(Rejection::Jump { .. }))
    ));
    assert_eq!(
        (executor.trajectory(), executor.state()),
        (&trajectory(), State::Ready)
    );
}

#[test]
fn the_next_move_follows_without_losing_torque() {
    let (mut executor, mut drives) = brought_to(State::Done);
    let safes = drives.safes;
    let back = changed(&limits(), |(_, _, quantity, axis), value| {
        if quantity == 0 {
            2.0 * START_RAD[axis] + common::REACH_RAD[axis] - value
        } else {
            -value
        }
    });
    let end =
        SVector::<f32, AXES>::from_fn(|axis, _| (START_RAD[axis] + common::REACH_RAD[axis]) as f32);
    executor.load(&back, &end).unwrap();
    executor.tick(&mut drives, &FINE);
    executor.start(&executor.start_request()).unwrap();
    while executor.state() == State::Running {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!((executor.state(), drives.safes), (State::Done, safes));
}

#[test]
fn a_blocked_axis_is_a_following_error_with_its_numbers_and_peak() {
    let (mut executor, mut drives) = brought_to(State::Running);
    drives.spoil(|feedback| feedback[0].position_rad = START_RAD[0] as f32);
    let fault = loop {
        if let Some(fault) = executor.tick(&mut drives, &FINE).fault {
            break fault;
        }
    };
    let FaultCause::FollowingError {
        axis: 0,
        error_rad,
        limit_rad,
    } = fault.cause
    else {
        panic!("{fault:?}")
    };
    assert!(error_rad > limit_rad && limit_rad > 0.01, "{fault}");
    assert_eq!(executor.monitor().peak_following_error_rad()[0], error_rad);
    assert_eq!(executor.monitor().peak_following_error_rad()[1], 0.0);
}

/// Axis 0 pushes with τ′ = a (1 − x²)² T₁₅(x) for 1 s: its peaks lie between the places that acceptance looks at.
fn waves(limits: &Limits) -> Trajectory {
    const POINTS: usize = 20;
    let slope = |x: f64| (1.0 - x * x).powi(2) * (15.0 * x.clamp(-1.0, 1.0).acos()).cos();
    let mut nodes = [0.0; POINTS + 1];
    lgr::support_nodes(&mut nodes).unwrap();
    // Simpson's rule in a thousand steps.
    let torque = |x: f64| {
        let (steps, h) = (1_000, (x + 1.0) / 1_000.0);
        let step = |k: i32| {
            let at = -1.0 + h * f64::from(k);
            h / 6.0 * (slope(at) + 4.0 * slope(at + h / 2.0) + slope(at + h))
        };
        (0..steps).map(step).sum::<f64>()
    };
    let rows = nodes.map(|x| [0.0, 0.0, 0.0, 0.0, 100.0 * torque(x), 0.0]);
    let mut builder = TrajectoryBuilder::new(1, limits);
    builder
        .interval(10_000_000, POINTS, rows.as_flattened())
        .unwrap();
    builder.finish().unwrap()
}

#[test]
fn torque_rate_within_the_gap_of_acceptance_is_limited_and_flagged_but_no_fault() {
    let under = |rate_nm_per_s: f32| {
        let axis = AxisLimits {
            torque_rate_nm_per_s: rate_nm_per_s,
            ..common::axis_limits()
        };
        Limits::new(&[axis; AXES]).unwrap()
    };
    let accepted = |rate_nm_per_s: f32| {
        let limits = under(rate_nm_per_s);
        let config = AcceptConfig::default();
        accept::check(&waves(&limits), &limits, &[0.0; AXES], &config).is_ok()
    };
    // The least limit under which it is accepted.
    let (mut refused, mut rate_nm_per_s) = (10.0, 1_000.0);
    for _ in 0..30 {
        let middle = 0.5 * (refused + rate_nm_per_s);
        if accepted(middle) {
            rate_nm_per_s = middle;
        } else {
            refused = middle;
        }
    }
    let limits = under(rate_nm_per_s);
    let trajectory = waves(&limits);

    let mut executor = Executor::<AXES>::new(limits, Config::default()).unwrap();
    let mut drives = Drives::at(&SVector::zeros());
    executor.tick(&mut drives, &FINE);
    executor.load(&trajectory, &SVector::zeros()).unwrap();
    executor.arm().unwrap();
    executor.tick(&mut drives, &FINE);
    executor.start(&executor.start_request()).unwrap();
    let mut previous_nm = 0.0;
    let mut flagged = 0;
    while executor.state() == State::Running {
        let report = executor.tick(&mut drives, &FINE);
        let torque_nm = report.setpoints[0].torque_nm;
        assert!((torque_nm - previous_nm).abs() <= rate_nm_per_s * 250e-6 * 1.000_2);
        previous_nm = torque_nm;
        flagged += u32::from(report.limited[0] == LimitFlags::TORQUE_RATE);
        assert_eq!((report.limited[1], report.fault), (LimitFlags::NONE, None));
    }
    assert!(flagged > 0);
    assert_eq!(executor.state(), State::Done);
    for _ in 0..20 {
        executor.tick(&mut drives, &FINE);
    }
    assert_eq!(
        executor.tick(&mut drives, &FINE).limited,
        &[LimitFlags::NONE; AXES],
        "momentary"
    );
    assert_eq!(
        executor.limited(),
        &[LimitFlags::TORQUE_RATE, LimitFlags::NONE],
        "sticky"
    );

    executor.load(&trajectory, &SVector::zeros()).unwrap();
    executor.tick(&mut drives, &FINE);
    executor.start(&executor.start_request()).unwrap();
    assert_eq!(
        executor.limited(),
        &[LimitFlags::NONE; AXES],
        "until the next start"
    );
}

#[test]
fn impossible_configurations_are_refused() {
    let made = |limits: Limits, config| Executor::<AXES>::new(limits, config).err();
    let three = Limits::new(&[common::axis_limits(); 3]).unwrap();
    assert_eq!(
        made(three, Config::default()),
        Some(ConfigError::Axes {
            limits: 3,
            executor: 2
        })
    );
    let config = Config {
        period_ticks: 0,
        ..Config::default()
    };
    assert_eq!(
        made(limits(), config),
        Some(ConfigError::Value {
            field: ConfigField::PeriodTicks,
            value: 0.0,
            most: 100_000.0
        })
    );
    let mut config = Config::default();
    config.monitor.following_lag_s = f32::NAN;
    assert!(made(limits(), config).is_some());
}

#[test]
fn settings_that_would_blind_a_monitor_are_refused_with_their_bound() {
    type Set = fn(&mut Config, f32);
    let settings: [(ConfigField, Set, f32); 8] = [
        (
            ConfigField::ApproachSpeed,
            |config, value| config.approach_speed_rad_per_s = value,
            1.0,
        ),
        (
            ConfigField::StandstillSpeed,
            |config, value| config.standstill_speed_rad_per_s = value,
            1.0,
        ),
        (
            ConfigField::RampTime,
            |config, value| config.ramp_s = value,
            1.0,
        ),
        (
            ConfigField::StartTolerance,
            |config, value| config.accept.start_tolerance_rad = value,
            0.1,
        ),
        (
            ConfigField::FollowingAtRest,
            |config, value| config.monitor.following_at_rest_rad = value,
            1.0,
        ),
        (
            ConfigField::FollowingLag,
            |config, value| config.monitor.following_lag_s = value,
            0.1,
        ),
        (
            ConfigField::FeedbackAge,
            |config, value| config.monitor.feedback_age_ticks = value as u16,
            20.0,
        ),
        (
            ConfigField::BusyLimit,
            |config, value| config.monitor.busy_limit_ticks = value as u32,
            DRIVE_PERIOD_TICKS as f32,
        ),
    ];
    for (field, set, most) in settings {
        let mut config = Config::default();
        set(&mut config, most);
        assert_eq!(config.check(), Ok(()), "{field}");
        for value in [most + 1.0, 60_000.0] {
            set(&mut config, value);
            let refused = ConfigError::Value { field, value, most };
            assert_eq!(config.check(), Err(refused));
            let words = refused.to_string();
            assert!(
                [field.to_string(), value.to_string(), most.to_string()]
                    .iter()
                    .all(|part| words.contains(part)),
                "{words}"
            );
        }
    }
}

#[test]
fn refusals_and_faults_say_what_to_do() {
    let (mut executor, mut drives) = brought_to(State::Running);
    assert_eq!(
        executor.disarm().unwrap_err().to_string(),
        "Disarm is not possible in state Running, only in [Armed, Done]"
    );
    drives.bus_broken = true;
    let fault = executor.tick(&mut drives, &FINE).fault.unwrap();
    assert_eq!(
        fault.to_string(),
        "the bus to the drives failed: check cabling and supply, then clear (tick 3)"
    );
}
