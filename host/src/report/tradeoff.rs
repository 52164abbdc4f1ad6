//! Duration against what is left, and what is left over the payload: the picture of a comparison of planners.

use super::escape::Text;
use super::plot::{Axis, Plot};
use std::fmt::Write;

/// A comparison to be drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tradeoff {
    /// Title.
    pub title: String,
    /// What is left, with its unit.
    pub residual: String,
    /// Heading of the left plot.
    pub worst: String,
    /// Heading of the right plot.
    pub sweep: String,
    /// What the marks mean.
    pub marks: Vec<(Mark, String)>,
    /// What is on its horizontal axis.
    pub parameter: String,
    /// Who is compared, the most important ones first.
    pub contenders: Vec<Contender>,
}

/// One planner.
#[derive(Clone, Debug, PartialEq)]
pub struct Contender {
    /// Its name.
    pub name: String,
    /// How it is marked.
    pub mark: Mark,
    /// Whether it is named and its curve drawn.
    pub named: bool,
    /// Duration in ms.
    pub duration_ms: f64,
    /// The most that is left, in the unit shown.
    pub worst: f64,
    /// What is left over the parameter, in the unit shown.
    pub curve: Vec<(f64, f64)>,
}

/// Shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A full disc.
    Disc,
    /// A square.
    Square,
    /// A triangle.
    Triangle,
}

/// Size of a plot's area, and of what is around it.
const AREA: [f64; 2] = [350.0, 250.0];
const LEFT: f64 = 44.0;
const TOP: f64 = 104.0;
const GAP: f64 = 78.0;
/// Colours in the style sheet.
const COLOURS: usize = 6;
/// Height of a line of text, and mean width of a letter.
const LETTER: [f64; 2] = [6.3, 13.0];

impl Mark {
    fn svg(self, x: f64, y: f64, class: &str) -> String {
        match self {
            Self::Disc => {
                format!("<circle class=\"dot full {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\">")
            }
            Self::Square => format!(
                "<rect class=\"dot {class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\">",
                x - 4.0,
                y - 4.0
            ),
            Self::Triangle => format!(
                "<path class=\"dot {class}\" d=\"M{x:.1} {:.1}l5 9h-10z\">",
                y - 5.5
            ),
        }
    }

    fn end(self) -> &'static str {
        match self {
            Self::Disc => "</circle>",
            Self::Square => "</rect>",
            Self::Triangle => "</path>",
        }
    }
}

