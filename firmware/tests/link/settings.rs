//! Limits, configuration and drives: changed, and kept over a restart.

use crate::common::{axis_limits, limits, trajectory};
use crate::requests::{denied, drive, set_drives};
use crate::rig::{Rig, framed};
use stillpoint_firmware::{Config, ConfigError, Refusal, State};
use stillpoint_shared::assembly::Outline;
use stillpoint_shared::drive_config::{BusConfig, DriveConfig, DriveConfigError};
use stillpoint_shared::protocol::{Denial, Request, Response};
use stillpoint_shared::{AxisLimits, LimitName, Limits, LimitsError};

#[test]
fn limits_are_changed_and_kept() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(limits()));
    let other = AxisLimits {
        torque_nm: 70.0,
        ..axis_limits()
    };
    let set = |axes: &[AxisLimits]| Request::SetLimits(axes.iter().copied().collect());
    let impossible = AxisLimits {
        speed_rad_per_s: -1.0,
        ..other
    };
    assert_eq!(
        rig.ask(&set(&[other, impossible])),
        Response::Denied(Denial::Limits(LimitsError::Value {
            axis: 1,
            name: LimitName::Speed,
            value: -1.0
        }))
    );
    assert_eq!(
        rig.ask(&set(&[other; 3])),
        denied(Refusal::Configuration(ConfigError::Axes {
            limits: 3,
            executor: 2
        }))
    );
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    assert!(matches!(
        rig.ask(&set(&[other; 2])),
        Response::Denied(Denial::Executor(Refusal::WrongState { .. }))
    ));
    rig.tick(5);
    rig.done(&Request::Disarm);
    assert_eq!(rig.store.limits(), None, "a refused one is not kept");
    rig.done(&set(&[other; 2]));
    let new = Limits::new(&[other; 2]).unwrap();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(new.clone()));
    assert_eq!(rig.state(), State::Idle, "what was loaded is forgotten");

    let mut rig = rig.restarted();
    rig.link.restore(&mut *rig.machine, &rig.store).unwrap();
    assert_eq!(rig.ask(&Request::GetLimits), Response::Limits(new));
}

#[test]
fn a_board_without_limits_takes_them() {
    let mut rig = Rig::silent();
    *rig.machine = stillpoint_firmware::Machine::unconfigured();
    assert_eq!(
        rig.link.restore(&mut *rig.machine, &rig.store),
        Err(Refusal::NotConfigured)
    );
    rig.tick(1);
    rig.hello(1);
    for request in [
        Request::GetLimits,
        Request::GetConfig,
        Request::SetConfig(Config::default()),
        Request::UploadBegin(Outline::of(&trajectory())),
    ] {
        assert_eq!(rig.ask(&request), denied(Refusal::NotConfigured));
    }
    let axes = limits().axes().iter().copied().collect();
    rig.done(&Request::SetLimits(axes));
    assert_eq!(
        rig.ask(&Request::GetConfig),
        Response::Config(Config::default())
    );
    assert_eq!(rig.upload(&trajectory()), Response::Done);
}

#[test]
fn the_configuration_is_changed_and_kept() {
    let mut rig = Rig::new();
    let mut config = Config::default();
    config.monitor.following_at_rest_rad = 0.02;
    rig.done(&Request::SetConfig(config));
    assert_eq!(rig.ask(&Request::GetConfig), Response::Config(config));
    let mut wrong = config;
    wrong.ramp_s = 0.0;
    assert!(matches!(
        rig.ask(&Request::SetConfig(wrong)),
        Response::Denied(Denial::Executor(Refusal::Configuration(
            ConfigError::Value { .. }
        )))
    ));
    let mut wrong = config;
    wrong.period_ticks = 10_000;
    assert_eq!(
        rig.ask(&Request::SetConfig(wrong)),
        denied(Refusal::Configuration(ConfigError::Period {
            given_ticks: 10_000,
            board_ticks: 2_500
        }))
    );
    let axes = limits().axes().iter().copied().collect();
    rig.done(&Request::SetLimits(axes));
    let mut rig = rig.restarted();
    rig.link.restore(&mut *rig.machine, &rig.store).unwrap();
    assert_eq!(rig.ask(&Request::GetConfig), Response::Config(config));
}

#[test]
fn drives_are_configured_and_kept() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask(&Request::GetDrives), Response::Drives(None));
    rig.done(&set_drives(&[drive(1), drive(2)]));
    let kept = DriveConfig::new(BusConfig::default(), &[drive(1), drive(2)]).unwrap();
    let kept = Response::Drives(Some(kept));
    let mut rig = rig.restarted();
    assert_eq!(rig.ask(&Request::GetDrives), kept);

    let one = rig.ask(&set_drives(&[drive(1)]));
    assert_eq!(
        one,
        Response::Denied(Denial::DriveAxes { given: 1, board: 2 })
    );
    let same = rig.ask(&set_drives(&[drive(1), drive(1)]));
    assert_eq!(
        same,
        Response::Denied(Denial::Drives(DriveConfigError::NodeTwice {
            axis: 0,
            bus: 0,
            node: 1
        }))
    );
    // Possible as such, but no multiple of the board's tick of 250 µs.
    let bus = BusConfig {
        period_us: 2_100,
        ..BusConfig::default()
    };
    let axes = [drive(1), drive(2)].into_iter().collect();
    assert!(matches!(
        rig.ask(&Request::SetDrives { bus, axes }),
        Response::Denied(Denial::Drives(DriveConfigError::NotTicks { .. }))
    ));
    rig.upload(&trajectory());
    rig.done(&Request::Arm);
    assert!(matches!(
        rig.ask(&set_drives(&[drive(3), drive(4)])),
        Response::Denied(Denial::Executor(Refusal::WrongState { .. }))
    ));
    assert_eq!(rig.ask(&Request::GetDrives), kept);
}

#[test]
fn other_drives_ask_for_a_start_of_the_board_once_the_answer_is_sent() {
    let mut rig = Rig::new();
    let set = |rig: &mut Rig, nodes: [u8; 2]| {
        let response = rig.ask(&set_drives(&nodes.map(drive)));
        (response, rig.link.wants_start())
    };
    let (refused, wants) = set(&mut rig, [1, 1]);
    assert!(matches!(refused, Response::Denied(_)) && !wants);
    assert_eq!(set(&mut rig, [1, 2]), (Response::Done, true));
    let mut rig = rig.restarted();
    assert!(!rig.link.wants_start());
    assert_eq!(set(&mut rig, [1, 2]), (Response::Done, false), "the same");

    rig.sequence += 1;
    let other = set_drives(&[drive(1), drive(3)]);
    rig.receive(&framed(rig.envelope(), &other));
    while rig.poll() {}
    assert!(!rig.link.wants_start(), "the answer is still to be sent");
    assert_eq!(rig.messages().len(), 1);
    assert!(rig.link.wants_start());
    let starting = (Response::Denied(Denial::Starting), true);
    assert_eq!(set(&mut rig, [1, 3]), starting, "too late");
    assert_eq!(rig.ask(&Request::Arm), starting.0);
    assert!(matches!(rig.ask(&Request::Status), Response::Status(_)));
}
