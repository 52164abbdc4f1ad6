//! The paper's numbers, the laws of mechanics, and the closed loop against the ideal.

use super::ideal::{self, Settings};
use super::modes::{self, distinct_hz};
use super::ode::{Tolerance, integrate};
use super::path::{JointPath as _, RigidPath};
use super::profile::{Law, Profile};
use super::shaper::Shaper;
use super::shortest::Task;
use super::stepper::Stepper;
use super::trajectory::{Feedforward, from_path};
use super::{ClosedLoop, ClosedLoopError, DriveSettings, Metrics, Recording};
use crate::machine::{Equations, Plant};
use crate::movefile::{MachineKind, MoveFile};
use crate::nlp::Pounce;
use stillpoint_firmware::Refusal;

fn file(name: &str) -> MoveFile {
    let path = format!("{}/moves/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    MoveFile::read(path).expect("a move")
}

fn close(found: f64, expected: f64, relative: f64) {
    let off = (found / expected - 1.0).abs();
    assert!(off < relative, "{found} instead of {expected}");
}

/// The quintic of the paper's duration with ideal drives.
fn quintic(file: &MoveFile) -> Recording {
    let profile = Profile::new(Law::Quintic, 0.0508, Shaper::none());
    let path = RigidPath::new(file.machine.plant(), &file.from, &file.to, &profile);
    ideal::simulate(file.machine.plant(), &path, Settings::default()).expect("reachable")
}

#[test]
fn locked_frequencies() {
    let paper = file("paper");
    let plant = paper.machine.plant();
    let found = modes::locked(plant, &plant.rest(&paper.from)).expect("modes");
    assert_eq!(found.len(), 3);
    for (mode, expected_hz) in found.iter().zip([35.48, 35.48, 59.02]) {
        close(mode.frequency_hz, expected_hz, 2e-4);
    }
    assert_eq!(distinct_hz(&found).len(), 2);

    let axis = file("axis");
    let found = modes::locked(axis.machine.plant(), &[0.3, 0.0]).expect("modes");
    let omega = (200.0_f64 / 0.03).sqrt();
    assert_eq!(found.len(), 1);
    close(found[0].frequency_hz, omega / std::f64::consts::TAU, 1e-12);
    let found = modes::free(axis.machine.plant(), &[0.3, 0.0]).expect("modes");
    let omega = (200.0_f64 * (1.0 / 0.02 + 1.0 / 0.03)).sqrt();
    assert!(found[0].frequency_hz < 1e-6);
    close(found[1].frequency_hz, omega / std::f64::consts::TAU, 1e-12);
}

#[test]
fn what_no_motor_acts_on() {
    let paper = file("paper");
    let plant = paper.machine.plant();
    assert_eq!(
        modes::undriven_hz(plant, &plant.rest(&paper.from)),
        Ok(None)
    );
    let mut axis = file("axis");
    assert_eq!(
        modes::undriven_hz(axis.machine.plant(), &[0.3, 0.0]),
        Ok(None)
    );
    let MachineKind::TwoMassAxis(machine) = &mut axis.machine else {
        panic!("the axis has two masses");
    };
    // Without the spring the load drifts.
    machine.stiffness_nm_per_rad = 0.0;
    assert_eq!(
        modes::undriven_hz(axis.machine.plant(), &[0.3, 0.0]),
        Ok(Some(0.0))
    );
}

#[test]
fn quintic_with_ideal_drives_is_the_papers() {
    let paper = file("paper");
    let plant = paper.machine.plant();
    let recording = quintic(&paper);
    let metrics = Metrics::of(plant, &recording);
    close(metrics.peak_strain.expect("gauges"), 576e-6, 0.015);
    close(metrics.residual_strain.expect("gauges"), 228e-6, 0.015);
    close(metrics.elastic_displacement[0].peak, 2.45e-3, 0.015);
    close(metrics.elastic_displacement[1].peak, 0.81e-3, 0.015);
    assert_eq!(metrics.residual(), metrics.residual_strain.expect("gauges"));

    // The motors are where they were told to be.
    let profile = Profile::new(Law::Quintic, 0.0508, Shaper::none());
    let path = RigidPath::new(plant, &paper.from, &paper.to, &profile);
    let mut space = Equations::new(plant);
    for frame in &recording.frames {
        let wanted = path.motion(frame.time_s, &mut space);
        for (found, wanted) in frame.joint_angles_rad.iter().zip(&wanted.angles_rad) {
            assert!((plant.continued(*found, *wanted) - wanted).abs() < 1e-9);
        }
    }
}

/// What each limit forbids is recognised, and the shortest move obeys it.
#[test]
fn speed_and_torque_limit_the_shortest_move() {
    let mut axis = file("axis");
    axis.limits.motor_speed_rpm = 1000.0;
    let found = Task::from(&axis).shortest(Law::Quintic, &Shaper::none(), 0.3);
    let found = found.expect("possible");
    // Top speed of a quintic: 15/8 of the mean.
    let speed_rad_per_s = axis.limits.joint_speed_rad_per_s(20.0);
    close(found.recording.duration_s, 1.875 / speed_rad_per_s, 1e-3);
    assert_eq!(found.active.limit, "speed of axis 1");

    let mut axis = file("axis");
    axis.limits.torque_nm = 1.0;
    let found = Task::from(&axis).shortest(Law::Quintic, &Shaper::none(), 0.3);
    let found = found.expect("possible");
    assert_eq!(found.active.limit, "torque of axis 1");
    let metrics = Metrics::of(axis.machine.plant(), &found.recording);
    close(metrics.torque_nm, 1.0, 2e-3);
}

/// ½ vᵀMv + ½ qᵀKq.
fn energy(plant: &dyn Plant, q: &[f64], v: &[f64]) -> f64 {
    let mut equations = Equations::new(plant);
    plant.equations(q, v, &mut equations);
    let stiffness = plant.stiffness(q);
    let n = q.len();
    (0..n * n)
        .map(|k| (k / n, k % n))
        .map(|(i, j)| {
            let elastic = q[i] * stiffness[(i, j)] * q[j];
            0.5 * (v[i] * equations.mass_matrix[i * n + j] * v[j] + elastic)
        })
        .sum()
}

/// The work of the motors becomes kinetic and elastic energy, to the last digits.
#[test]
fn energy_balance() {
    for name in ["paper", "axis"] {
        let file = file(name);
        let plant = file.machine.plant();
        let (n, axes) = (plant.coordinate_count(), plant.axis_count());
        let torques = |t: f64| -> Vec<f64> {
            (0..axes)
                .map(|i| 10.0 * (90.0 * t + i as f64).sin())
                .collect()
        };
        let f = |t: f64, x: &[f64], slope: &mut [f64]| {
            let (q, v) = (&x[..n], &x[n..2 * n]);
            let torques = torques(t);
            let forward = plant.forward(q, v, &torques)?;
            slope[..n].copy_from_slice(v);
            slope[n..2 * n].copy_from_slice(forward.accelerations.as_slice());
            let rates = plant.joint_rates(q, v);
            slope[2 * n] = rates.iter().zip(&torques).map(|(r, t)| r * t).sum();
            Some(())
        };
        let mut start = plant.rest(&file.from);
        start.resize(2 * n + 1, 0.0);
        let tolerance = Tolerance {
            relative: 1e-12,
            scale: vec![1.0; 2 * n + 1],
        };
        let times: Vec<f64> = (0..=40).map(|k| f64::from(k) * 1e-3).collect();
        let samples = integrate(f, (0.0, 0.04), &start, &tolerance, &times).expect("smooth");
        let rest = energy(plant, &start[..n], &start[n..2 * n]);
        let mut largest = 0.0_f64;
        for x in &samples.states {
            let held = energy(plant, &x[..n], &x[n..2 * n]) - rest;
            largest = largest.max(held);
            assert!((held - x[2 * n]).abs() < 1e-9 * largest.max(1e-3), "{name}");
        }
        assert!(largest > 0.05, "{name}: {largest}");
    }
}

/// The fixed steps between two torques against the adaptive method.
#[test]
fn fixed_steps_are_exact_enough() {
    let paper = file("paper");
    let plant = paper.machine.plant();
    let n = plant.coordinate_count();
    let mut start = plant.rest(&paper.from);
    start.resize(2 * n, 0.0);
    let torques = [30.0, -20.0, 25.0];
    let mut state = start.clone();
    let mut stepper = Stepper::new(plant, &start[..n]).expect("regular");
    stepper.advance(&mut state, &torques, 0.02).expect("whole");
    let f = |_: f64, x: &[f64], slope: &mut [f64]| {
        let forward = plant.forward(&x[..n], &x[n..], &torques)?;
        slope[..n].copy_from_slice(&x[n..]);
        slope[n..].copy_from_slice(forward.accelerations.as_slice());
        Some(())
    };
    let tolerance = Tolerance {
        relative: 1e-12,
        scale: vec![1.0; 2 * n],
    };
    let exact = integrate(f, (0.0, 0.02), &start, &tolerance, &[]).expect("smooth");
    let (found, exact) = (
        plant.output_values(&state[..n]),
        plant.output_values(&exact.end[..n]),
    );
    for (found, exact) in found.iter().zip(&exact).skip(3) {
        close(*found, *exact, 1e-5);
    }
}

/// Plays a rigid path through the executor.
fn played(
    file: &MoveFile,
    drives: &DriveSettings,
    duration_s: f64,
    feedforward: Feedforward,
) -> Result<Recording, ClosedLoopError> {
    let plant = file.machine.plant();
    let profile = Profile::new(Law::Quintic, duration_s, Shaper::none());
    let path = RigidPath::new(plant, &file.from, &file.to, &profile);
    let trajectory = from_path(7, plant, &file.limits, &path, feedforward).expect("fits");
    let machine = drives.real_machine(&file.machine);
    let mut closed_loop = ClosedLoop::new(machine.plant(), &file.limits, &file.from, drives);
    closed_loop.executor.accept.torque_free_ends = feedforward == Feedforward::Rigid;
    closed_loop.play(&trajectory)
}

/// With the torque of ideal drives fed forward, the closed loop is the ideal, one tick later.
#[test]
fn closed_loop_with_the_right_torque_is_ideal() {
    let paper = file("paper");
    let expected = quintic(&paper);
    let drives = DriveSettings::default();
    let found = played(&paper, &drives, 0.0508, Feedforward::Ideal).expect("plays");
    let strain = |frame: &super::Frame| frame.outputs[3];
    let mut off = 0.0_f64;
    for frame in found.frames.iter().filter(|f| f.time_s < 0.05) {
        // The ideal recording has samples at 0.1 ms.
        let time_s = frame.time_s - 2.5e-4;
        if let Some(same) = expected
            .frames
            .iter()
            .find(|f| (f.time_s - time_s).abs() < 1e-9)
        {
            off = off.max((strain(frame) - strain(same)).abs());
        }
    }
    assert!(off < 0.005 * 576e-6, "{off}");
    assert!(
        found
            .commands
            .iter()
            .all(|c| c.limited.iter().all(|l| l.is_empty()))
    );
    assert_eq!(found.commands.len(), found.frames.len());
}

/// Without knowledge of elasticity the drives give way a little, which damps the ringing.
#[test]
fn closed_loop_with_rigid_feedforward_is_near_the_ideal() {
    let paper = file("paper");
    let drives = DriveSettings::default();
    let found = played(&paper, &drives, 0.0508, Feedforward::Rigid).expect("plays");
    let metrics = Metrics::of(paper.machine.plant(), &found);
    close(metrics.peak_strain.expect("gauges"), 576e-6, 0.05);
    let residual = metrics.residual();
    assert!((100e-6..228e-6).contains(&residual), "{residual}");
}

/// The claim of the whole project: planned, written in f32, played by the executor, and still.
#[test]
fn the_optimal_move_ends_still() {
    let paper = file("paper");
    let plan = crate::plan::plan(&paper, &Pounce, Box::new(|_, _| true)).expect("solved");
    let plant = paper.machine.plant();
    let closed_loop = ClosedLoop::new(plant, &paper.limits, &paper.from, &paper.drive);
    let recording = closed_loop.play(&plan.trajectory).expect("plays");
    let metrics = Metrics::of(plant, &recording);
    // The paper's own figure is 20 µε; more than 5 would be a sign that something is lost on the way.
    assert!(metrics.residual() < 5e-6, "{}", metrics.residual());
    assert!(metrics.peak_strain.expect("gauges") > 300e-6);
}

#[test]
fn what_the_plan_does_not_know_shows() {
    let axis = file("axis");
    let run = |drives: DriveSettings| {
        let recording = played(&axis, &drives, 0.25, Feedforward::Rigid).expect("plays");
        let last = recording.frames.last().map_or(0.0, |f| f.outputs[0].abs());
        let metrics = Metrics::of(drives.real_machine(&axis.machine).plant(), &recording);
        (metrics, last)
    };
    let plain = DriveSettings::default();
    let (exact, _) = run(plain);
    let heavier = DriveSettings {
        payload_factor: 1.5,
        ..plain
    };
    let twist = |m: &Metrics| m.elastic_displacement[0].peak;
    close(twist(&run(heavier).0), 1.5 * twist(&exact), 0.2);
    let damped = DriveSettings {
        elastic_damping_ratio: 0.2,
        ..plain
    };
    let (damped, left) = run(damped);
    assert!(left < 0.1 * damped.residual(), "{left}");
    let coarse = DriveSettings {
        encoder_resolution_rad: Some(1e-3),
        ..plain
    };
    assert!(run(coarse).0.torque_rate_nm_per_s > 2.0 * exact.torque_rate_nm_per_s);
    let late = DriveSettings {
        delay_s: 1e-3,
        ..plain
    };
    let (late, _) = run(late);
    assert!((late.torque_nm / exact.torque_nm - 1.0).abs() > 1e-3);
    close(twist(&late), twist(&exact), 0.1);
}

#[test]
fn the_executor_guards_the_simulation() {
    let paper = file("paper");
    let drives = DriveSettings::default();
    let plant = paper.machine.plant();
    let profile = Profile::new(Law::Quintic, 0.0508, Shaper::none());
    let path = RigidPath::new(plant, &paper.from, &paper.to, &profile);
    let rigid = from_path(7, plant, &paper.limits, &path, Feedforward::Rigid).expect("fits");
    let elsewhere = ClosedLoop::new(plant, &paper.limits, &paper.to, &drives);
    assert!(matches!(
        elsewhere.play(&rigid),
        Err(ClosedLoopError::Refused(Refusal::Rejected(_)))
    ));
    let axis = file("axis");
    let other = ClosedLoop::new(axis.machine.plant(), &axis.limits, &axis.from, &drives);
    assert!(matches!(
        other.play(&rigid),
        Err(ClosedLoopError::Axes {
            trajectory: 3,
            machine: 1
        })
    ));
    // A position loop too slow for the move, without help from the velocity loop.
    let slow = DriveSettings {
        position_bandwidth_hz: 0.1,
        velocity_bandwidth_hz: 0.1,
        payload_factor: 3.0,
        ..drives
    };
    let fault = played(&paper, &slow, 0.0508, Feedforward::Rigid);
    assert!(
        matches!(fault, Err(ClosedLoopError::Fault { .. })),
        "{fault:?}"
    );
}

#[test]
fn impossible_drives_name_their_key() {
    let text = |drive: &str| {
        let path = format!("{}/moves/axis.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("readable") + drive;
        MoveFile::parse(&text, "axis.toml")
    };
    let file = text("[drive]\nposition_bandwidth_hz = 30.0\nencoder_resolution_rad = 1e-6\n");
    let drive = file.expect("possible").drive;
    assert_eq!(drive.position_bandwidth_hz, 30.0);
    assert_eq!(drive.encoder_resolution_rad, Some(1e-6));
    assert_eq!(drive.velocity_bandwidth_hz, 200.0);
    for key in [
        "position_bandwidth_hz",
        "velocity_bandwidth_hz",
        "loop_rate_hz",
        "encoder_resolution_rad",
        "delay_s",
        "payload_factor",
        "elastic_damping_ratio",
    ] {
        let message = text(&format!("[drive]\n{key} = -1.0\n"))
            .expect_err(key)
            .to_string();
        assert!(message.contains(key) && message.contains("-1"), "{message}");
    }
}