impl Tradeoff {
    /// The picture as an SVG file of its own.
    #[must_use]
    pub fn svg(&self) -> String {
        let (width, height) = (LEFT + 2.0 * AREA[0] + GAP + 22.0, TOP + AREA[1] + 46.0);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{:.0}\" height=\"{:.0}\" \
             class=\"plot\" role=\"img\">\n<title>{title}</title>\n<style>{}</style>\n\
             <rect class=\"back\" width=\"100%\" height=\"100%\"/>\n\
             <text class=\"name\" x=\"8\" y=\"20\" font-size=\"14\">{title}</text>\n",
            width * 1.2,
            height * 1.2,
            super::svg::STYLE,
            title = Text(&self.title)
        );
        self.durations(&mut out);
        self.curves(&mut out);
        out.push_str("</svg>\n");
        out
    }

    /// The picture for a page that has the style.
    pub(super) fn inline(&self) -> String {
        let svg = self.svg();
        match (svg.find("<style>"), svg.find("</style>")) {
            (Some(from), Some(to)) => svg[..from].to_owned() + &svg[to + "</style>".len()..],
            _ => svg,
        }
    }

    /// Class of the nth contender that is named; those that are not have the last one.
    fn class(&self, index: usize) -> String {
        let named = self.contenders[..index].iter().filter(|c| c.named).count();
        match self.contenders[index].named {
            true => format!("s{}", named % COLOURS),
            false => "other".to_owned(),
        }
    }

    fn durations(&self, out: &mut String) {
        let all = || self.contenders.iter().enumerate();
        let x = Axis::linear(all().map(|(_, c)| c.duration_ms), 0.12);
        let y = Axis::logarithmic(all().map(|(_, c)| c.worst).filter(|left| *left > 0.0));
        let plot = Plot::new([LEFT, TOP], AREA, x, y);
        plot.frame(&self.worst, &self.residual, "duration (ms)", out);
        // What is stopped stands at the upper edge.
        let at = |c: &Contender| {
            let y = match c.worst.is_finite() {
                true => plot.y(c.worst).min(plot.bottom()),
                false => plot.top() + 7.0,
            };
            [plot.x(c.duration_ms), y]
        };
        let mut x = plot.left();
        for (mark, name) in &self.marks {
            let y = TOP - 36.0;
            let class = if *mark == Mark::Disc { "s0" } else { "other" };
            let _ = writeln!(
                out,
                "{}{}<text class=\"soft\" x=\"{:.1}\" y=\"{:.1}\" font-size=\"11\">{}</text>",
                mark.svg(x + 5.0, y - 4.0, class),
                mark.end(),
                x + 14.0,
                y,
                Text(name)
            );
            x += 34.0 + LETTER[0] * name.chars().count() as f64;
        }
        // Boxes that no name may cover: the marks, then the names placed.
        let mut taken: Vec<[f64; 4]> = all()
            .map(|(_, c)| at(c))
            .map(|[x, y]| [x - 6.0, y - 6.0, x + 6.0, y + 6.0])
            .collect();
        for (index, c) in all().filter(|(_, c)| c.named) {
            let bold = if c.mark == Mark::Disc { " name" } else { "" };
            let stops = if c.worst.is_finite() { "" } else { ": stops" };
            let name = format!("{}{stops}", c.name);
            let spot = place(&name, at(c), &plot, &taken);
            taken.push(spot.covers);
            let _ = writeln!(
                out,
                "<text class=\"halo{bold}\" style=\"fill:var(--{})\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                self.class(index),
                spot.at[0],
                spot.at[1],
                Text(&name)
            );
        }
        // The unnamed ones first, below the others.
        let mut order: Vec<_> = all().collect();
        order.sort_by_key(|(_, c)| c.named);
        for (index, c) in order {
            let [x, y] = at(c);
            let left = match c.worst.is_finite() {
                true => format!("{:.1}", c.worst),
                false => "stops".to_owned(),
            };
            let _ = writeln!(
                out,
                "{}<title>{}: {:.1} ms, {left}</title>{}",
                c.mark.svg(x, y, &self.class(index)),
                Text(&c.name),
                c.duration_ms,
                c.mark.end()
            );
        }
    }

    fn curves(&self, out: &mut String) {
        let named = || self.contenders.iter().enumerate().filter(|(_, c)| c.named);
        // One that leaves far more than all others would flatten them: it leaves the plot at the top.
        let mut most: Vec<f64> = named()
            .map(|(_, c)| c.curve.iter().map(|p| p.1).filter(|v| v.is_finite()))
            .map(|values| values.fold(0.0, f64::max))
            .collect();
        most.sort_by(f64::total_cmp);
        let second = most.len().checked_sub(2).and_then(|i| most.get(i));
        let top = 1.12 * second.or(most.last()).copied().unwrap_or(1.0);
        let x = Axis::linear(named().flat_map(|(_, c)| c.curve.iter().map(|p| p.0)), 0.0);
        let y = Axis::linear([0.0, top.max(f64::MIN_POSITIVE)].into_iter(), 0.0);
        let plot = Plot::new([LEFT + AREA[0] + GAP, TOP], AREA, x, y);
        plot.frame(&self.sweep, &self.residual, &self.parameter, out);
        for (index, c) in named() {
            let path = plot.path(&c.curve, top);
            let class = self.class(index);
            let heavy = if c.mark == Mark::Disc { " heavy" } else { "" };
            let _ = writeln!(
                out,
                "<path class=\"line {class}{heavy}\" d=\"{path}\"><title>{}</title></path>",
                Text(&c.name)
            );
        }
        // A legend of three columns above the plot.
        for (place, (index, c)) in named().enumerate() {
            let x = plot.left() + (place % 3) as f64 * 0.37 * AREA[0];
            let y = TOP - 38.0 + (place / 3) as f64 * 15.0;
            let class = self.class(index);
            let heavy = if c.mark == Mark::Disc { " heavy" } else { "" };
            let _ = writeln!(
                out,
                "<path class=\"line {class}{heavy}\" d=\"M{x:.1} {:.1}h16\"/><text x=\"{:.1}\" y=\"{y:.1}\" font-size=\"11\">{}</text>",
                y - 4.0,
                x + 20.0,
                Text(&c.name)
            );
        }
    }
}

/// Where a name stands.
struct Spot {
    at: [f64; 2],
    covers: [f64; 4],
}

/// Beside, above or below a mark, where it covers least.
fn place(name: &str, [x, y]: [f64; 2], plot: &Plot, taken: &[[f64; 4]]) -> Spot {
    let [letter, height] = LETTER;
    let width = letter * name.chars().count() as f64;
    let starts = [
        [x + 9.0, y + 4.0],
        [x - 0.5 * width, y - 10.0],
        [x - 0.5 * width, y + 19.0],
        [x - 9.0 - width, y + 4.0],
        [x + 6.0, y - 9.0],
        [x + 6.0, y + 17.0],
        [x + 14.0, y + 12.0],
        [x + 14.0, y + 25.0],
        [x + 14.0, y - 5.0],
        [x - 14.0 - width, y + 12.0],
        [x - 14.0 - width, y + 25.0],
        [x - 0.5 * width, y + 33.0],
    ];
    let spots = starts.map(|at| Spot {
        at,
        covers: [at[0], at[1] - height + 3.0, at[0] + width, at[1] + 3.0],
    });
    let cost = |spot: &Spot| -> f64 {
        let [x0, y0, x1, y1] = spot.covers;
        let over = |other: &[f64; 4]| {
            let wide = x1.min(other[2]) - x0.max(other[0]);
            let high = y1.min(other[3]) - y0.max(other[1]);
            wide.max(0.0) * high.max(0.0)
        };
        let outside = (plot.left() - x0).max(0.0)
            + (x1 - plot.right()).max(0.0)
            + (plot.top() - y0).max(0.0)
            + (y1 - plot.bottom()).max(0.0);
        taken.iter().map(over).sum::<f64>() + 100.0 * outside
    };
    let mut best: Option<(f64, Spot)> = None;
    for spot in spots {
        let cost = cost(&spot);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, spot));
        }
    }
    best.map_or(
        Spot {
            at: [x, y],
            covers: [x, y, x, y],
        },
        |(_, spot)| spot,
    )
}
