//! Hold and override: the path is the planned one, torque and torque rate stay inside their limits
//! at every tick, the end is reached exactly, whatever is asked for and whenever.

mod moves;

use moves::{AXES, Rigid, any_rigid, axis_limits, limits, paper};
use nalgebra::SVector;
use proptest::prelude::*;
use stillpoint_firmware::path_time::{FULL_SPEED, speed_ratio};
use stillpoint_firmware::{Config, Executor, IdealDrives, LimitFlags, Setpoint, State, TickInputs};
use stillpoint_shared::config::AcceptConfig;
use stillpoint_shared::{LIMIT_TOLERANCE, Player, Sample, Trajectory, TrajectoryBuilder};

const PERIOD_S: f32 = 250e-6;

/// Something asked for at a tick.
#[derive(Debug, Clone, Copy)]
enum Wish {
    Hold,
    Resume,
    Override(u8),
}

/// An executor that plays, on ideal drives.
struct Play {
    executor: Executor<AXES>,
    drives: IdealDrives<AXES>,
    player: Player<AXES>,
    previous: Option<([Setpoint; AXES], u32)>,
    sent: Vec<[Setpoint; AXES]>,
    flagged: u32,
    ticks: u32,
}

impl Play {
    fn new(trajectory: &Trajectory) -> Self {
        let config = Config {
            accept: AcceptConfig {
                torque_free_ends: false,
                ..AcceptConfig::default()
            },
            ..Config::default()
        };
        let first = Sample::<AXES>::first(trajectory).unwrap().position_rad;
        let first = SVector::from(first);
        let mut executor = Executor::new(limits(), config).unwrap();
        let mut drives = IdealDrives::at(&first);
        executor.tick(&mut drives, &TickInputs::default());
        executor.load(trajectory, &first).unwrap();
        executor.arm().unwrap();
        executor.tick(&mut drives, &TickInputs::default());
        // The load's torque comes by the torque rate.
        for _ in 0..20 {
            executor.tick(&mut drives, &TickInputs::default());
        }
        executor.start(&executor.start_request()).unwrap();
        Self {
            executor,
            drives,
            player: Player::new(trajectory).unwrap(),
            previous: None,
            sent: Vec::new(),
            flagged: 0,
            ticks: 0,
        }
    }

    fn ask(&mut self, wish: Wish) {
        // Where it is out of place, it is refused.
        let _ = match wish {
            Wish::Hold => self.executor.hold(),
            Wish::Resume => self.executor.resume(),
            Wish::Override(percent) => self.executor.set_override(percent),
        };
    }

    /// One tick, with everything that has to hold in every one.
    fn tick(&mut self) -> State {
        self.ticks += 1;
        let report = self.executor.tick(&mut self.drives, &TickInputs::default());
        assert_eq!(report.fault, None);
        let (setpoints, path_ticks) = (*report.setpoints, report.path_ticks);
        let limited = report
            .limited
            .iter()
            .any(|flags| *flags != LimitFlags::NONE);
        self.flagged += u32::from(limited);
        let planned = self.player.sample(path_ticks).unwrap();
        let speed = speed_ratio(report.path_speed);
        for (axis, setpoint) in setpoints.iter().enumerate() {
            assert_eq!(
                setpoint.position_rad, planned.position_rad[axis],
                "on the path"
            );
            let state = report.state;
            if state != State::Done {
                assert_eq!(
                    setpoint.velocity_rad_per_s,
                    planned.velocity_rad_per_s[axis] * speed
                );
            }
            let limits = axis_limits();
            let available = limits.available_torque_nm(setpoint.velocity_rad_per_s)
                * (1.0 + 3.0 * LIMIT_TOLERANCE);
            assert!(setpoint.torque_nm.abs() <= available, "{setpoint:?}");
        }
        if let Some((previous, previous_ticks)) = self.previous {
            assert!(path_ticks >= previous_ticks, "never back");
            assert!(path_ticks - previous_ticks <= 2_500, "never faster");
            for (setpoint, previous) in setpoints.iter().zip(&previous) {
                let step = (setpoint.torque_nm - previous.torque_nm).abs();
                let most = axis_limits().torque_rate_nm_per_s * PERIOD_S;
                assert!(step <= most * (1.0 + 2.0 * LIMIT_TOLERANCE), "{step}");
            }
        }
        self.sent.push(setpoints);
        self.previous = Some((setpoints, path_ticks));
        report.state
    }

