//! A planned motion, whoever planned it, on machines that differ from the planned one.

use crate::baseline::BaselinePlan;
use crate::machine::{Change, MachineError};
use crate::movefile::{MachineKind, MoveFile};
use crate::plan::Plan;
use crate::simulate::ideal::{self, Settings};
use crate::simulate::ode::OdeError;
use crate::simulate::path::RigidPath;
use crate::simulate::planned::PlannedPath;
use crate::simulate::{ClosedLoop, ClosedLoopError, Metrics};
use stillpoint_shared::{Trajectory, time};

/// What is compared.
#[derive(Clone, Debug)]
pub enum Motion {
    /// An optimal move.
    Planned(Box<Plan>),
    /// A baseline.
    Shaped(Box<BaselinePlan>),
}

/// What moves the motors in a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drives {
    /// The executor and the simulated drives of the move file.
    Simulated,
    /// Drives that follow the planned joint motion exactly.
    Exact,
}

/// A machine on which a motion does not get to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{parameter} × {factor}: {fault}")]
pub struct Stopped {
    /// The parameter that was changed.
    pub parameter: String,
    /// By which factor.
    pub factor: f64,
    /// What happened.
    pub fault: SweepFault,
}

/// What can happen on a machine that differs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepFault {
    /// There is no such machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The executor refuses, or the move was stopped.
    #[error(transparent)]
    ClosedLoop(#[from] ClosedLoopError),
    /// The machine cannot follow.
    #[error(transparent)]
    Ode(#[from] OdeError),
}

impl Motion {
    /// What the board plays.
    #[must_use]
    pub fn trajectory(&self) -> &Trajectory {
        match self {
            Self::Planned(plan) => &plan.trajectory,
            Self::Shaped(plan) => &plan.trajectory,
        }
    }

    /// Its duration.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        time::seconds(self.trajectory().duration_ticks())
    }

    /// What a machine is left with that differs by each factor in one parameter: factor and residual (strain, or without
    /// gauges elastic displacement); infinite where the move does not get to its end, which is added to `stopped`.
    pub fn residuals(
        &self,
        file: &MoveFile,
        parameter: &str,
        factors: &[f64],
        drives: Drives,
        stopped: &mut Vec<Stopped>,
    ) -> Vec<(f64, f64)> {
        let mut residual = |factor: f64| {
            let found = self.residual(file, parameter, factor, drives);
            found.unwrap_or_else(|fault| {
                stopped.push(Stopped {
                    parameter: parameter.to_owned(),
                    factor,
                    fault,
                });
                f64::INFINITY
            })
        };
        factors
            .iter()
            .map(|&factor| (factor, residual(factor)))
            .collect()
    }

    fn residual(
        &self,
        file: &MoveFile,
        parameter: &str,
        factor: f64,
        drives: Drives,
    ) -> Result<f64, SweepFault> {
        let real = file.drive.real_machine(&file.machine);
        let real = real.changed(parameter, Change::Factor(factor))?;
        let plant = real.plant();
        let recording = match drives {
            Drives::Simulated => ClosedLoop::new(plant, &file.limits, &file.from, &file.drive)
                .play(self.trajectory())?,
            Drives::Exact => self.followed(file, &real)?,
        };
        Ok(Metrics::of(plant, &recording).residual())
    }

    /// The machine with motors that follow the planned joint motion exactly.
    fn followed(
        &self,
        file: &MoveFile,
        real: &MachineKind,
    ) -> Result<crate::simulate::Recording, OdeError> {
        let settings = Settings {
            tolerance: 1e-7,
            ..Settings::default()
        };
        let planned = file.machine.plant();
        match self {
            Self::Planned(plan) => {
                let path = PlannedPath::new(planned, &plan.solution);
                ideal::simulate(real.plant(), &path, settings)
            }
            Self::Shaped(plan) => {
                let path = RigidPath::new(planned, &file.from, &file.to, &plan.profile);
                ideal::simulate(real.plant(), &path, settings)
            }
        }
    }
}
