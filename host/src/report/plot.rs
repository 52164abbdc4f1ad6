//! Axes and area of a plot of points and curves.

use super::escape::Text;
use super::layout::sane;
use super::ticks::Ticks;
use std::fmt::Write;

/// One axis: its range, its marks, and whether it counts factors.
pub(super) struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// From the least to the largest value, and a share of their distance besides.
    pub(super) fn linear(values: impl Iterator<Item = f64>, margin: f64) -> Self {
        let (low, high) = extent(values).unwrap_or((0.0, 1.0));
        let room = (margin * (high - low)).max(1e-9 * high.abs().max(1e-9));
        let (low, high) = (low - if low == 0.0 { 0.0 } else { room }, high + room);
        let ticks = Ticks::new(low, high, 7);
        Self {
            low,
            high,
            logarithmic: false,
            ticks: ticks.at.into_iter().zip(ticks.labels).collect(),
        }
    }

    /// The same by factors, for positive values.
    pub(super) fn logarithmic(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values).unwrap_or((1.0, 10.0));
        let (low, high) = (0.75 * low, 1.35 * high);
        let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|step| step * 10_f64.powi(power)));
        let ticks = steps
            .filter(|at| (low..=high).contains(at))
            .map(|at| (at, format!("{}", (at * 1e9).round() / 1e9)))
            .collect();
        Self {
            low,
            high,
            logarithmic: true,
            ticks,
        }
    }

    /// Share of the axis at which a value stands.
    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let values = values.map(sane).filter(|v| v.is_finite());
    values.fold(None, |found, v| {
        Some(found.map_or((v, v), |(low, high): (f64, f64)| (low.min(v), high.max(v))))
    })
}

/// Two axes and the area between them.
pub(super) struct Plot {
    origin: [f64; 2],
    size: [f64; 2],
    x: Axis,
    y: Axis,
}

impl Plot {
    /// With its upper left corner at `origin`.
    pub(super) fn new(origin: [f64; 2], size: [f64; 2], x: Axis, y: Axis) -> Self {
        Self { origin, size, x, y }
    }

    pub(super) fn left(&self) -> f64 {
        self.origin[0]
    }

    pub(super) fn right(&self) -> f64 {
        self.origin[0] + self.size[0]
    }

    pub(super) fn top(&self) -> f64 {
        self.origin[1]
    }

    pub(super) fn bottom(&self) -> f64 {
        self.origin[1] + self.size[1]
    }

    pub(super) fn x(&self, value: f64) -> f64 {
        self.left() + self.size[0] * self.x.share(value)
    }

    pub(super) fn y(&self, value: f64) -> f64 {
        self.bottom() - self.size[1] * self.y.share(value)
    }

    /// Grid, marks and titles.
    pub(super) fn frame(&self, heading: &str, y_title: &str, x_title: &str, out: &mut String) {
        let [left, right, top, bottom] = [self.left(), self.right(), self.top(), self.bottom()];
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "<text x=\"{left:.1}\" y=\"{:.1}\" class=\"name\">{}</text>\
             <text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            top - 56.0,
            Text(heading),
            left - 34.0,
            top - 9.0,
            Text(y_title)
        );
        for (value, label) in &self.y.ticks {
            let y = self.y(*value);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>\
                 <text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                left - 6.0,
                y + 4.0
            );
        }
        for (value, label) in &self.x.ticks {
            let x = self.x(*value);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{x:.1} {top:.1}V{bottom:.1}\"/>\
                 <text class=\"soft\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                bottom + 15.0
            );
        }
        let _ = writeln!(
            out,
            "<path class=\"axis\" d=\"M{left:.1} {top:.1}V{bottom:.1}H{right:.1}\"/>\
             <text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            (left + right) / 2.0,
            bottom + 32.0,
            Text(x_title)
        );
    }

    /// A curve as far as it is below `top`, cut where it crosses it; missing where values are not finite.
    pub(super) fn path(&self, curve: &[(f64, f64)], top: f64) -> String {
        let mut path = String::new();
        let point = |[x, y]: [f64; 2]| format!("{:.1} {:.1}", self.x(x), self.y(y));
        for pair in curve.windows(2) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            if !(y0.is_finite() && y1.is_finite()) || (y0 > top && y1 > top) {
                continue;
            }
            let crossing = |y: f64| {
                if y1 == y0 {
                    x0
                } else {
                    x0 + (x1 - x0) * (y - y0) / (y1 - y0)
                }
            };
            let cut = |x: f64, y: f64| {
                if y > top {
                    [crossing(top), top]
                } else {
                    [x, y]
                }
            };
            let _ = write!(path, "M{}L{}", point(cut(x0, y0)), point(cut(x1, y1)));
        }
        path
    }
}
