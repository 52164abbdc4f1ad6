//! Random moves of the 3-RRR manipulator: how often the planner solves without help.
//!
//! Start and target lie in a disc of 70 mm about the centre of the base, turned by up to 0.6 rad either way, for both elbows and three
//! payloads, all equally likely. A move counts if it is kinematically possible along the straight line between its poses: every chain
//! reaches all of it, and it passes no singular pose, near which no limit could be kept.

use crate::machine::{Equations, Machine as _, three_rrr::Elbow};
use crate::movefile::{MachineKind, MoveFile};
use nalgebra::DMatrix;

const RADIUS_M: f64 = 0.07;
const TURN_RAD: f64 = 0.6;
/// Payloads, as factors of the platform's mass and inertia.
pub const PAYLOADS: [f64; 3] = [0.5, 1.0, 1.5];
/// Places of the line that are looked at.
const PLACES: usize = 50;
/// Entries of ∂θ/∂(x, y, φ) beyond this (rad/m) belong to a chain that is nearly stretched or folded; a determinant below
/// the other to a platform that its motors nearly do not hold.
const LARGEST_ENTRY: f64 = 200.0;
const LEAST_DETERMINANT: f64 = 1.0;

/// One move.
#[derive(Clone, Debug)]
pub struct RandomMove {
    /// The file to plan.
    pub file: MoveFile,
    /// Side of the elbows.
    pub elbow: Elbow,
    /// Index into [`PAYLOADS`].
    pub payload: usize,
}

/// The moves of a seed, without end: those of a machine like `base`'s that are kinematically possible.
///
/// `None` where `base` is another machine.
pub fn random_moves(base: &MoveFile, seed: u64) -> Option<impl Iterator<Item = RandomMove>> {
    let MachineKind::ThreeRrr(machine) = base.machine.clone() else {
        return None;
    };
    let base = base.clone();
    let mut state = seed;
    // A linear congruential generator: the moves of a seed never change.
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let centre = [
        machine.base_side_m / 2.0,
        machine.base_side_m / 12_f64.sqrt(),
    ];
    let all = std::iter::repeat_with(move || {
        let mut pose = || {
            let (radius, direction) =
                (RADIUS_M * random().sqrt(), std::f64::consts::TAU * random());
            let turn = TURN_RAD * (2.0 * random() - 1.0);
            vec![
                centre[0] + radius * direction.cos(),
                centre[1] + radius * direction.sin(),
                turn,
            ]
        };
        let (from, to) = (pose(), pose());
        let elbow = if random() < 0.5 {
            Elbow::Plus
        } else {
            Elbow::Minus
        };
        let payload = (random() * PAYLOADS.len() as f64) as usize;
        let mut machine = machine.with_payload_factor(PAYLOADS[payload]);
        machine.elbow = elbow;
        let file = MoveFile {
            machine: MachineKind::ThreeRrr(machine),
            from,
            to,
            ..base.clone()
        };
        RandomMove {
            file,
            elbow,
            payload,
        }
    });
    Some(all.filter(|random| is_possible(&random.file)))
}

/// Whether the straight line between the ends stays away from what the machine cannot reach and from singular poses.
fn is_possible(file: &MoveFile) -> bool {
    let plant = file.machine.plant();
    let still = vec![0.0; plant.coordinate_count()];
    let mut equations = Equations::new(plant);
    let mut side = 0.0;
    (0..=PLACES).all(|place| {
        let share = place as f64 / PLACES as f64;
        let ends = file.from.iter().zip(&file.to);
        let pose: Vec<f64> = ends.map(|(a, b)| a + share * (b - a)).collect();
        if file.machine.check_pose(&pose).is_err() {
            return false;
        }
        plant.equations(&plant.rest(&pose), &still, &mut equations);
        let jacobian = DMatrix::from_row_slice(3, 6, &equations.joint_jacobian);
        let rigid = jacobian.columns(0, 3).into_owned();
        let determinant = rigid.determinant();
        if side == 0.0 {
            side = determinant.signum();
        }
        determinant * side >= LEAST_DETERMINANT && rigid.amax() <= LARGEST_ENTRY
    })
}
