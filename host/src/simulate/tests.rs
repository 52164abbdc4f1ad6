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
    use super::trajectory::{Feedforward, from_path};
    use super::{ClosedLoop, DriveSettings, Metrics};
    let drives = DriveSettings::default();
    for f in [file("paper"), file("axis")] {
        let plant = f.machine.plant();
        for ms in [50.8, 120.0, 200.0] {
            let profile = Profile::new(ms * 1e-3, Shaper::none());
            let path = RigidPath::new(plant, &f.from, &f.to, &profile);
            println!(
                "ideal {:?}",
                Metrics::of(
                    plant,
                    &ideal::simulate(plant, &path, Default::default()).expect("ok")
                )
            );
            for ff in [Feedforward::Ideal, Feedforward::Rigid] {
                let trajectory = from_path(1, plant, &f.limits, &path, ff).expect("fits");
                let mut lp = ClosedLoop::new(plant, &f.limits, &f.from, &drives);
                lp.executor.accept.torque_free_ends = false;
                let t = std::time::Instant::now();
                match lp.play(&trajectory) {
                    Ok(r) => {
                        let ms = t.elapsed().as_secs_f64() * 1e3;
                        let flags = r
                            .commands
                            .iter()
                            .flat_map(|c| &c.limited)
                            .filter(|l| !l.is_empty())
                            .count();
                        println!("{ff:?} {ms} ms, {flags} flags {:?}", Metrics::of(plant, &r));
                    }
                    Err(e) => println!("{e}"),
                }
            }
        }
    }
}
