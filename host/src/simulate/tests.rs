//! The paper's numbers.

use super::ideal;
use super::modes;
use super::path::RigidPath;
use super::profile::{Profile, Shaper};
use crate::machine::{OutputKind, Plant, ThreeRrr, TwoMassAxis};

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

#[test]
fn explore() {
    let plant = paper();
    let q = Plant::rest(&plant, &FROM);
    let t = std::time::Instant::now();
    for _ in 0..10000 {
        std::hint::black_box(plant.forward(&q, &[0.1; 6], &[1.0; 3]));
    }
    println!("forward {} ns", t.elapsed().as_nanos() / 10000);
    let mut e = crate::machine::Equations::new(&plant);
    let t = std::time::Instant::now();
    for _ in 0..10000 {
        plant.equations(&q, &[0.1; 6], &mut e);
        std::hint::black_box(&mut e);
    }
    println!("equations {} ns", t.elapsed().as_nanos() / 10000);
    println!(
        "{:?}",
        modes::locked(&plant, &q).map(|m| modes::distinct_hz(&m))
    );
    println!("{:?}", modes::locked(&axis(), &[0.0, 0.0]));
    let profile = Profile::new(0.0508, Shaper::none());
    let path = RigidPath::new(&plant, &FROM, &TO, &profile);
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-8, 1e-10] {
        let t = std::time::Instant::now();
        let settings = ideal::Settings {
            tolerance,
            ..Default::default()
        };
        let r = ideal::simulate(&plant, &path, settings).expect("ok");
        let ms = t.elapsed().as_secs_f64() * 1e3;
        let outputs = Plant::outputs(&plant);
        let peak = |from: f64, to: f64, kind| {
            r.frames
                .iter()
                .filter(|f| (from..=to).contains(&f.time_s))
                .flat_map(|f| f.outputs.iter().zip(&outputs))
                .filter(|(_, o)| o.kind == kind)
                .map(|(v, _)| v.abs())
                .fold(0.0, f64::max)
        };
        println!(
            "{tolerance:e} {ms} ms {} frames: {} {} {}",
            r.frames.len(),
            peak(0.0, 1.0, OutputKind::Strain),
            peak(r.move_s, 1.0, OutputKind::Strain),
            peak(0.0, 1.0, OutputKind::ElasticDisplacement)
        );
    }
}