    fn run_for(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Asks for everything in turn and goes on to the end.
    fn run(&mut self, wishes: &[(u32, Wish)]) {
        let mut wishes = wishes.iter().peekable();
        while self.executor.state() != State::Done {
            while let Some((_, wish)) = wishes.next_if(|(tick, _)| *tick <= self.ticks) {
                self.ask(*wish);
            }
            let state = self.tick();
            if wishes.peek().is_none() && state != State::Done {
                // Whatever was asked for, in the end go on to the end.
                self.ask(Wish::Resume);
                if self.executor.override_percent() < 10 {
                    self.ask(Wish::Override(10));
                }
            }
            assert!(self.ticks < 60_000, "it comes to an end");
        }
        let last = Sample::<AXES>::last(self.player.trajectory()).unwrap();
        let report = self.executor.report();
        for (axis, setpoint) in report.setpoints.iter().enumerate() {
            let bits = [
                setpoint.position_rad,
                setpoint.velocity_rad_per_s,
                setpoint.torque_nm,
            ]
            .map(f32::to_bits);
            let planned = [
                last.position_rad[axis],
                last.velocity_rad_per_s[axis],
                last.torque_nm[axis],
            ]
            .map(f32::to_bits);
            assert_eq!(bits, planned, "the last node, to the bit");
        }
    }
}

fn any_wish() -> impl Strategy<Value = Wish> {
    prop_oneof![
        2 => Just(Wish::Hold),
        3 => Just(Wish::Resume),
        2 => Just(Wish::Override(100)),
        2 => (0u8..=100).prop_map(Wish::Override),
    ]
}

/// Up to ten wishes, 0 to 60 ticks apart.
fn any_wishes() -> impl Strategy<Value = Vec<(u32, Wish)>> {
    prop::collection::vec((0u32..60, any_wish()), 0..10).prop_map(|wishes| {
        let mut tick = 0;
        wishes
            .into_iter()
            .map(|(pause, wish)| {
                tick += pause;
                (tick, wish)
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// The paper's move uses nearly all of the torque rate nearly all of the time. So does it here,
    /// slowed down until that is so between the nodes, too.
    #[test]
    fn the_papers_move_is_never_limited_whatever_is_asked_for(wishes in any_wishes()) {
        let mut play = Play::new(&paper(1.2));
        play.run(&wishes);
        prop_assert_eq!(play.flagged, 0);
    }

    /// Three coupled axes have windows with nothing in common now and then (1 random move in 2,000)
    /// when they leave full speed with all of their torque rate in use; then the limiter acts.
    #[test]
    fn random_moves_keep_their_limits_whatever_is_asked_for(
        rigid in any_rigid(),
        wishes in any_wishes(),
    ) {
        let mut play = Play::new(&rigid.trajectory());
        play.run(&wishes);
        if rigid.share < 0.85 {
            prop_assert_eq!(play.flagged, 0);
        }
    }

    /// For a rigid axis the torque set-points are what the motion takes: their impulse since the
    /// start is the momentum of the velocity set-points, but for half a tick of lag.
    #[test]
    fn torque_set_points_are_what_the_motion_takes(
        rigid in any_rigid(),
        wishes in any_wishes(),
    ) {
        let rigid = Rigid {
            coupling: 0.0,
            other: 0.0,
            load: [[0.0; 2]; AXES],
            share: 0.8,
            ..rigid
        };
        let mut play = Play::new(&rigid.trajectory());
        play.run(&wishes);
        for axis in 0..AXES {
            let (mut impulse, mut before_nm) = (0.0, 0.0);
            let most = play.sent.iter().map(|sent| sent[axis].velocity_rad_per_s.abs());
            let most = rigid.inertia[axis] * f64::from(most.fold(0.0, f32::max));
            for sent in &play.sent {
                let torque_nm = f64::from(sent[axis].torque_nm);
                impulse += 0.5 * (before_nm + torque_nm) * f64::from(PERIOD_S);
                before_nm = torque_nm;
                let momentum = rigid.inertia[axis] * f64::from(sent[axis].velocity_rad_per_s);
                prop_assert!((impulse - momentum).abs() < 0.06 * most + 1e-6, "{impulse} {momentum}");
            }
        }
    }
}

#[test]
fn a_hold_acts_at_the_next_tick_and_is_held_in_30_ms() {
    for at in (8..200).step_by(8) {
        let mut play = Play::new(&paper(1.2));
        for _ in 0..at {
            play.tick();
        }
        assert_eq!(play.executor.report().path_speed, FULL_SPEED);
        play.ask(Wish::Hold);
        assert_eq!(play.executor.state(), State::Holding);
        play.tick();
        assert!(
            play.executor.report().path_speed < FULL_SPEED,
            "at tick {at}"
        );
        let mut ticks = 1;
        while play.tick() == State::Holding {
            ticks += 1;
        }
        assert!(ticks <= 120, "{ticks} ticks from tick {at}");
        if play.executor.state() == State::Held {
            let (held, path) = (
                *play.executor.report().setpoints,
                play.executor.path_ticks(),
            );
            for _ in 0..100 {
                assert_eq!(play.tick(), State::Held);
                assert_eq!(play.executor.path_ticks(), path);
                let setpoints = *play.executor.report().setpoints;
                assert_eq!(setpoints, held);
                for setpoint in setpoints {
                    assert_eq!(
                        (setpoint.velocity_rad_per_s, setpoint.torque_nm),
                        (0.0, 0.0)
                    );
                }
            }
        }
        play.run(&[]);
        assert_eq!(play.flagged, 0);
    }
}

#[test]
fn an_override_of_none_stops_and_stays_running() {
    let mut play = Play::new(&paper(1.2));
    play.run_for(60);
    play.ask(Wish::Override(0));
    play.run_for(200);
    let report = play.executor.report();
    assert_eq!((report.state, report.path_speed), (State::Running, 0));
    let stands_at = report.path_ticks;
    play.run_for(10);
    assert_eq!(play.executor.report().path_ticks, stands_at);

    play.ask(Wish::Override(30));
    play.run_for(200);
    assert!((speed_ratio(play.executor.report().path_speed) - 0.3).abs() < 1e-6);
    play.ask(Wish::Override(100));
    play.run(&[]);
    assert_eq!(play.flagged, 0);
    // It holds for the next move, too.
    play.executor.set_override(20).unwrap();
    assert_eq!(play.executor.override_percent(), 20);
}

#[test]
fn an_override_while_held_waits_for_resume() {
    let mut play = Play::new(&paper(1.2));
    play.run_for(60);
    play.ask(Wish::Hold);
    play.run_for(150);
    assert_eq!(play.executor.state(), State::Held);
    play.ask(Wish::Override(40));
    play.run_for(20);
    assert_eq!(play.executor.report().path_speed, 0);
    play.ask(Wish::Resume);
    play.run_for(1);
    assert!(play.executor.report().path_speed > 0, "at the next tick");
    play.run_for(150);
    assert!((speed_ratio(play.executor.report().path_speed) - 0.4).abs() < 1e-6);
}

#[test]
fn a_held_axis_carries_its_load() {
    let rigid = Rigid {
        reach: [0.8, -0.5, 0.3],
        waves: [1.0, 0.5, 2.0],
        phase: [0.0, 1.0, 2.0],
        inertia: [0.1, 0.2, 0.15],
        coupling: 0.1,
        load: [[12.0, 18.0], [-15.0, -5.0], [0.0, 8.0]],
        other: 0.0,
        share: 0.8,
    };
    let trajectory = rigid.trajectory();
    let mut play = Play::new(&trajectory);
    play.run_for(60);
    play.ask(Wish::Hold);
    while play.tick() != State::Held {}
    let share = f64::from(play.executor.path_ticks()) / f64::from(trajectory.duration_ticks());
    assert!((0.1..0.9).contains(&share));
    for (setpoint, [start, end]) in play.executor.report().setpoints.iter().zip(rigid.load) {
        let load = start + (end - start) * share;
        assert!(
            (f64::from(setpoint.torque_nm) - load).abs() < 0.01,
            "{setpoint:?} {load}"
        );
    }
    play.run(&[]);
}

#[test]
fn a_trajectory_without_torques_is_held_within_the_ramp_time() {
    let planned = paper(2.0);
    let mut builder = TrajectoryBuilder::new(3, &limits());
    for interval in planned.intervals() {
        let without = |(place, &value): (usize, &f32)| {
            let torque = place / AXES % 3 == 2;
            if torque { 0.0 } else { f64::from(value) }
        };
        let values: Vec<f64> = interval
            .coefficients
            .iter()
            .enumerate()
            .map(without)
            .collect();
        builder
            .interval(interval.duration_ticks, interval.points, &values)
            .unwrap();
    }
    let mut play = Play::new(&builder.finish().unwrap());
    assert!(
        play.executor
            .pace()
            .axes
            .iter()
            .all(|axis| axis.inertia_kg_m2 == 0.0)
    );
    play.run_for(100);
    play.ask(Wish::Hold);
    let before = play.ticks;
    while play.tick() != State::Held {}
    let took = play.ticks - before;
    assert!((80..160).contains(&took), "{took} ticks for 20 ms of ramp");
    play.run(&[]);
}
