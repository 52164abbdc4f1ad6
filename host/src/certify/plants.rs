//! What holds for the other plants of a robust move, whose motors follow the same joint motion.
//!
//! What is shipped says nothing of them but the joint motion, so each is simulated along it, with control of the error. That gives
//! its state at the end, and from it what it rings with afterwards; and the torque that its motors need. Where the limits are to
//! hold for it too, its coordinates are stored as polynomials: limits on outputs are proved for these, and how far the simulated
//! plant departs from them is a figure of the certificate.

use super::certificate::Proof;
use super::coordinates::Coordinates;
use super::{CertifyError, outputs, pieces_of};
use crate::machine::Plant;
use crate::movefile::{Limits, MoveFile, Robust, Scenario};
use crate::ocp::lgr::{Rule, lagrange_basis};
use crate::simulate::ideal::simulate_at;
use crate::simulate::modes::ModesError;
use crate::simulate::ode::OdeError;
use crate::simulate::ringing::ringing;
use crate::simulate::shipped::ShippedPath;
use crate::simulate::{Frame, Recording};
use serde::{Deserialize, Serialize};
use stillpoint_shared::lgr::LgrError;
use stillpoint_shared::{Trajectory, time};

/// Relative error that the simulation allows in a step.
const TOLERANCE: f64 = 1e-9;

/// Times per point of the trajectory at which a simulated plant is looked at.
const LOOKS_PER_POINT: usize = 8;

/// Share of a coordinate's typical magnitude by which a simulated plant may depart from polynomials that stand for it.
const FARTHEST: f64 = 1e-2;

/// What holds for one plant besides the nominal one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantProofs {
    /// What differs from the nominal plant.
    pub name: String,
    /// Its coordinates, where its limits are proved.
    pub coordinates: Option<Coordinates>,
    /// Limits on its outputs: proved for these coordinates' polynomials.
    pub proofs: Vec<Proof>,
    /// What a simulation of it comes to: what it rings with after the move and, where limits hold for it, its motors' load.
    pub simulated: Vec<Simulated>,
    /// How far the simulated plant departs from those polynomials at most, as a share of a coordinate's typical magnitude.
    pub departure: Option<f64>,
}

/// A simulated figure with its limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Simulated {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The largest value allowed.
    pub limit: f64,
    /// The value.
    pub value: f64,
    /// Whether it bounds what is left after the move, not the motors' load.
    pub after: bool,
}

impl Simulated {
    /// Whether the value is within its limit.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.value <= self.limit
    }
}

impl PlantProofs {
    /// What is beyond its limit, if anything is, or why nothing is proved: one sentence.
    #[must_use]
    pub fn broken(&self) -> Option<String> {
        let name = &self.name;
        let proof = self.proofs.iter().find(|proof| !proof.holds());
        let simulated = self.simulated.iter().find(|row| !row.holds());
        let departure = self.departure.filter(|share| *share > FARTHEST);
        proof
            .map(|proof| format!("{proof} with {name}"))
            .or_else(|| simulated.map(|row| format!("{row} with {name}")))
            .or_else(|| {
                departure.map(|share| {
                    format!(
                        "simulated with {name}, a coordinate departs by {share:.1e} of its typical magnitude from the polynomial that \
                         limits are proved for"
                    )
                })
            })
    }
}

/// Why nothing can be said of a plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// It cannot follow.
    #[error("{name} cannot follow the joint motion of the trajectory: {source}")]
    Follow {
        /// The plant.
        name: String,
        /// Why.
        source: OdeError,
    },
    /// It has no modes at the goal.
    #[error("no bound on what is left with {name}: {source}")]
    Modes {
        /// The plant.
        name: String,
        /// Why.
        source: ModesError,
    },
    /// An interval has an impossible number of points.
    #[error("{name}: {source}")]
    Rule {
        /// The plant.
        name: String,
        /// Why.
        source: LgrError,
    },
    /// Coordinates or trajectory are impossible.
    #[error("{name}: {source}")]
    Certify {
        /// The plant.
        name: String,
        /// Why.
        source: CertifyError,
    },
}

/// Looks at every plant of a robust move, for each of which `coordinates` has an entry: its coordinates, if limits hold for it.
///
/// # Errors
/// [`PlantError`] where a plant cannot follow, or the parts do not belong together.
pub fn certify_plants(
    file: &MoveFile,
    robust: &Robust,
    trajectory: &Trajectory,
    coordinates: Vec<Option<Coordinates>>,
) -> Result<Vec<PlantProofs>, PlantError> {
    let scenarios = robust.scenarios.iter().zip(coordinates);
    let plants = scenarios.map(|(scenario, coordinates)| {
        let certify = |source| PlantError::Certify {
            name: scenario.name.clone(),
            source,
        };
        let plant = scenario.machine.plant();
        let recording = follow(file, trajectory, scenario)?;
        let mut simulated = left(file, robust, scenario, &recording)?;
        let (mut proofs, mut departure) = (Vec::new(), None);
        if let Some(coordinates) = &coordinates {
            coordinates.check(trajectory, plant).map_err(certify)?;
            let pieces = pieces_of(trajectory).map_err(certify)?;
            proofs = outputs::prove(
                trajectory,
                &pieces,
                coordinates,
                plant,
                &file.limits.outputs,
            );
            departure = Some(departed(trajectory, coordinates, plant, &recording));
            simulated.extend(load(plant, &file.limits, &recording));
        }
        Ok(PlantProofs {
            name: scenario.name.clone(),
            coordinates,
            proofs,
            simulated,
            departure,
        })
    });
    plants.collect()
}

