//! Evaluation of a trajectory at any time: the same bits on host and board.

use heapless::Vec;

use crate::Trajectory;
use crate::basis::{Basis, MAX_SUPPORT};
use crate::time::LocalTime;
use crate::trajectory::{MAX_BASES, MAX_INTERVALS, QUANTITIES, TrajectoryError};

/// What every axis should do at one time, at the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<const AXES: usize> {
    /// Positions in rad.
    pub position_rad: [f32; AXES],
    /// Velocities in rad/s.
    pub velocity_rad_per_s: [f32; AXES],
    /// Torques in N·m.
    pub torque_nm: [f32; AXES],
}

impl<const AXES: usize> Sample<AXES> {
    fn from_row([position_rad, velocity_rad_per_s, torque_nm]: [[f32; AXES]; QUANTITIES]) -> Self {
        Self {
            position_rad,
            velocity_rad_per_s,
            torque_nm,
        }
    }
}

/// An interval, ready to evaluate.
#[derive(Debug, Clone, Copy)]
struct Span {
    start_ticks: u32,
    local: LocalTime,
    basis: u8,
    first_row: u16,
}

/// What one evaluation leaves to the next.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    interval: u16,
    /// Room for the products.
    products: [f32; MAX_SUPPORT],
}

impl Near {
    /// The first interval. All bytes are zero.
    pub const START: Self = Self {
        interval: 0,
        products: [0.0; MAX_SUPPORT],
    };
}

/// What evaluating a trajectory takes beside its coefficients: where its intervals lie and the
/// bases they use, so that nothing is divided while it plays.
///
/// A board with two trajectory buffers has one schedule, of the one that plays.
#[derive(Debug, Clone)]
pub struct Schedule {
    spans: Vec<Span, MAX_INTERVALS>,
    bases: Vec<Basis, MAX_BASES>,
}

impl Schedule {
    /// A schedule of nothing.
    pub const fn empty() -> Self {
        Self {
            spans: Vec::new(),
            bases: Vec::new(),
        }
    }

    /// Makes this the schedule of `trajectory`. Every trajectory that could be made fits.
    pub fn prepare(&mut self, trajectory: &Trajectory) -> Result<(), TrajectoryError> {
        self.spans.clear();
        self.bases.clear();
        let mut first_row = 0;
        for (index, interval) in trajectory.intervals().enumerate() {
            let span = Span {
                start_ticks: interval.start_ticks,
                local: LocalTime::new(interval.duration_ticks),
                basis: self.basis(index, interval.points)?,
                first_row,
            };
            first_row += interval.points as u16 + 1;
            self.spans
                .push(span)
                .map_err(|_| TrajectoryError::TooManyIntervals {
                    intervals: index + 1,
                })?;
        }
        Ok(())
    }

    /// Index of the basis on N = `points` points, prepared if it is the first of its kind.
    fn basis(&mut self, interval: usize, points: usize) -> Result<u8, TrajectoryError> {
        if let Some(index) = self.bases.iter().position(|basis| basis.points() == points) {
            return Ok(index as u8);
        }
        if self.bases.is_full() {
            return Err(TrajectoryError::TooManyBases { interval });
        }
        // There is room: this cannot fail.
        let _ = self.bases.push(Basis::EMPTY);
        if let Some(basis) = self.bases.last_mut() {
            basis
                .prepare(points)
                .map_err(|_| TrajectoryError::Points { interval, points })?;
        }
        Ok(self.bases.len() as u8 - 1)
    }

    /// The values of `trajectory`, which this is the schedule of, at `ticks` after the start; the
    /// last node's, exactly, from the end on. `None` if there is nothing to evaluate.
    ///
    /// An interval owns its start, where the local coordinate is exactly −1. Cost: at most a binary
    /// search over the intervals, then about (4 + 6 AXES) (N + 1) multiplications and additions.
    #[inline]
    pub fn sample<const AXES: usize>(
        &self,
        trajectory: &Trajectory,
        ticks: u32,
    ) -> Option<Sample<AXES>> {
        let mut anywhere = Near::START;
        self.sample_near(trajectory, ticks, &mut anywhere)
    }

