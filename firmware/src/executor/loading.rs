//! How a trajectory comes in: into the second buffer, interval by interval or at once; checked as a
//! whole; then the buffers change places. Until then the old one is the loaded one.

use nalgebra::SVector;
use stillpoint_shared::assembly::{Arrived, AssemblyError, Outline};
use stillpoint_shared::{Trajectory, TrajectoryError};

use super::Executor;
use crate::accept;
use crate::pace::Pace;
use crate::path_time::PathTime;
use crate::{Command, Refusal, Rejection, State};

impl<const AXES: usize> Executor<AXES> {
    /// Begins an upload, or goes on with the same one. Another one under way is forgotten, also by
    /// one that is refused because it is no trajectory.
    ///
    /// With the drives off the state becomes `Loading`; with the drives on, even during a move, it
    /// stays, and what comes waits for its commit.
    pub fn begin_load(&mut self, outline: &Outline) -> Result<(), Refusal> {
        self.allows(Command::BeginLoad)?;
        self.limits.as_ref().ok_or(Refusal::NotConfigured)?;
        let machine = self.limits_hash;
        if usize::from(outline.axes) != AXES {
            return Err(Rejection::Axes {
                trajectory: outline.axes,
                machine: AXES as u8,
            }
            .into());
        }
        if outline.limits_hash != machine {
            return Err(Rejection::LimitsHash {
                trajectory: outline.limits_hash,
                machine,
            }
            .into());
        }
        if let Err(error) = self.buffers.begin(outline) {
            self.abort_load();
            return Err(error.into());
        }
        if !self.state.is_energised() {
            self.state = State::Loading;
        }
        Ok(())
    }

    /// Takes a block of the upload named `tag`, as [`Assembly::take`](stillpoint_shared::assembly::Assembly::take) does.
    pub fn load_block(&mut self, tag: u32, block: u8, bytes: &[u8]) -> Result<(), Refusal> {
        let (assembly, trajectory) = self.buffers.loading().ok_or(AssemblyError::NothingBegun)?;
        Ok(assembly.take(tag, block, bytes, trajectory)?)
    }

    /// Which blocks of the upload have arrived; none, and no blocks, if none is under way.
    pub fn arrived(&self) -> Arrived {
        self.buffers.arrived()
    }

    /// Checks the upload against the hash announced, the limits and where the axes stand (rad), and
    /// makes it the loaded one. A refused one stays under way: it can be committed again (from
    /// where it starts), begun anew or aborted.
    ///
    /// Takes much longer than a tick; nothing moves meanwhile.
    pub fn commit_load(
        &mut self,
        content_hash: u64,
        measured_rad: &SVector<f32, AXES>,
    ) -> Result<(), Refusal> {
        self.allows(Command::CommitLoad)?;
        let (assembly, trajectory) = self.buffers.loading().ok_or(AssemblyError::NothingBegun)?;
        assembly.finish(trajectory)?;
        let computed = trajectory.header().content_hash;
        if computed != content_hash {
            return Err(TrajectoryError::ContentHash {
                stored: content_hash,
                computed,
            }
            .into());
        }
        self.accept_loading(measured_rad)
    }

    /// Forgets the upload, if one is under way.
    pub fn abort_load(&mut self) {
        self.buffers.forget();
        if self.state == State::Loading {
            self.state = self.rest();
        }
    }

    /// Takes a copy of a whole trajectory, if it passes the same checks as an upload. A refused one
    /// leaves the previous one loaded. An upload under way is forgotten.
    pub fn load(
        &mut self,
        trajectory: &Trajectory,
        measured_rad: &SVector<f32, AXES>,
    ) -> Result<(), Refusal> {
        self.allows(Command::Load)?;
        self.buffers.spare_mut().copy_from(trajectory);
        self.accept_loading(measured_rad)
    }

    /// [`Executor::load`] from the bytes of [`Trajectory::encode`], such as the stored ones.
    pub fn load_encoded(
        &mut self,
        bytes: &[u8],
        measured_rad: &SVector<f32, AXES>,
    ) -> Result<(), Refusal> {
        self.allows(Command::Load)?;
        self.buffers.spare_mut().decode_from(bytes)?;
        self.accept_loading(measured_rad)
    }

    /// All or nothing: checks what is in the second buffer, then lets the buffers change places.
    fn accept_loading(&mut self, measured_rad: &SVector<f32, AXES>) -> Result<(), Refusal> {
        let limits = self.limits.as_ref().ok_or(Refusal::NotConfigured)?;
        let trajectory = self.buffers.spare();
        accept::check(
            trajectory,
            limits,
            &(*measured_rad).into(),
            &self.config.accept,
        )?;
        let pace = Pace::of(trajectory, limits, self.config.ramp_s);
        self.buffers.swap()?;
        self.pace = pace;
        self.path = PathTime::START;
        self.state = if self.is_driving() {
            State::Armed
        } else {
            State::Ready
        };
        self.dry_run = false;
        Ok(())
    }
}
