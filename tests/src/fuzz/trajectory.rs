//! Acceptance: whatever values an upload has, it is refused or can be played.

use super::bytes::Bytes;
use std::sync::OnceLock;
use stillpoint_firmware::{Config, Executor, IdealDrives, LimitFlags, State, TickInputs};
use stillpoint_shared::assembly::{Assembly, AssemblyError, BLOCK_VALUES, Outline};
use stillpoint_shared::trajectory::Span;
use stillpoint_shared::{AxisLimits, LIMIT_TOLERANCE, Limits, Trajectory, TrajectoryError};

const AXES: usize = 2;

/// Longer moves are accepted or not, but not played: it would take too long.
const LONGEST_PLAYED_TICKS: u32 = 5_000_000;

/// Limits of the machine.
pub(super) fn limits() -> &'static Limits {
    static LIMITS: OnceLock<Limits> = OnceLock::new();
    LIMITS.get_or_init(|| {
        let axis = AxisLimits {
            torque_nm: 100.0,
            torque_rate_nm_per_s: 20_000.0,
            speed_rad_per_s: 20.0,
            knee_speed_rad_per_s: 15.0,
            slope_nm_s_per_rad: 10.0,
        };
        Limits::new(&[axis; AXES]).expect("these are limits")
    })
}

/// Bytes: number of intervals; duration and number of points of each; all values; then what the host does during the
/// move.
///
/// No panic anywhere. What is accepted plays to its end with every set-point within the limits, and where no limit was
/// in force it ends exactly at the last node.
pub fn trajectory(data: &[u8]) {
    let mut bytes = Bytes(data);
    let count = bytes.u8() % 9;
    let spans = (0..count).map(|_| Span {
        duration_ticks: bytes.u32(),
        points: bytes.u8(),
    });
    let mut outline = Outline {
        id: 1,
        axes: AXES as u8,
        limits_hash: limits().hash(),
        content_hash: 0,
        spans: spans.collect(),
    };
    let mut place = Trajectory::empty();
    let mut assembly = Assembly::NONE;
    if assembly.begin(&outline, &mut place).is_err() {
        return;
    }
    let values = bytes.take(4 * place.coefficients().len());
    let mut blocks = values.to_vec();
    blocks.resize(4 * place.coefficients().len(), 0);
    let mut upload = |assembly: &mut Assembly, outline: &Outline| {
        for (block, values) in (0..).zip(blocks.chunks(4 * BLOCK_VALUES)) {
            let taken = assembly.take(outline.tag(), block, values, &mut place);
            assert_eq!(taken, Ok(()));
        }
        assembly.finish(&mut place)
    };
    // The hash is not known before: the refusal tells.
    match upload(&mut assembly, &outline) {
        Err(AssemblyError::Trajectory(TrajectoryError::ContentHash { computed, .. })) => {
            outline.content_hash = computed;
        }
        Ok(()) => {}
        Err(other) => panic!("{other}"),
    }

    let mut executor = Executor::<AXES>::new(limits().clone(), Config::default()).expect("it fits");
    let first: [f32; AXES] = std::array::from_fn(|axis| first_value(&blocks, axis));
    let mut drives = IdealDrives::at(&first.into());
    executor.tick(&mut drives, &TickInputs::default());
    let Ok(measured_rad) = executor.measured_rad() else {
        return;
    };
    executor.begin_load(&outline).expect("the outline is sound");
    for (block, values) in (0..).zip(blocks.chunks(4 * BLOCK_VALUES)) {
        let taken = executor.load_block(outline.tag(), block, values);
        assert_eq!(taken, Ok(()));
    }
    match executor.commit_load(outline.content_hash, &measured_rad) {
        Ok(()) => play(&mut executor, &mut drives, &mut bytes),
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
    }
}

/// Position of an axis at the first node.
fn first_value(blocks: &[u8], axis: usize) -> f32 {
    let (values, _) = blocks.as_chunks();
    values
        .get(axis)
        .map_or(0.0, |&four| f32::from_le_bytes(four))
}

fn play(executor: &mut Executor<AXES>, drives: &mut IdealDrives<AXES>, bytes: &mut Bytes<'_>) {
    let duration_ticks = executor.trajectory().duration_ticks();
    if duration_ticks > LONGEST_PLAYED_TICKS {
        return;
    }
    executor.arm().expect("it stands at the start");
    let fine = TickInputs::default();
    executor.tick(drives, &fine);
    executor.tick(drives, &fine);
    // An accepted one may start a millirad away, and the approach takes its time: not here.
    let request = executor.start_request();
    if executor.start(&request).is_err() {
        return;
    }
    let mut limited = LimitFlags::NONE;
    let mut previous_nm = [0.0f32; AXES];
    let period_s = 250e-6;
    for tick in 0u32.. {
        if tick.is_multiple_of(16) {
            // Refused or not.
            let _ = match bytes.u8() {
                1 => executor.hold(),
                2 => executor.resume(),
                percent @ 100..=200 => executor.set_override(percent - 100),
                _ => Ok(()),
            };
        }
        // In the end, everything is played.
        if bytes.is_empty() {
            let _ = executor.set_override(100);
            let _ = executor.resume();
        }
        let report = executor.tick(drives, &fine);
        let state = report.state;
        for (axis, (setpoint, limits)) in report.setpoints.iter().zip(limits().axes()).enumerate() {
            let most = 1.0 + 2.0 * LIMIT_TOLERANCE;
            assert!(setpoint.position_rad.is_finite());
            assert!(setpoint.velocity_rad_per_s.abs() <= limits.speed_rad_per_s * most);
            assert!(setpoint.torque_nm.abs() <= limits.torque_nm * most);
            let available = limits
                .available_torque_nm(setpoint.velocity_rad_per_s * (1.0 - 2.0 * LIMIT_TOLERANCE));
            assert!(setpoint.torque_nm.abs() <= available * most + 1e-3);
            let step = (setpoint.torque_nm - previous_nm[axis]).abs();
            let allowed = limits.torque_rate_nm_per_s * period_s * most + 1e-3;
            // Where the curve falls faster than the rate allows, the curve wins.
            assert!(step <= allowed || setpoint.torque_nm.abs() < previous_nm[axis].abs());
            previous_nm[axis] = setpoint.torque_nm;
        }
        for flags in report.limited {
            limited |= *flags;
        }
        if state != State::Running && state != State::Holding && state != State::Held {
            break;
        }
        assert!(tick < 200_000, "it never ends");
    }
    assert_eq!(executor.state(), State::Done, "{:?}", executor.fault());
    if limited.is_empty() {
        let (values, _) = executor.trajectory().coefficients().as_chunks::<AXES>();
        let [.., position_rad, _, _] = values else {
            panic!("no last node");
        };
        let reached = executor.measured_rad().expect("ideal drives are heard");
        assert_eq!(reached.as_slice(), position_rad);
    }
}
