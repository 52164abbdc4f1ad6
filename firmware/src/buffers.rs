//! Two trajectories: the one that plays and the one that loads.

use stillpoint_shared::{Sample, Schedule, Trajectory, TrajectoryError};

/// Two trajectory buffers and the schedule of the one that plays. All bytes of an empty one are
/// zero.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Buffers {
    second_plays: bool,
    loading: bool,
    /// The interval that was last evaluated.
    near: u16,
    schedule: Schedule,
    trajectories: [Trajectory; 2],
}

impl Buffers {
    pub(crate) const fn empty() -> Self {
        Self {
            trajectories: [Trajectory::empty(), Trajectory::empty()],
            second_plays: false,
            loading: false,
            near: 0,
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

    /// The buffer to load into; what comes is under way until [`Buffers::swap`] or
    /// [`Buffers::abort`].
    pub(crate) fn begin(&mut self) -> &mut Trajectory {
        self.loading = true;
        self.spare_mut()
    }

    /// The trajectory that loads.
    pub(crate) fn loading(&self) -> Option<&Trajectory> {
        let [first, second] = &self.trajectories;
        self.loading
            .then_some(if self.second_plays { first } else { second })
    }

    pub(crate) fn loading_mut(&mut self) -> Option<&mut Trajectory> {
        self.loading.then(|| self.spare_mut())
    }

    fn spare_mut(&mut self) -> &mut Trajectory {
        let [first, second] = &mut self.trajectories;
        if self.second_plays { first } else { second }
    }

    pub(crate) fn abort(&mut self) {
        self.loading = false;
    }

    /// Makes the one that was loaded the one that plays. If it cannot be prepared, the old one goes
    /// on.
    pub(crate) fn swap(&mut self) -> Result<(), TrajectoryError> {
        self.second_plays = !self.second_plays;
        let prepared = self.prepare();
        if prepared.is_err() {
            self.second_plays = !self.second_plays;
            // It was prepared before: this cannot fail.
            let _ = self.prepare();
        } else {
            self.loading = false;
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
        self.loading = false;
        for trajectory in &mut self.trajectories {
            trajectory.clear();
        }
        // Nothing always fits: this cannot fail.
        let _ = self.prepare();
    }
}