    /// [`Schedule::sample`] without the search, for times that mostly advance.
    #[inline]
    pub fn sample_near<const AXES: usize>(
        &self,
        trajectory: &Trajectory,
        ticks: u32,
        near: &mut Near,
    ) -> Option<Sample<AXES>> {
        let rows = rows(trajectory);
        if ticks >= trajectory.duration_ticks() {
            return rows.last().map(|&row| Sample::from_row(row));
        }
        let span = self.span_at(ticks, &mut near.interval)?;
        let x = span.local.coordinate(ticks - span.start_ticks);
        let basis = self.bases.get(usize::from(span.basis))?;
        let rows = rows.get(usize::from(span.first_row)..)?;
        Some(Sample::from_row(basis.evaluate(
            x,
            rows,
            &mut near.products,
        )))
    }

    /// The last interval that starts at `ticks` or before.
    #[inline]
    fn span_at(&self, ticks: u32, near: &mut u16) -> Option<&Span> {
        match self.spans.get(usize::from(*near)) {
            Some(span) if span.local.contains(ticks.wrapping_sub(span.start_ticks)) => Some(span),
            _ => self.search(ticks, near),
        }
    }

    #[cold]
    fn search(&self, ticks: u32, near: &mut u16) -> Option<&Span> {
        let following = self.spans.partition_point(|span| span.start_ticks <= ticks);
        let index = following.checked_sub(1)?;
        *near = index as u16;
        self.spans.get(index)
    }
}

fn rows<const AXES: usize>(trajectory: &Trajectory) -> &[[[f32; AXES]; QUANTITIES]] {
    trajectory.coefficients().as_chunks().0.as_chunks().0
}

impl<const AXES: usize> Sample<AXES> {
    /// The first node's values, where a machine must stand. `None` if there is none.
    pub fn first(trajectory: &Trajectory) -> Option<Self> {
        rows(trajectory).first().map(|&row| Self::from_row(row))
    }

    /// The last node's values. `None` if there is none.
    pub fn last(trajectory: &Trajectory) -> Option<Self> {
        rows(trajectory).last().map(|&row| Self::from_row(row))
    }
}

/// A trajectory of AXES axes with its schedule.
#[derive(Debug, Clone)]
pub struct Player<const AXES: usize> {
    trajectory: Trajectory,
    schedule: Schedule,
}

impl<const AXES: usize> Player<AXES> {
    /// A player with nothing to play.
    pub const fn empty() -> Self {
        Self {
            trajectory: Trajectory::empty(),
            schedule: Schedule::empty(),
        }
    }

    /// A player of a copy of `trajectory`.
    pub fn new(trajectory: &Trajectory) -> Result<Self, TrajectoryError> {
        let mut player = Self::empty();
        player.load(trajectory)?;
        Ok(player)
    }

    /// Copies `trajectory` in and prepares its schedule. If it has another number of axes, nothing
    /// is changed.
    pub fn load(&mut self, trajectory: &Trajectory) -> Result<(), TrajectoryError> {
        if trajectory.axes() != AXES {
            return Err(TrajectoryError::OtherAxes {
                found: trajectory.axes(),
                expected: AXES,
            });
        }
        self.trajectory.copy_from(trajectory);
        self.schedule.prepare(trajectory)
    }

    /// The trajectory being played.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// [`Schedule::sample`] of the trajectory.
    #[inline]
    pub fn sample(&self, ticks: u32) -> Option<Sample<AXES>> {
        self.schedule.sample(&self.trajectory, ticks)
    }

    /// [`Sample::first`] of the trajectory.
    pub fn first(&self) -> Option<Sample<AXES>> {
        Sample::first(&self.trajectory)
    }
}
