//! Which part of the data a plot shows, and where on the paper.

use super::data::Figure;
use super::ticks::Ticks;

/// Width of a plot in units of the picture. Text is 12 units high: 11 pixels on a phone, 15 in two columns on a desk.
pub(super) const WIDTH: f64 = 400.0;
/// Height of the area with the curves.
const AREA: f64 = 170.0;
/// Height of a line of text.
pub(super) const LINE_PX: f64 = 17.0;
/// A limit this many times larger than everything else would flatten the curves: it is told, not drawn.
const LIMIT_REACH: f64 = 2.5;

/// An interval of values and its marks.
pub(super) struct Range {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) ticks: Ticks,
}

impl Range {
    fn new(low: f64, high: f64, most: usize) -> Self {
        Self {
            low,
            high,
            ticks: Ticks::new(low, high, most),
        }
    }

    pub(super) fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// What a figure shows, the same in all its panels.
pub(super) struct Ranges {
    pub(super) x: Range,
    pub(super) y: Range,
    /// There is no data at all.
    pub(super) empty: bool,
    largest: f64,
}

impl Ranges {
    /// Whether a limit is drawn.
    pub(super) fn shows_limit(&self, value: f64) -> bool {
        reaches(sane(value), self.largest)
    }
}

fn reaches(limit: f64, largest: f64) -> bool {
    limit.is_finite() && (largest <= 0.0 || limit.abs() <= LIMIT_REACH * largest)
}

/// A value that arithmetic can plot: what is too large is missing, what is too small is zero.
pub(super) fn sane(value: f64) -> f64 {
    match value.abs() {
        size if size < 1e-100 => 0.0,
        size if size < 1e100 => value,
        _ => f64::NAN,
    }
}

/// Smallest and largest of what is there.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.is_finite()).fold(None, |found, v| {
        Some(found.map_or((v, v), |(low, high): (f64, f64)| (low.min(v), high.max(v))))
    })
}

/// Widens an interval that is too narrow to be one.
fn open((low, high): (f64, f64)) -> (f64, f64) {
    let least = 1e-6 * low.abs().max(high.abs());
    if high - low > least {
        return (low, high);
    }
    let half = if least > 0.0 { 1e5 * least } else { 1.0 };
    (low - half, high + half)
}

/// Finds the ranges of a figure.
pub(super) fn ranges(figure: &Figure) -> Ranges {
    let times = || {
        figure
            .series
            .iter()
            .flat_map(|s| s.time_s.iter().map(|t| sane(*t)))
    };
    let x = figure
        .window_s
        .map(|(a, b)| (sane(a), sane(b)))
        .filter(|(a, b)| a < b)
        .or_else(|| extent(times()))
        .map_or((0.0, 1.0), open);
    let in_window = figure.series.iter().flat_map(|s| {
        let pairs = s.time_s.iter().zip(&s.values);
        pairs
            .filter(|(t, _)| (x.0..=x.1).contains(*t))
            .map(|(_, v)| sane(v * figure.y_factor))
    });
    let data = extent(in_window);
    let largest = data.map_or(0.0, |(low, high)| low.abs().max(high.abs()));
    let limits = figure
        .limits
        .iter()
        .map(|l| sane(l.value * figure.y_factor));
    let signed = limits.filter(|l| reaches(*l, largest)).flat_map(|l| {
        // The limit on a side that nothing comes near says nothing.
        let near = |bound: f64| match data {
            Some((low, high)) => bound * if bound > 0.0 { high } else { low } > 0.0,
            None => true,
        };
        [l, -l].into_iter().filter(move |bound| near(*bound))
    });
    let (low, high) =
        extent(data.into_iter().flat_map(|(a, b)| [a, b]).chain(signed)).map_or((-1.0, 1.0), open);
    let margin = 0.06 * (high - low);
    Ranges {
        x: Range::new(x.0, x.1, 7),
        y: Range::new(low - margin, high + margin, 6),
        empty: data.is_none(),
        largest,
    }
}

/// Where the curves are on the paper.
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
    /// Of the whole panel.
    pub(super) height: f64,
    origin: [f64; 2],
    scale: [f64; 2],
}

impl Frame {
    /// Below a legend that ends at `legend_end`.
    pub(super) fn new(legend_end: f64, ranges: &Ranges) -> Self {
        let longest = ranges
            .y
            .ticks
            .labels
            .iter()
            .map(|l| l.chars().count())
            .max();
        let left = 10.0 + 8.0 * longest.unwrap_or(1) as f64;
        let right = WIDTH - 14.0;
        let top = legend_end + LINE_PX + 6.0;
        let bottom = top + AREA;
        Self {
            left,
            right,
            top,
            bottom,
            height: bottom + 36.0,
            origin: [ranges.x.low, ranges.y.low],
            scale: [
                (right - left) / (ranges.x.high - ranges.x.low),
                (bottom - top) / (ranges.y.high - ranges.y.low),
            ],
        }
    }

    pub(super) fn x(&self, value: f64) -> f64 {
        self.left + (value - self.origin[0]) * self.scale[0]
    }

    pub(super) fn y(&self, value: f64) -> f64 {
        self.bottom - (value - self.origin[1]) * self.scale[1]
    }
}
