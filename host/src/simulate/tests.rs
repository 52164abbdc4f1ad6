//! The paper's numbers.

use super::ideal;
use super::modes;
use super::path::RigidPath;
use super::profile::{Profile, Shaper};
use super::recording::Recording;
use crate::machine::{Plant, ThreeRrr, TwoMassAxis};

const FROM: [f64; 3] = [0.1875, 0.10825317547305484, 0.0];
const TO: [f64; 3] = [0.2175, 0.10825317547305484, 0.0];

fn machine<T: serde::de::DeserializeOwned>(text: &str) -> T {
    #[derive(serde::Deserialize)]
    struct Move {
        machine: toml::Table,
    }
    let mut table = toml::from_str::<Move>(text).expect("a move file").machine;
    table.remove("kind");
    table.try_into().expect("a machine")
}

fn paper() -> ThreeRrr {
    machine(include_str!("../../moves/paper.toml"))
}

fn axis() -> TwoMassAxis {
    machine(include_str!("../../moves/axis.toml"))
}

fn bounds() -> super::bounds::Bounds {
    use super::bounds::{Bounds, OutputBound};
    use stillpoint_shared::{AxisLimits, Limits};
    let rpm = std::f32::consts::TAU / 60.0 / 20.0;
    let axis = AxisLimits {
        torque_nm: 150.0,
        torque_rate_nm_per_s: 2.0e4,
        speed_rad_per_s: 6000.0 * rpm,
        knee_speed_rad_per_s: 4750.0 * rpm,
        slope_nm_s_per_rad: 0.12 / rpm,
    };
    let limit = |output, bound| OutputBound { output, bound };
    Bounds {
        axes: Limits::new(&[axis; 3]).expect("limits"),
        outputs: vec![
            limit(0, 1.5e-3),
            limit(1, 0.2e-3),
            limit(6, 355e6),
            limit(7, 355e6),
            limit(8, 355e6),
        ],
    }
}

fn quintic(plant: &dyn Plant, settings: ideal::Settings) -> Recording {
    let profile = Profile::new(0.0508, Shaper::none());
    let path = RigidPath::new(plant, &FROM, &TO, &profile);
    ideal::simulate(plant, &path, settings).expect("reachable")
}

#[test]
fn explore() {
    let plant = paper();
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-8, 1e-10] {
        for sample_s in [1e-4, 2.5e-4, 1e-2] {
        let t = std::time::Instant::now();
        let settings = ideal::Settings { tolerance, sample_s, ..Default::default() };
        let r = quintic(&plant, settings);
        let ms = t.elapsed().as_secs_f64() * 1e3;
        println!("{tolerance:e} {ms} {:?}", super::metrics::Metrics::of(&plant, &r));
    }}
    let bounds = bounds();
    let t = std::time::Instant::now();
    let usual = super::shortest::Task { plant: &plant, from: &FROM, to: &TO, bounds: &bounds }.usual().expect("ok");
    println!("{:?}", t.elapsed());
    for (name, s) in usual {
        println!("{name} {} {:?} {:?}", s.profile.duration_s(), s.active, super::metrics::Metrics::of(&plant, &s.recording).residual());
    }
}
