//! How the time of a move is divided into intervals of collocation points.

/// One interval of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Share of the whole duration; all shares add up to 1.
    pub fraction: f64,
    /// Number N of LGR points.
    pub points: usize,
}

/// Intervals in the order of time, each with its own number of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    intervals: Vec<Interval>,
}

impl Mesh {
    /// `intervals` equal intervals of `points` points each.
    ///
    /// # Panics
    /// If there is no interval, or fewer than two points.
    #[must_use]
    pub fn uniform(intervals: usize, points: usize) -> Self {
        Self::new(vec![
            Interval {
                fraction: 1.0 / intervals as f64,
                points
            };
            intervals
        ])
    }

    /// Any intervals; fractions are normalised.
    ///
    /// # Panics
    /// If there is no interval, a fraction is not positive, or an interval has fewer than two points.
    #[must_use]
    pub fn new(mut intervals: Vec<Interval>) -> Self {
        assert!(!intervals.is_empty(), "a mesh has at least one interval");
        let total: f64 = intervals.iter().map(|i| i.fraction).sum();
        for interval in &mut intervals {
            assert!(interval.points >= 2, "an interval has at least two points");
            assert!(interval.fraction > 0.0, "an interval has a positive length");
            interval.fraction /= total;
        }
        Self { intervals }
    }

    /// The same intervals with more points in each.
    #[must_use]
    pub fn with_more_points(&self, more: usize) -> Self {
        let mut finer = self.clone();
        for interval in &mut finer.intervals {
            interval.points += more;
        }
        finer
    }

    /// The intervals.
    #[must_use]
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// Number of collocation points in all.
    #[must_use]
    pub fn points(&self) -> usize {
        self.intervals.iter().map(|i| i.points).sum()
    }
}
