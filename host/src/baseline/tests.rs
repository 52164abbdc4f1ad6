//! The paper's numbers, and every baseline as the board gets it.

use super::{Baseline, BaselineError, BaselinePlan, plan_baseline};
use crate::machine::{Equations, Plant};
use crate::movefile::MoveFile;
use crate::simulate::Metrics;
use crate::simulate::path::{JointPath as _, RigidPath};
use crate::simulate::shortest::{Shortest, Task};
use crate::sptfile::SptFile;
use crate::study::play;
use stillpoint_shared::trajectory::{MAX_COEFFICIENTS, MAX_ENCODED_BYTES, MAX_INTERVALS};
use stillpoint_shared::{Sample, Schedule, Trajectory, time};

fn file(name: &str) -> MoveFile {
    let path = format!("{}/moves/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    MoveFile::read(path).expect("a move")
}

fn close(found: f64, expected: f64, relative: f64) {
    let off = (found / expected - 1.0).abs();
    assert!(off < relative, "{found} instead of {expected}");
}

fn shortest(file: &MoveFile, name: &str) -> Shortest {
    let baseline = Baseline::named(name).expect(name);
    baseline.shortest(&Task::from(file)).expect("possible")
}

fn residual(file: &MoveFile, shortest: &Shortest) -> f64 {
    Metrics::of(file.machine.plant(), &shortest.recording).residual()
}

#[test]
fn shortest_moves_are_the_papers() {
    let paper = file("paper");
    // Residuals change by several per cent within 1 % of duration.
    let expected = [
        ("quintic", 99.5e-3, 52e-6),
        ("quintic+zv", 77.3e-3, 34e-6),
        ("quintic+zv2", 83.5e-3, 22e-6),
        ("quintic+zvd", 83.3e-3, 17e-6),
    ];
    for (name, expected_s, left) in expected {
        let found = shortest(&paper, name);
        close(found.recording.duration_s, expected_s, 0.015);
        assert_eq!(found.active.limit, "elastic_displacement_y_m");
        assert!(found.active.ratio > 1.0);
        close(residual(&paper, &found), left, 0.05);
    }
}

#[test]
fn an_axis_has_shortest_moves_too() {
    let axis = file("axis");
    let known = Baseline::all_for(&Task::from(&axis)).expect("regular");
    assert_eq!(known.len(), 8, "there is one mode");
    assert!(residual(&axis, &shortest(&axis, "quintic")) > 1e-2);
    for name in ["quintic+zv", "quintic+zvd", "s-curve+zv", "s-curve+zvd"] {
        // A linear machine: the shaper cancels its one mode.
        assert!(residual(&axis, &shortest(&axis, name)) < 1e-5);
    }
    let two = Baseline::named("quintic+zvd2").expect("known");
    let refused = plan_baseline(&axis, two);
    assert!(matches!(
        refused,
        Err(BaselineError::TooFewModes {
            wanted: 2,
            found: 1,
            ..
        })
    ));
}

/// Evaluates what the board is sent, as the board does.
fn samples<const AXES: usize>(
    trajectory: &Trajectory,
) -> impl Iterator<Item = (f64, Sample<AXES>)> {
    let mut schedule = Schedule::empty();
    schedule.prepare(trajectory).expect("fits");
    let ticks = (0..=trajectory.duration_ticks()).step_by(3_331);
    ticks.map(move |ticks| {
        let sample = schedule.sample(trajectory, ticks).expect("not empty");
        (time::seconds(ticks), sample)
    })
}

/// Largest error of positions and velocities, as shares of the largest of each.
fn errors<const AXES: usize>(file: &MoveFile, plan: &BaselinePlan) -> [f64; 2] {
    let plant = file.machine.plant();
    let path = RigidPath::new(plant, &file.from, &file.to, &plan.profile);
    let mut space = Equations::new(plant);
    let (mut off, mut largest) = ([0.0_f64; 2], [0.0_f64; 2]);
    for (time_s, sample) in samples::<AXES>(&plan.trajectory) {
        let wanted = path.motion(time_s, &mut space);
        for axis in 0..AXES {
            let position_rad = f64::from(sample.position_rad[axis]);
            let angle_rad = plant.continued(wanted.angles_rad[axis], position_rad);
            let pairs = [
                (position_rad, angle_rad),
                (
                    f64::from(sample.velocity_rad_per_s[axis]),
                    wanted.rates_rad_per_s[axis],
                ),
            ];
            for (k, (found, wanted)) in pairs.into_iter().enumerate() {
                off[k] = off[k].max((found - wanted).abs());
                largest[k] = largest[k].max(wanted.abs());
            }
        }
    }
    [0, 1].map(|k| off[k] / largest[k])
}

/// Largest difference between the motors' power and the growth of the rigid machine's energy, as a share of the largest
/// power.
fn power_error<const AXES: usize>(file: &MoveFile, plan: &BaselinePlan) -> f64 {
    let plant = file.machine.plant();
    let path = RigidPath::new(plant, &file.from, &file.to, &plan.profile);
    let energy_j = |time_s: f64| {
        let (q, v, _) = path.rigid_motion(time_s);
        kinetic_j(plant, &q, &v)
    };
    let (h, breaks_s) = (1e-6, plan.profile.breaks_s());
    let (mut off, mut largest) = (0.0_f64, 0.0_f64);
    for (time_s, sample) in samples::<AXES>(&plan.trajectory) {
        // Across a break the difference is none of one polynomial.
        if breaks_s.iter().any(|at| (at - time_s).abs() < 2.0 * h) {
            continue;
        }
        let power_w: f64 = (0..AXES)
            .map(|i| f64::from(sample.torque_nm[i]) * f64::from(sample.velocity_rad_per_s[i]))
            .sum();
        let growth_w = (energy_j(time_s + h) - energy_j(time_s - h)) / (2.0 * h);
        off = off.max((power_w - growth_w).abs());
        largest = largest.max(growth_w.abs());
    }
    off / largest
}

fn kinetic_j(plant: &dyn Plant, q: &[f64], v: &[f64]) -> f64 {
    let n = q.len();
    let mut equations = Equations::new(plant);
    plant.equations(q, v, &mut equations);
    let rows = equations.mass_matrix.chunks_exact(n).zip(v);
    rows.map(|(row, v_i)| 0.5 * v_i * row.iter().zip(v).map(|(m, v_j)| m * v_j).sum::<f64>())
        .sum()
}

/// What every baseline has to be: small enough, certified, accepted and played by the executor without its limiter, and the
/// profile itself.
fn check<const AXES: usize>(file: &MoveFile) {
    let baselines = Baseline::all_for(&Task::from(file)).expect("regular");
    for baseline in baselines {
        let name = baseline.name();
        let plan = plan_baseline(file, baseline).expect(name);
        let trajectory = &plan.trajectory;
        assert!(trajectory.intervals().count() <= MAX_INTERVALS);
        assert!(trajectory.coefficients().len() <= MAX_COEFFICIENTS);
        let duration_s = time::seconds(trajectory.duration_ticks());
        assert!((duration_s - plan.profile.duration_s()).abs() < 1e-9);

        let mut buffer = vec![0; MAX_ENCODED_BYTES];
        let mut bytes = trajectory.encode(&mut buffer).expect("fits").to_vec();
        bytes.extend(plan.section.encode());
        let read = SptFile::decode(&bytes).expect("readable");
        let proved = crate::certify::verify(&read, &file.limits, file.machine.plant());
        assert!(proved.is_ok(), "{name}: {proved:?}");
        let run = play(name, file, &read.trajectory).expect(name);
        assert_eq!(run.recording.limited_ticks(), 0, "{name}");

        let [position, velocity] = errors::<AXES>(file, &plan);
        let power = power_error::<AXES>(file, &plan);
        let few_ulp = 8.0 * f64::from(f32::EPSILON);
        let errors = [position, velocity, power];
        assert!(errors.iter().all(|e| *e < few_ulp), "{name}: {errors:?}");
    }
}

#[test]
fn every_baseline_of_the_papers_move_is_a_trajectory_like_any_other() {
    check::<3>(&file("paper"));
}

#[test]
fn every_baseline_of_an_axis_is_a_trajectory_like_any_other() {
    check::<1>(&file("axis"));
}
