//! Figures of merit of a recording.

use super::recording::Recording;
use crate::machine::{OutputKind, Plant};
use std::f64::consts::TAU;

/// Largest magnitudes of one output.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct OutputPeak {
    /// Key of the output.
    pub key: &'static str,
    /// Short label for people.
    pub label: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Meaning.
    #[serde(skip)]
    pub kind: OutputKind,
    /// Over the whole recording.
    pub peak: f64,
    /// After the move.
    pub residual: f64,
}

/// What one move costs and leaves behind. `None` where the machine has no such output.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// Duration of the move.
    pub duration_s: f64,
    /// Largest strain.
    pub peak_strain: Option<f64>,
    /// Largest strain after the move.
    pub residual_strain: Option<f64>,
    /// Elastic displacements, output by output (some may be angles).
    pub elastic_displacement: Vec<OutputPeak>,
    /// Largest stress.
    pub stress_pa: Option<f64>,
    /// Largest torque at a reducer output.
    pub torque_nm: f64,
    /// Largest change of torque between two frames, per time.
    pub torque_rate_nm_per_s: f64,
    /// Largest motor speed.
    pub motor_speed_rpm: f64,
}

impl Metrics {
    /// Evaluates a recording.
    #[must_use]
    pub fn of(plant: &dyn Plant, recording: &Recording) -> Self {
        let peaks = output_peaks(plant, recording);
        let largest = |kind, value: fn(&OutputPeak) -> f64| {
            let of_kind = peaks.iter().filter(|p| p.kind == kind);
            of_kind.map(value).reduce(f64::max)
        };
        let frames = &recording.frames;
        let magnitude = |values: &[f64]| values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let rate = |pair: &[super::recording::Frame]| {
            let [a, b] = pair else { return 0.0 };
            let change = a.torques_nm.iter().zip(&b.torques_nm);
            let largest = change.fold(0.0_f64, |m, (a, b)| m.max((b - a).abs()));
            largest / (b.time_s - a.time_s)
        };
        let speed = frames.iter().map(|f| magnitude(&f.joint_rates_rad_per_s));
        Self {
            duration_s: recording.duration_s,
            peak_strain: largest(OutputKind::Strain, |p| p.peak),
            residual_strain: largest(OutputKind::Strain, |p| p.residual),
            stress_pa: largest(OutputKind::Stress, |p| p.peak),
            torque_nm: frames
                .iter()
                .map(|f| magnitude(&f.torques_nm))
                .fold(0.0, f64::max),
            torque_rate_nm_per_s: frames.windows(2).map(rate).fold(0.0, f64::max),
            motor_speed_rpm: speed.fold(0.0, f64::max) * plant.reducer_ratio() * 60.0 / TAU,
            elastic_displacement: peaks
                .into_iter()
                .filter(|p| p.kind == OutputKind::ElasticDisplacement)
                .collect(),
        }
    }

    /// What is left after the move, of strain or, on a machine without gauges, of the elastic displacement that is left
    /// most.
    #[must_use]
    pub fn residual(&self) -> f64 {
        let displacements = self.elastic_displacement.iter().map(|p| p.residual);
        self.residual_strain
            .unwrap_or_else(|| displacements.fold(0.0, f64::max))
    }

    /// The same for people: strain in µε, or the displacement in its unit.
    #[must_use]
    pub fn residual_in_words(&self) -> String {
        let most =
            (self.elastic_displacement.iter()).max_by(|a, b| a.residual.total_cmp(&b.residual));
        match (self.residual_strain, most) {
            (Some(strain), _) => format!("{:.1} µε of strain", strain * 1e6),
            (None, Some(most)) => format!("{:.2e} {} of {}", most.residual, most.unit, most.label),
            (None, None) => "nothing that is watched".to_owned(),
        }
    }
}

/// Peak and residual of every output, in the order of the plant's outputs.
#[must_use]
pub fn output_peaks(plant: &dyn Plant, recording: &Recording) -> Vec<OutputPeak> {
    let outputs = plant.outputs().into_iter().enumerate();
    let peak = |index: usize, from_s: f64| {
        let frames = recording.frames.iter().filter(|f| f.time_s >= from_s);
        let values = frames.filter_map(|f| f.outputs.get(index));
        values.fold(0.0_f64, |m, x| m.max(x.abs()))
    };
    outputs
        .map(|(index, output)| OutputPeak {
            key: output.key,
            label: output.label,
            unit: output.unit,
            kind: output.kind,
            peak: peak(index, f64::NEG_INFINITY),
            residual: peak(index, recording.rest_from_s),
        })
        .collect()
}
