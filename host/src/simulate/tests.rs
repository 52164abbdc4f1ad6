//! The paper's numbers.

use super::ideal;
use super::modes;
use super::path::RigidPath;
use super::profile::{Profile, Shaper};
use super::recording::Recording;
use crate::movefile::MoveFile;

fn file(name: &str) -> MoveFile {
    let path = format!("{}/moves/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    MoveFile::read(path).expect("a move")
}

fn quintic(file: &MoveFile, settings: ideal::Settings) -> Recording {
    let profile = Profile::new(0.0508, Shaper::none());
    let plant = file.machine.plant();
    let path = RigidPath::new(plant, &file.from, &file.to, &profile);
    ideal::simulate(plant, &path, settings).expect("reachable")
}

#[test]
fn explore() {
    let paper = file("paper");
    for (tolerance, sample_s) in [(1e-4, 5e-4), (1e-6, 1e-4), (1e-8, 1e-4)] {
        let t = std::time::Instant::now();
        let settings = ideal::Settings {
            tolerance,
            sample_s,
            ..Default::default()
        };
        let r = quintic(&paper, settings);
        let ms = t.elapsed().as_secs_f64() * 1e3;
        println!(
            "{tolerance:e} {ms} {:?}",
            super::metrics::Metrics::of(paper.machine.plant(), &r).residual()
        );
    }
    for f in [paper, file("axis")] {
        let t = std::time::Instant::now();
        let usual = super::shortest::Task::from(&f).usual().expect("ok");
        println!("{:?}", t.elapsed());
        for (name, s) in usual {
            println!(
                "{name} {} {:?} {:?}",
                s.profile.duration_s(),
                s.active,
                super::metrics::Metrics::of(f.machine.plant(), &s.recording).residual()
            );
        }
    }
}
