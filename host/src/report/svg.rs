//! Plots as SVG: small, without scripts, styled by class, so that one drawing serves light, dark, screen and paper.

use super::data::{Figure, LimitLine, Series};
use super::escape::Text;
use super::layout::{Frame, LINE_PX, Range, WIDTH, ranges};
use super::simplify::{columns, runs, straighten};
use super::ticks::minus;
use std::fmt::Write;

/// Styles of the plots, for the page that holds them.
pub(super) const STYLE: &str = include_str!("style.css");

/// Number of distinguishable line styles in [`STYLE`].
const STYLES: usize = 6;
/// How far a drawn line may lie off the data, in units of the picture.
const TOLERANCE: f64 = 0.08;

/// One plot of a figure.
pub(super) struct Panel<'f> {
    /// Its name, where there are several.
    pub(super) name: Option<&'f str>,
    pub(super) series: Vec<&'f Series>,
}

impl Figure {
    /// Its plots: runs of one curve each share one, runs of several have one each.
    pub(super) fn panels(&self) -> Vec<Panel<'_>> {
        let mut named: Vec<Panel<'_>> = Vec::new();
        for series in &self.series {
            match named.iter_mut().find(|p| p.name == Some(&series.run)) {
                Some(panel) => panel.series.push(series),
                None => named.push(Panel {
                    name: Some(&series.run),
                    series: vec![series],
                }),
            }
        }
        if named.len() < 2 || named.iter().all(|p| p.series.len() == 1) {
            return vec![Panel {
                name: None,
                series: self.series.iter().collect(),
            }];
        }
        named
    }

    /// The figure as an SVG file of its own, panels side by side, with its title.
    #[must_use]
    pub fn svg(&self) -> String {
        let panels = self.panels();
        let drawn: Vec<(String, f64)> = panels.iter().map(|p| self.draw(p)).collect();
        let (gap, head) = (14.0, 24.0);
        let width = drawn.len() as f64 * (WIDTH + gap) + gap;
        let height = drawn.iter().fold(0.0_f64, |m, d| m.max(d.1)) + head + 12.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height:.0}\" width=\"{:.0}\" \
             height=\"{:.0}\" class=\"plot\" role=\"img\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
             <rect class=\"back\" width=\"100%\" height=\"100%\"/>\n\
             <text class=\"name\" x=\"{gap}\" y=\"20\" font-size=\"14\">{title}</text>\n",
            width * 1.2,
            height * 1.2,
            title = Text(&self.title)
        );
        for (i, (content, _)) in drawn.iter().enumerate() {
            let x = gap + i as f64 * (WIDTH + gap);
            // Writing to a string cannot fail.
            let _ = write!(
                svg,
                "<g transform=\"translate({x} {head})\">\n{content}</g>\n"
            );
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// One panel as an SVG element for a page that has [`STYLE`].
    pub(super) fn panel_svg(&self, panel: &Panel<'_>) -> String {
        let (content, height) = self.draw(panel);
        let name = panel.name.map_or(String::new(), |n| format!(", {n}"));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" class=\"plot\" role=\"img\" \
             aria-label=\"{}{}\">\n{content}</svg>\n",
            Text(&self.title),
            Text(&name)
        )
    }

    /// Content and height of a panel.
    fn draw(&self, panel: &Panel<'_>) -> (String, f64) {
        let ranges = ranges(self);
        let mut out = String::new();
        let (outside, inside): (Vec<&LimitLine>, Vec<&LimitLine>) = self
            .limits
            .iter()
            .partition(|l| !ranges.shows_limit(l.value * self.y_factor));
        let top = self.legend(panel, &outside, &mut out);
        let frame = Frame::new(top, &ranges);
        self.axes(&frame, &ranges, &mut out);
        for moment in &self.moments {
            if ranges.x.contains(moment.time_s) {
                let x = frame.x(moment.time_s);
                let _ = writeln!(
                    out,
                    "<path class=\"moment\" d=\"M{x:.1} {:.1}V{:.1}\"><title>{}</title></path>",
                    frame.top,
                    frame.bottom,
                    Text(&moment.label)
                );
            }
        }
        for (i, series) in panel.series.iter().enumerate() {
            let path = self.path(series, &frame, &ranges.x);
            let name = self.name_in(panel, series);
            if !path.is_empty() {
                let _ = writeln!(
                    out,
                    "<path class=\"line s{}\" d=\"{path}\"><title>{}</title></path>",
                    i % STYLES,
                    Text(name)
                );
            }
        }
        if ranges.empty {
            let _ = writeln!(
                out,
                "<text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">no data</text>",
                (frame.left + frame.right) / 2.0,
                (frame.top + frame.bottom) / 2.0
            );
        }
        for limit in inside {
            self.limit(limit, &frame, &ranges.y, &mut out);
        }
        (out, frame.height)
    }

    /// What a series is called in a panel: its run where the panel shows several.
    fn name_in<'s>(&self, panel: &Panel<'_>, series: &'s Series) -> &'s str {
        let overlay = panel.series.iter().any(|s| s.run != series.run);
        if overlay { &series.run } else { &series.label }
    }

    /// Panel name and legend; returns where they end.
    fn legend(&self, panel: &Panel<'_>, outside: &[&LimitLine], out: &mut String) -> f64 {
        let mut y = 2.0;
        if let Some(name) = panel.name {
            y += LINE_PX;
            let _ = writeln!(
                out,
                "<text class=\"name\" x=\"2\" y=\"{:.1}\">{}</text>",
                y - 4.0,
                Text(name)
            );
        }
        let (mut x, mut row) = (2.0, y + LINE_PX);
        let mut place = |width: f64| {
            if x > 2.0 && x + width > WIDTH {
                (x, row) = (2.0, row + LINE_PX);
            }
            let at = (x, row);
            x += width + 12.0;
            at
        };
        for (i, series) in panel.series.iter().enumerate() {
            let name = self.name_in(panel, series);
            let (x, y) = place(30.0 + text_width(name));
            let _ = writeln!(
                out,
                "<path class=\"line s{}\" d=\"M{x:.1} {:.1}h25\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                i % STYLES,
                y - 8.0,
                x + 30.0,
                y - 4.0,
                Text(name)
            );
        }
        for moment in &self.moments {
            let (x, y) = place(10.0 + text_width(&moment.label));
            let _ = writeln!(
                out,
                "<path class=\"moment\" d=\"M{:.1} {:.1}v12\"/><text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + 3.0,
                y - 14.0,
                x + 10.0,
                y - 4.0,
                Text(&moment.label)
            );
        }
        for limit in outside {
            let text = format!("{}: outside the plot", self.limit_text(limit));
            let (x, y) = place(text_width(&text));
            let _ = writeln!(
                out,
                "<text class=\"limit-text\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>",
                y - 4.0,
                Text(&text)
            );
        }
        row + 2.0
    }

    fn axes(&self, frame: &Frame, ranges: &super::layout::Ranges, out: &mut String) {
        let Frame {
            left,
            right,
            top,
            bottom,
            ..
        } = *frame;
        let unit = format!("{}{}", ranges.y.ticks.factor(), self.y_unit);
        let unit = if unit.is_empty() {
            unit
        } else {
            format!(" ({unit})")
        };
        let _ = writeln!(
            out,
            "<text class=\"soft\" x=\"2\" y=\"{:.1}\">{}{}</text>",
            top - 9.0,
            Text(&self.y_label),
            Text(&unit)
        );
        for (value, label) in ranges.y.ticks.at.iter().zip(&ranges.y.ticks.labels) {
            let y = frame.y(*value);
            // Zero stands out.
            let class = if label.trim_matches(['0', '.']).is_empty() {
                "axis"
            } else {
                "grid"
            };
            let _ = writeln!(
                out,
                "<path class=\"{class}\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>\
                 <text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                left - 5.0,
                y + 4.0
            );
        }
        for (value, label) in ranges.x.ticks.at.iter().zip(&ranges.x.ticks.labels) {
            let x = frame.x(*value);
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
             <text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}{}</text>",
            (left + right) / 2.0,
            bottom + 31.0,
            Text(&ranges.x.ticks.factor()),
            Text(&self.x_label)
        );
    }

    fn path(&self, series: &Series, frame: &Frame, window: &Range) -> String {
        let points = series
            .time_s
            .iter()
            .zip(&series.values)
            .map(|(t, v)| [frame.x(*t), frame.y(super::layout::sane(v * self.y_factor))]);
        let mut path = String::new();
        for run in runs(points, frame.x(window.low), frame.x(window.high)) {
            let thin = straighten(&columns(&run, 0.5), TOLERANCE);
            for (i, [x, y]) in thin.iter().enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
            }
        }
        path
    }

    fn limit(&self, limit: &LimitLine, frame: &Frame, range: &Range, out: &mut String) {
        let value = (limit.value * self.y_factor).abs();
        for y in [value, -value] {
            if range.contains(y) {
                let y = frame.y(y);
                let _ = writeln!(
                    out,
                    "<path class=\"limit\" d=\"M{:.1} {y:.1}H{:.1}\"/>",
                    frame.left, frame.right
                );
            }
        }
        let text = self.limit_text(limit);
        let (y, below) = if range.contains(value) {
            (frame.y(value), false)
        } else {
            (frame.y(-value), true)
        };
        let _ = writeln!(
            out,
            "<text class=\"limit-text halo\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            frame.right - 3.0,
            if below { y + 12.0 } else { y - 4.0 },
            Text(&text)
        );
    }

    fn limit_text(&self, limit: &LimitLine) -> String {
        let value = limit.value * self.y_factor;
        let digits = if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
            format!("{value:.2e}")
        } else {
            // Four digits, and not the zeros of the last ones.
            let before = value.abs().log10().floor().max(-3.0) as i32;
            let decimals = usize::try_from(3 - before).unwrap_or(0).min(6);
            let short = format!("{value:.decimals$}");
            match short.contains('.') {
                true => short.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => short,
            }
        };
        format!("{} ±{} {}", limit.label, minus(&digits), self.y_unit)
            .trim_end()
            .to_owned()
    }
}

/// About how wide a text is: fonts differ, and nothing depends on it but where a legend wraps.
fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * 7.0
}
