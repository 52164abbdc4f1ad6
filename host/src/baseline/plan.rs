//! A baseline as a trajectory with a certificate.

use super::name::{Baseline, BaselineError};
use crate::certify::{Coordinates, certify};
use crate::movefile::MoveFile;
use crate::simulate::ideal::{Settings, simulate_at};
use crate::simulate::path::RigidPath;
use crate::simulate::profile::Profile;
use crate::simulate::shortest::Task;
use crate::simulate::trajectory::{Feedforward, PathError, from_path, node_times_s};
use crate::simulate::usage::Usage;
use crate::sptfile::Section;
use stillpoint_shared::Trajectory;

/// A certified move.
#[derive(Clone, Debug)]
pub struct BaselinePlan {
    /// How far along its path it is at each time.
    pub profile: Profile,
    /// What the board plays.
    pub trajectory: Trajectory,
    /// What is stored beside it: the machine's coordinates with drives that follow exactly, and what is proved.
    pub section: Section,
    /// The limit that forbids a shorter move.
    pub active: Usage,
}

/// Share by which a duration grows while its certificate says no: the search looks at samples, the certificate at all times.
const STEP: f64 = 5e-4;
/// How many times it does.
const STEPS: usize = 20;

/// Plans the shortest move of a kind that keeps all limits: those of the motors on what is sent and on what drives that
/// follow exactly would need, those of the structure while it moves and while it rings afterwards.
///
/// # Errors
/// [`BaselineError`].
pub fn plan_baseline(file: &MoveFile, baseline: Baseline) -> Result<BaselinePlan, BaselineError> {
    let shortest = baseline.shortest(&Task::from(file))?;
    let mut profile = shortest.profile.on_grid();
    for _ in 0..STEPS {
        let (trajectory, section) = shipped(file, &profile)?;
        if section.certificate.is_certified() {
            return Ok(BaselinePlan {
                profile,
                trajectory,
                section,
                active: shortest.active,
            });
        }
        profile = profile.slower(1.0 + STEP).on_grid();
    }
    let (_, section) = shipped(file, &profile)?;
    let tightest = section.certificate.tightest();
    Err(BaselineError::NotCertified {
        name: baseline.name(),
        duration_s: profile.duration_s(),
        tightest: tightest.map_or_else(String::new, ToString::to_string),
    })
}

fn shipped(file: &MoveFile, profile: &Profile) -> Result<(Trajectory, Section), BaselineError> {
    let plant = file.machine.plant();
    let path = RigidPath::new(plant, &file.from, &file.to, profile);
    let trajectory = from_path(1, plant, &file.limits, &path, Feedforward::Rigid)?;
    let times_s = node_times_s(&trajectory).map_err(PathError::Trajectory)?;
    let tolerance = Settings::default().tolerance;
    let recording = simulate_at(plant, &path, &times_s, tolerance).map_err(PathError::Ode)?;
    let frames = recording.frames.iter();
    let coordinates = Coordinates {
        count: plant.coordinate_count() as u8,
        values: frames
            .flat_map(|frame| frame.coordinates.iter().map(|&q| q as f32))
            .collect(),
    };
    let certificate = certify(&trajectory, &coordinates, &file.limits, plant)?;
    let section = Section {
        coordinates,
        certificate,
        remarks: Vec::new(),
    };
    Ok((trajectory, section))
}
