//! The manipulator against the independent oracle, and against the laws of mechanics.

use super::{Elbow, ThreeRrr};
use crate::machine::{Equations, Machine, Plant};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().map_or_else(Vec::new, |list| {
        list.iter().filter_map(Value::as_f64).collect()
    })
}

fn machine(p: &Value) -> ThreeRrr {
    let get = |key: &str| p[key].as_f64().expect(key);
    ThreeRrr {
        base_side_m: get("base_side"),
        link_length_m: get("link_length"),
        platform_side_m: get("platform_side"),
        link_thickness_m: get("link_thickness"),
        link_height_m: get("link_height"),
        youngs_modulus_pa: get("youngs_modulus"),
        density_kg_per_m3: get("density"),
        passive_link_mass_kg: get("passive_link_mass"),
        elbow_joint_mass_kg: get("elbow_joint_mass"),
        platform_joint_mass_kg: get("platform_joint_mass"),
        platform_mass_kg: get("platform_mass"),
        platform_inertia_kg_m2: get("platform_inertia"),
        motor_inertia_kg_m2: get("motor_and_reducer_inertia"),
        reducer_ratio: get("reducer_ratio"),
        elbow: if p["elbow"] == "plus" {
            Elbow::Plus
        } else {
            Elbow::Minus
        },
        gauge_position: 0.5,
        elastic_damping_ratio: 0.0,
    }
}

fn oracle() -> Value {
    serde_json::from_str(include_str!("../../../tests/data/three_rrr_oracle.json")).expect("oracle")
}

/// Largest difference relative to the largest magnitude of the expected vector.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    found
        .iter()
        .zip(expected)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
        / scale
}

#[test]
fn agrees_with_the_oracle() {
    let mut samples = 0;
    for set in oracle()["sets"].as_array().expect("sets") {
        let machine = machine(&set["parameters"]);
        for sample in set["samples"].as_array().expect("samples") {
            let get = |key: &str| numbers(&sample[key]);
            let (q, v, torque) = (get("q"), get("qd"), get("tau"));
            let dynamics = machine.forward(&q, &v, &torque).expect("assembles");
            for (row, expected) in sample["mass_matrix"]
                .as_array()
                .expect("M")
                .iter()
                .enumerate()
            {
                let found: Vec<f64> = dynamics.mass_matrix.row(row).iter().copied().collect();
                assert!(relative(&found, &numbers(expected)) < 1e-8);
            }
            assert!(relative(dynamics.accelerations.as_slice(), &get("qdd")) < 1e-8);
            assert!(relative(&Plant::joint_angles(&machine, &q), &get("theta")) < 1e-8);
            assert!(relative(&machine.joint_rates(&q, &v), &get("thetadot")) < 1e-8);
            let outputs = Plant::output_values(&machine, &q);
            assert!(relative(&outputs[..3], &get("elastic_displacement")) < 1e-8);
            samples += 1;
        }
    }
    assert_eq!(samples, 60);
}

/// The joint Jacobian is the derivative of the joint angles, for both elbows.
#[test]
fn joint_jacobian_is_the_derivative_of_the_joint_angles() {
    use crate::autodiff::Dual;
    for set in oracle()["sets"].as_array().expect("sets") {
        let machine = machine(&set["parameters"]);
        for sample in set["samples"].as_array().expect("samples") {
            let q = numbers(&sample["q"]);
            let seeded: Vec<Dual<6>> = q
                .iter()
                .enumerate()
                .map(|(i, &x)| Dual::seed(x, i))
                .collect();
            let mut angles = [Dual::seed(0.0, 0); 3];
            Machine::joint_angles(&machine, &seeded, &mut angles);
            let jacobian = machine
                .forward(&q, &[0.0; 6], &[0.0; 3])
                .expect("assembles")
                .joint_jacobian;
            for (axis, angle) in angles.iter().enumerate() {
                let row: Vec<f64> = jacobian.row(axis).iter().copied().collect();
                assert!(relative(&row, &angle.gradient) < 1e-11);
            }
        }
    }
}

#[test]
fn an_unreachable_pose_names_chain_and_distance() {
    let machine = machine(&oracle()["sets"][0]["parameters"]);
    assert!(machine.check_pose(&[0.1875, 0.108, 0.0]).is_ok());
    let message = machine
        .check_pose(&[0.5, 0.108, 0.0])
        .expect_err("far away")
        .to_string();
    assert!(
        message.contains("chain 1") && message.contains("0.2204"),
        "{message}"
    );
}

/// Both kinds of singular poses are in ∂θ/∂pose, whose rows are those of J over l uᵢ·nᵢ: its determinant vanishes with that of J and has
/// a pole where a chain is stretched.
#[test]
fn regularities_are_the_factors_of_the_joint_jacobian() {
    let machine = machine(&oracle()["sets"][0]["parameters"]);
    let lever = machine.platform_side_m / 3.0_f64.sqrt();
    for (x, y, phi) in [(0.1875, 0.108, 0.0), (0.21, 0.09, 0.3), (0.15, 0.13, -0.5)] {
        let q = Plant::rest(&machine, &[x, y, phi]);
        let mut values = [0.0; 4];
        machine.regularities(&q, &mut values);
        let mut equations = Equations::new(&machine);
        Plant::equations(&machine, &q, &[0.0; 6], &mut equations);
        let joints = nalgebra::Matrix3::from_fn(|r, c| equations.joint_jacobian[6 * r + c]);
        let bends: f64 = values[1..]
            .iter()
            .map(|bend| bend * machine.link_length_m)
            .product();
        let expected = values[0] * lever / bends;
        assert!(
            (joints.determinant() / expected - 1.0).abs() < 1e-12,
            "{values:?}"
        );
    }
    // One arm stretched: its foot is two links away from its corner.
    let mut values = [0.0; 4];
    let reach = 2.0 * machine.link_length_m;
    let corner = machine.corner(0, (0.0_f64, 1.0));
    let (sin, cos) = 0.6_f64.sin_cos();
    let pose = [
        reach * cos * (1.0 - 1e-9) - corner[0],
        reach * sin * (1.0 - 1e-9) - corner[1],
        0.0,
    ];
    machine.regularities(&Plant::rest(&machine, &pose), &mut values);
    assert!(values[1].abs() < 1e-3, "{values:?}");
}