/// What is left of every bounded quantity with a plant that follows a trajectory.
///
/// # Errors
/// [`PlantError`] where it cannot follow, or has no modes at the goal.
pub fn left_after(
    file: &MoveFile,
    robust: &Robust,
    scenario: &Scenario,
    trajectory: &Trajectory,
) -> Result<Vec<Simulated>, PlantError> {
    left(file, robust, scenario, &follow(file, trajectory, scenario)?)
}

/// What a plant does whose motors follow a trajectory.
fn follow(
    file: &MoveFile,
    trajectory: &Trajectory,
    scenario: &Scenario,
) -> Result<Recording, PlantError> {
    let plant = scenario.machine.plant();
    let path = ShippedPath::new(trajectory, plant.rest(&file.from));
    let path = path.map_err(|source| PlantError::Rule {
        name: scenario.name.clone(),
        source,
    })?;
    let recording = simulate_at(plant, &path, &looks_s(trajectory), TOLERANCE);
    recording.map_err(|source| PlantError::Follow {
        name: scenario.name.clone(),
        source,
    })
}

/// Times over all intervals, the end last.
fn looks_s(trajectory: &Trajectory) -> Vec<f64> {
    let mut times_s = Vec::new();
    for interval in trajectory.intervals() {
        let looks = LOOKS_PER_POINT * interval.points;
        let (start, length) = (
            time::seconds(interval.start_ticks),
            time::seconds(interval.duration_ticks),
        );
        times_s.extend((0..looks).map(|k| start + length * k as f64 / looks as f64));
    }
    times_s.push(time::seconds(trajectory.duration_ticks()));
    times_s
}

/// What is left after the move.
fn left(
    file: &MoveFile,
    robust: &Robust,
    scenario: &Scenario,
    recording: &Recording,
) -> Result<Vec<Simulated>, PlantError> {
    let rows = ringing(scenario.machine.plant(), &file.to, &robust.residuals);
    let rows = rows.map_err(|source| {
        let name = scenario.name.clone();
        PlantError::Modes { name, source }
    })?;
    let end = recording.frames.last();
    let end: Vec<f64> = end.map_or_else(Vec::new, |frame| {
        frame
            .coordinates
            .iter()
            .chain(&frame.rates)
            .copied()
            .collect()
    });
    let simulated = rows.iter().map(|row| Simulated {
        name: row.name.to_owned(),
        unit: row.unit.to_owned(),
        limit: row.bound,
        value: row.left(&end),
        after: true,
    });
    Ok(simulated.collect())
}

/// The largest torque of each axis, and the nearest that it comes to the torque–speed curve.
fn load(plant: &dyn Plant, limits: &Limits, recording: &Recording) -> Vec<Simulated> {
    let ratio = plant.reducer_ratio();
    let (slope, knee) = (
        limits.slope_nm_s_per_rad(ratio),
        limits.knee_rad_per_s(ratio),
    );
    let largest = |value: &dyn Fn(&Frame) -> f64| {
        let values = recording.frames.iter().map(value);
        values.fold(f64::NEG_INFINITY, f64::max)
    };
    let row = |what: &str, axis: usize, value: f64| Simulated {
        name: format!("{what} of axis {}", axis + 1),
        unit: "N·m".to_owned(),
        limit: limits.torque_nm,
        value,
        after: false,
    };
    let mut rows = Vec::new();
    for axis in 0..plant.axis_count() {
        let torque = largest(&|frame| frame.torques_nm[axis].abs());
        rows.push(row("torque", axis, torque));
        if limits.torque_falls_with_speed() {
            let beyond = largest(&|frame| {
                let speed = frame.joint_rates_rad_per_s[axis].abs();
                frame.torques_nm[axis].abs() + slope * (speed - knee)
            });
            rows.push(row("torque–speed curve", axis, beyond));
        }
    }
    rows
}

/// The largest distance between stored polynomials and simulated coordinates.
fn departed(
    trajectory: &Trajectory,
    coordinates: &Coordinates,
    plant: &dyn Plant,
    recording: &Recording,
) -> f64 {
    let described = plant.coordinates();
    let count = described.len();
    let (mut largest, mut first) = (0.0_f64, 0);
    for interval in trajectory.intervals() {
        let Ok(rule) = Rule::new(interval.points) else {
            continue;
        };
        let own = &coordinates.values[first * count..][..(interval.points + 1) * count];
        first += interval.points + 1;
        let (start, length) = (
            time::seconds(interval.start_ticks),
            time::seconds(interval.duration_ticks),
        );
        let mut basis = vec![0.0; rule.support.len()];
        let inside = |frame: &&Frame| (start..start + length).contains(&frame.time_s);
        for frame in recording.frames.iter().filter(inside) {
            let local = 2.0 * (frame.time_s - start) / length - 1.0;
            lagrange_basis(&rule.support, &rule.barycentric, local, &mut basis);
            for (index, (coordinate, simulated)) in
                described.iter().zip(&frame.coordinates).enumerate()
            {
                let nodes = own.iter().skip(index).step_by(count);
                let value: f64 = nodes.zip(&basis).map(|(&q, l)| f64::from(q) * l).sum();
                largest = largest.max((value - simulated).abs() / coordinate.magnitude);
            }
        }
    }
    largest
}
