//! Two trajectories: the one that plays and the one that loads.

use stillpoint_shared::assembly::{Arrived, Assembly, Outline};
use stillpoint_shared::player::Near;
use stillpoint_shared::{Sample, Schedule, Trajectory, TrajectoryError};

/// Two trajectory buffers and the schedule of the one that plays. All bytes of an empty one are
/// zero.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Buffers {
    second_plays: bool,
    loading: bool,
    /// Where it was last evaluated.
    near: Near,
    assembly: Assembly,
    schedule: Schedule,
    trajectories: [Trajectory; 2],
}

impl Buffers {
    pub(crate) const fn empty() -> Self {
        Self {
            trajectories: [Trajectory::empty(), Trajectory::empty()],
            second_plays: false,
            loading: false,
            near: Near::START,
            assembly: Assembly::NONE,
            schedule: Schedule::empty(),
        }
    }

    /// The trajectory that plays; without intervals if there is none.
    #[inline]
    pub(crate) fn playing(&self) -> &Trajectory {
        let [first, second] = &self.trajectories;
        if self.second_plays { second } else { first }
    }

    /// Whether there is one to play.
    pub(crate) fn is_loaded(&self) -> bool {
        self.playing().intervals().len() > 0
    }

    /// The values of the one that plays, for times that mostly advance.
    #[inline]
    pub(crate) fn sample<const AXES: usize>(&mut self, ticks: u32) -> Option<Sample<AXES>> {
        let [first, second] = &self.trajectories;
        let playing = if self.second_plays { second } else { first };
        self.schedule.sample_near(playing, ticks, &mut self.near)
    }

    /// Begins an upload, or goes on with the same one; it is under way until [`Buffers::swap`] or
    /// [`Buffers::abort`].
    pub(crate) fn begin(&mut self, outline: &Outline) -> Result<(), TrajectoryError> {
        self.loading = false;
        let [first, second] = &mut self.trajectories;
        let place = if self.second_plays { first } else { second };
        self.assembly.begin(outline, place)?;
        self.loading = true;
        Ok(())
    }

    /// The upload under way.
    pub(crate) fn loading(&mut self) -> Option<(&mut Assembly, &mut Trajectory)> {
        let [first, second] = &mut self.trajectories;
        let place = if self.second_plays { first } else { second };
        self.loading.then_some((&mut self.assembly, place))
    }

    /// Which blocks of the upload have arrived.
    pub(crate) fn arrived(&self) -> Arrived {
        if self.loading {
            self.assembly.arrived()
        } else {
            Arrived::default()
        }
    }

    /// The buffer that does not play.
    pub(crate) fn spare(&self) -> &Trajectory {
        let [first, second] = &self.trajectories;
        if self.second_plays { first } else { second }
    }

    /// The buffer that does not play, to write a whole trajectory into. An upload under way is
    /// forgotten.
    pub(crate) fn spare_mut(&mut self) -> &mut Trajectory {
        self.forget();
        let [first, second] = &mut self.trajectories;
        if self.second_plays { first } else { second }
    }

    /// Ends the upload. Begun again, it goes on where it was.
    pub(crate) fn abort(&mut self) {
        self.loading = false;
    }

    /// Throws the upload away.
    pub(crate) fn forget(&mut self) {
        self.loading = false;
        self.assembly = Assembly::NONE;
    }

    /// Makes the one in the spare buffer the one that plays. If it cannot be prepared, the old one goes
    /// on.
    pub(crate) fn swap(&mut self) -> Result<(), TrajectoryError> {
        self.second_plays = !self.second_plays;
        let prepared = self.prepare();
        if prepared.is_err() {
            self.second_plays = !self.second_plays;
            // It was prepared before: this cannot fail.
            let _ = self.prepare();
        } else {
            self.forget();
        }
        prepared
    }

    fn prepare(&mut self) -> Result<(), TrajectoryError> {
        let [first, second] = &self.trajectories;
        self.schedule
            .prepare(if self.second_plays { second } else { first })
    }

    /// Forgets both.
    pub(crate) fn clear(&mut self) {
        self.forget();
        for trajectory in &mut self.trajectories {
            trajectory.clear();
        }
        // Nothing always fits: this cannot fail.
        let _ = self.prepare();
    }
}
