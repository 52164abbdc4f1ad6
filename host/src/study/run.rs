//! One run: what the machine did, and its figures of merit.

use crate::baseline::{Baseline, BaselineError};
use crate::machine::{OutputKind, Plant};
use crate::movefile::{Limits, MoveFile};
use crate::report::{MARKED_BEYOND, Record, SummaryRow};
use crate::simulate::path::RigidPath;
use crate::simulate::profile::{Law, Profile};
use crate::simulate::shaper::Shaper;
use crate::simulate::shortest::Task;
use crate::simulate::trajectory::{Feedforward, PathError, from_path};
use crate::simulate::{ClosedLoop, ClosedLoopError, Frame, Metrics, Recording};
use stillpoint_shared::Trajectory;

/// A run with its figures of merit.
#[derive(Clone, Debug)]
pub struct Run {
    /// What was run.
    pub name: String,
    /// What the machine did.
    pub recording: Recording,
    /// Its figures of merit.
    pub metrics: Metrics,
}

/// Why a run could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The executor or the drives did not play it to its end.
    #[error("{name}: {source}")]
    Play {
        /// What was run.
        name: String,
        /// Why.
        source: ClosedLoopError,
    },
    /// A quintic cannot be made along this line.
    #[error("the quintic along the straight line between the poses is impossible: {0}")]
    Path(#[from] PathError),
    /// The shaped moves cannot be made.
    #[error("the shaped quintics are impossible: {0}")]
    Baseline(#[from] BaselineError),
}

impl Run {
    pub(super) fn new(name: &str, plant: &dyn Plant, recording: Recording) -> Self {
        Self {
            name: name.to_owned(),
            metrics: Metrics::of(plant, &recording),
            recording,
        }
    }

    /// Its row in the comparison; whether a displacement is beyond its limit is judged output by output.
    #[must_use]
    pub fn row(&self, file: &MoveFile) -> SummaryRow {
        let m = &self.metrics;
        let outputs = file.machine.plant().outputs();
        let beyond = outputs
            .iter()
            .zip(&file.limits.outputs)
            .any(|(output, limit)| {
                let peak = m
                    .elastic_displacement
                    .iter()
                    .find(|peak| peak.key == output.key);
                peak.zip(*limit)
                    .is_some_and(|(peak, limit)| peak.peak > limit * (1.0 + MARKED_BEYOND))
            });
        let displacements = m.elastic_displacement.iter().filter(|p| p.unit == "m");
        SummaryRow {
            name: self.name.clone(),
            duration_s: Some(m.duration_s),
            peak_strain: m.peak_strain,
            residual_strain: m.residual_strain,
            elastic_displacement_m: displacements.map(|p| p.peak).reduce(f64::max),
            elastic_displacement_beyond: beyond,
            stress_pa: m.stress_pa,
            torque_nm: Some(m.torque_nm),
            torque_rate_nm_per_s: Some(m.torque_rate_nm_per_s),
            motor_speed_rpm: Some(m.motor_speed_rpm),
        }
    }

    /// Its channels for the figures.
    #[must_use]
    pub fn record(&self) -> Record {
        let frames = &self.recording.frames;
        let channels = |values: fn(&Frame) -> &Vec<f64>| -> Vec<Vec<f64>> {
            let count = frames.first().map_or(0, |frame| values(frame).len());
            (0..count)
                .map(|index| frames.iter().map(|frame| values(frame)[index]).collect())
                .collect()
        };
        let time_s: Vec<f64> = frames.iter().map(|frame| frame.time_s).collect();
        let torque_nm = channels(|frame| &frame.torques_nm);
        let torque_rate_nm_per_s = torque_nm
            .iter()
            .map(|torque| slope(&time_s, torque))
            .collect();
        Record {
            name: self.name.clone(),
            end_s: self.recording.duration_s,
            coordinates: channels(|frame| &frame.coordinates),
            rates: channels(|frame| &frame.rates),
            outputs: channels(|frame| &frame.outputs),
            joint_speed_rad_per_s: channels(|frame| &frame.joint_rates_rad_per_s),
            torque_nm,
            torque_rate_nm_per_s,
            time_s,
        }
    }
}

/// Backward differences; the first is zero.
fn slope(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    std::iter::once(0.0)
        .chain((1..values.len()).map(|k| (values[k] - values[k - 1]) / (time_s[k] - time_s[k - 1])))
        .collect()
}

/// Plays a trajectory through the firmware's executor and the simulated drives of the move file, and watches the machine
/// for 0.35 s afterwards.
///
/// # Errors
/// [`StudyError::Play`]: the executor refuses, faults, or the mechanism falls apart.
pub fn play(name: &str, file: &MoveFile, trajectory: &Trajectory) -> Result<Run, StudyError> {
    play_within(name, file, &file.limits, trajectory)
}

fn play_within(
    name: &str,
    file: &MoveFile,
    limits: &Limits,
    trajectory: &Trajectory,
) -> Result<Run, StudyError> {
    let real = file.drive.real_machine(&file.machine);
    let closed_loop = ClosedLoop::new(real.plant(), limits, &file.from, &file.drive);
    let recording = closed_loop
        .play(trajectory)
        .map_err(|source| StudyError::Play {
            name: name.to_owned(),
            source,
        })?;
    Ok(Run::new(name, real.plant(), recording))
}

/// The quintic along the straight line in a given duration, through the same executor and drives, with the motors' limits
/// lifted: at the duration of an optimal move a quintic breaks them, and the executor would rightly refuse it.
///
/// # Errors
/// [`StudyError`].
pub fn equal_quintic(name: &str, file: &MoveFile, duration_s: f64) -> Result<Run, StudyError> {
    const LIFTED: f64 = 100.0;
    let limits = Limits {
        torque_nm: file.limits.torque_nm * LIFTED,
        torque_rate_nm_per_s: file.limits.torque_rate_nm_per_s * LIFTED,
        motor_speed_rpm: file.limits.motor_speed_rpm * LIFTED,
        torque_speed_knee_rpm: file.limits.torque_speed_knee_rpm * LIFTED,
        ..file.limits.clone()
    };
    let profile = Profile::new(Law::Quintic, duration_s, Shaper::none());
    let plant = file.machine.plant();
    let path = RigidPath::new(plant, &file.from, &file.to, &profile);
    let trajectory = from_path(0, plant, &limits, &path, Feedforward::Rigid)?;
    play_within(name, file, &limits, &trajectory)
}

/// What a user would pick instead, and how the comparison calls it.
const USUAL: [(&str, &str); 4] = [
    ("quintic", "shortest quintic"),
    ("quintic+zv", "shortest quintic with ZV"),
    ("quintic+zv2", "shortest quintic with ZV on two modes"),
    ("quintic+zvd", "shortest quintic with ZVD"),
];

/// The shortest moves within all limits that a quintic makes, alone and with input shapers, with drives that follow
/// exactly: what a user would pick instead, at its best. At the same time, one thread each.
///
/// # Errors
/// [`StudyError::Baseline`].
pub fn shortest_shaped(file: &MoveFile) -> Result<Vec<Run>, StudyError> {
    let task = Task::from(file);
    let known = Baseline::all_for(&task).map_err(BaselineError::Modes)?;
    let run = |name: &str, baseline: &Baseline| {
        let shortest = baseline.shortest(&task)?;
        Ok(Run::new(name, task.plant, shortest.recording))
    };
    std::thread::scope(|scope| {
        let named = |(key, name)| Some((name, known.iter().find(|b| b.name() == key)?));
        let running: Vec<_> = (USUAL.into_iter().filter_map(named))
            .map(|(name, baseline)| scope.spawn(move || run(name, baseline)))
            .collect();
        let joined = running.into_iter().map(|thread| match thread.join() {
            Ok(run) => run,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.collect()
    })
}

/// The machine's limits as a row of the comparison.
pub(super) fn limit_row(file: &MoveFile) -> SummaryRow {
    let of_kind = |kind: OutputKind| {
        let outputs = file.machine.plant().outputs();
        let limits = outputs.iter().zip(&file.limits.outputs);
        limits
            .filter(|(output, _)| output.kind == kind && output.unit != "rad")
            .filter_map(|(_, limit)| *limit)
            .reduce(f64::max)
    };
    SummaryRow {
        name: "limit".to_owned(),
        elastic_displacement_m: of_kind(OutputKind::ElasticDisplacement),
        stress_pa: of_kind(OutputKind::Stress),
        torque_nm: Some(file.limits.torque_nm),
        torque_rate_nm_per_s: Some(file.limits.torque_rate_nm_per_s),
        motor_speed_rpm: Some(file.limits.motor_speed_rpm),
        ..SummaryRow::default()
    }
}
