//! How a trajectory comes in: into the second buffer, interval by interval or at once; checked as a
//! whole; then the buffers change places. Until then the old one is the loaded one.

use nalgebra::SVector;
use stillpoint_shared::{Trajectory, TrajectoryError};

use super::Executor;
use crate::accept;
use crate::pace::Pace;
use crate::{Command, Refusal, Rejection, State};

impl<const AXES: usize> Executor<AXES> {
    /// Begins an upload: a move named `id` of `axes` axes, planned for the limits of this hash. One
    /// that is under way is forgotten.
    ///
    /// With the drives off the state becomes `Loading`; with the drives on, even during a move, it
    /// stays, and what comes waits for its commit.
    pub fn begin_load(&mut self, id: u32, axes: u8, limits_hash: u64) -> Result<(), Refusal> {
        self.allows(Command::BeginLoad)?;
        self.limits.as_ref().ok_or(Refusal::NotConfigured)?;
        let machine = self.limits_hash;
        if usize::from(axes) != AXES {
            return Err(Rejection::Axes {
                trajectory: axes,
                machine: AXES as u8,
            }
            .into());
        }
        if limits_hash != machine {
            return Err(Rejection::LimitsHash {
                trajectory: limits_hash,
                machine,
            }
            .into());
        }
        self.buffers.begin().begin(id, axes, limits_hash)?;
        if !self.state.is_energised() {
            self.state = State::Loading;
        }
        Ok(())
    }

    /// Takes interval `index` of the upload: N = `points` LGR points, (N + 1) × 3 × axes `values`,
    /// node-major. One that has come before is taken as said: the commit's hash tells.
    pub fn load_interval(
        &mut self,
        index: u32,
        duration_ticks: u32,
        points: u8,
        values: impl ExactSizeIterator<Item = f32>,
    ) -> Result<(), Refusal> {
        let trajectory = self.buffers.loading_mut().ok_or(Refusal::NotLoading)?;
        let expected = trajectory.intervals().len() as u32;
        if index > expected {
            return Err(Refusal::Interval {
                expected,
                found: index,
            });
        }
        if index == expected {
            trajectory.append(duration_ticks, usize::from(points), values)?;
        }
        Ok(())
    }

    /// Intervals of the upload that have come, if one is under way.
    pub fn loaded_intervals(&self) -> Option<u32> {
        let trajectory = self.buffers.loading()?;
        Some(trajectory.intervals().len() as u32)
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
        let trajectory = self.buffers.loading_mut().ok_or(Refusal::NotLoading)?;
        let computed = trajectory.seal()?;
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
        self.buffers.abort();
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
        self.buffers.begin().copy_from(trajectory);
        self.finish_load(measured_rad)
    }

    /// [`Executor::load`] from the bytes of [`Trajectory::encode`], such as the stored ones.
    pub fn load_encoded(
        &mut self,
        bytes: &[u8],
        measured_rad: &SVector<f32, AXES>,
    ) -> Result<(), Refusal> {
        self.allows(Command::Load)?;
        if let Err(error) = self.buffers.begin().decode_from(bytes) {
            self.buffers.abort();
            return Err(error.into());
        }
        self.finish_load(measured_rad)
    }

    fn finish_load(&mut self, measured_rad: &SVector<f32, AXES>) -> Result<(), Refusal> {
        let accepted = self.accept_loading(measured_rad);
        if accepted.is_err() {
            self.buffers.abort();
        }
        accepted
    }

    /// All or nothing: checks what is in the second buffer, then lets the buffers change places.
    fn accept_loading(&mut self, measured_rad: &SVector<f32, AXES>) -> Result<(), Refusal> {
        let limits = self.limits.as_ref().ok_or(Refusal::NotConfigured)?;
        let trajectory = self.buffers.loading().ok_or(Refusal::NotLoading)?;
        accept::check(
            trajectory,
            limits,
            measured_rad.as_slice(),
            &self.config.accept,
        )?;
        let pace = Pace::of(trajectory, limits, self.config.ramp_s);
        self.buffers.swap()?;
        self.pace = pace;
        self.state = if self.is_driving() {
            State::Armed
        } else {
            State::Ready
        };
        self.dry_run = false;
        Ok(())
    }
}
