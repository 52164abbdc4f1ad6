//! The figures that recorded runs of a machine give, whatever the machine.
//!
//! Of a machine with flexible links they are those of the paper: position, speed, curvatures, their rates, elastic
//! displacement and torques over the move, and strain over the whole record; others follow from the same rules.

use super::data::{Figure, LimitLine, Moment, Series};
use crate::machine::{OutputKind, Plant};
use crate::movefile::Limits;

/// What was recorded of one run; channels are indexed first, and may be missing altogether.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// What was run.
    pub name: String,
    /// When the commanded move ends.
    pub end_s: f64,
    /// Times of all samples.
    pub time_s: Vec<f64>,
    /// Generalised coordinates of the machine.
    pub coordinates: Vec<Vec<f64>>,
    /// Their rates.
    pub rates: Vec<Vec<f64>>,
    /// Outputs of the machine.
    pub outputs: Vec<Vec<f64>>,
    /// Torque at each reducer output.
    pub torque_nm: Vec<Vec<f64>>,
    /// Its rate.
    pub torque_rate_nm_per_s: Vec<Vec<f64>>,
    /// Speed of each joint.
    pub joint_speed_rad_per_s: Vec<Vec<f64>>,
}

/// Figures that the paper does not have.
const ADDED: [&str; 4] = ["elastic-rotation", "torque-rate", "joint-speed", "stress"];

/// What to show of a record: the channels of one figure.
type Channels = fn(&Record) -> &Vec<Vec<f64>>;

struct Builder<'b> {
    records: &'b [Record],
    move_window: (f64, f64),
    figures: Vec<Figure>,
}

/// Builds the figures of `records`; the move goes from pose to pose.
#[must_use]
pub fn figures_of(
    plant: &dyn Plant,
    limits: &Limits,
    ends: [&[f64]; 2],
    records: &[Record],
) -> Vec<Figure> {
    let last_end = records.iter().fold(0.0_f64, |m, r| m.max(r.end_s));
    let mut build = Builder {
        records,
        // As much after the move as it takes to see whether it stands still.
        move_window: (0.0, 1.18 * last_end),
        figures: vec![],
    };
    build.coordinates(plant, ends, false);
    build.coordinates(plant, ends, true);
    build.outputs(plant, limits, OutputKind::ElasticDisplacement);
    build.axes(plant, limits);
    build.outputs(plant, limits, OutputKind::Strain);
    build.outputs(plant, limits, OutputKind::Stress);
    // Those of the paper first, in its order; the sort is stable.
    build
        .figures
        .sort_by_key(|f| ADDED.contains(&f.id.as_str()));
    build.figures
}

/// Titles the figures that the paper has with its numbers.
pub fn number_like_the_paper(figures: &mut [Figure]) {
    let numbers = [
        ("position", "4a"),
        ("speed", "4b"),
        ("elastic-coordinate", "4c"),
        ("elastic-rate", "4d"),
        ("elastic-displacement", "4e"),
        ("torque", "4f"),
        ("strain", "6"),
    ];
    for figure in figures {
        if let Some((_, number)) = numbers.iter().find(|(id, _)| *id == figure.id) {
            figure.title = format!("Fig. {number} · {}", figure.title);
        }
    }
}

impl Builder<'_> {
    /// Coordinates and rates: those of the pose that the move changes, or the elastic ones.
    fn coordinates(&mut self, plant: &dyn Plant, ends: [&[f64]; 2], elastic: bool) {
        let coordinates = plant.coordinates();
        let [from, to] = ends.map(|pose| plant.rest(pose));
        let outputs = plant.outputs();
        let shown_as_output = |index| {
            use crate::machine::OutputForm::Proportional;
            outputs.iter().any(|o| {
                o.kind == OutputKind::ElasticDisplacement
                    && o.form
                        == Proportional {
                            coordinate: index,
                            gain: 1.0,
                        }
            })
        };
        let wanted = |i: &usize| {
            let changes = from.get(*i) != to.get(*i);
            coordinates[*i].elastic == elastic
                && if elastic {
                    !shown_as_output(*i)
                } else {
                    changes
                }
        };
        let indices: Vec<usize> = (0..coordinates.len()).filter(wanted).collect();
        for (unit, indices) in by_unit(&indices, |i| coordinates[i].unit) {
            let labels: Vec<(usize, String)> = indices
                .iter()
                .map(|i| (*i, plain(coordinates[*i].name)))
                .collect();
            let (what, ids) = if elastic {
                (common(&labels), ["elastic-coordinate", "elastic-rate"])
            } else {
                ("position".to_owned(), ["position", "speed"])
            };
            let rate_name = if elastic {
                format!("{what} rate")
            } else {
                "speed".to_owned()
            };
            let values: Channels = |r| &r.coordinates;
            let rates: Channels = |r| &r.rates;
            self.add(ids[0], &what, unit, &labels, values, vec![]);
            self.add(
                ids[1],
                &rate_name,
                &format!("{unit}/s"),
                &labels,
                rates,
                vec![],
            );
        }
    }

    fn outputs(&mut self, plant: &dyn Plant, limits: &Limits, kind: OutputKind) {
        let outputs = plant.outputs();
        let indices: Vec<usize> = (0..outputs.len())
            .filter(|i| outputs[*i].kind == kind)
            .collect();
        let (id, name) = match kind {
            OutputKind::Strain => ("strain", "strain"),
            OutputKind::Stress => ("stress", "stress"),
            OutputKind::ElasticDisplacement => ("elastic-displacement", "elastic displacement"),
        };
        for (unit, indices) in by_unit(&indices, |i| outputs[i].unit) {
            let labels: Vec<(usize, String)> = indices
                .iter()
                .map(|i| (*i, outputs[*i].label.to_owned()))
                .collect();
            let mut bounds: Vec<LimitLine> = Vec::new();
            let limit = |i: usize| limits.outputs.get(i).copied().flatten();
            let same = indices.iter().all(|i| limit(*i) == limit(indices[0]));
            for i in indices.iter().take(if same { 1 } else { indices.len() }) {
                if let Some(value) = limit(*i) {
                    let label = if same && indices.len() > 1 {
                        "limit".to_owned()
                    } else {
                        format!("{} limit", outputs[*i].label)
                    };
                    bounds.push(LimitLine { label, value });
                }
            }
            // An angle among displacements is a figure of its own.
            let turn =
                kind == OutputKind::ElasticDisplacement && unit == "rad" && outputs.len() > 1;
            let (id, name) = if turn {
                ("elastic-rotation", "elastic rotation")
            } else {
                (id, name)
            };
            self.add(
                id,
                name,
                if kind == OutputKind::Strain {
                    "strain"
                } else {
                    unit
                },
                &labels,
                |r| &r.outputs,
                bounds,
            );
        }
    }

    fn axes(&mut self, plant: &dyn Plant, limits: &Limits) {
        let labels: Vec<(usize, String)> = (0..plant.axis_count())
            .map(|i| (i, format!("axis {}", i + 1)))
            .collect();
        let bound = |value: f64| {
            vec![LimitLine {
                label: "limit".into(),
                value,
            }]
        };
        let top_speed = limits.joint_speed_rad_per_s(plant.reducer_ratio());
        self.add(
            "torque",
            "driving torque",
            "N·m",
            &labels,
            |r| &r.torque_nm,
            bound(limits.torque_nm),
        );
        let rate = bound(limits.torque_rate_nm_per_s);
        self.add(
            "torque-rate",
            "torque rate",
            "N·m/s",
            &labels,
            |r| &r.torque_rate_nm_per_s,
            rate,
        );
        self.add(
            "joint-speed",
            "joint speed",
            "rad/s",
            &labels,
            |r| &r.joint_speed_rad_per_s,
            bound(top_speed),
        );
    }

    fn add(
        &mut self,
        id: &str,
        name: &str,
        unit: &str,
        labels: &[(usize, String)],
        channels: Channels,
        limits: Vec<LimitLine>,
    ) {
        let mut series = Vec::new();
        for record in self.records {
            for (index, label) in labels {
                // A record without this channel leaves its curve out.
                if let Some(values) = channels(record).get(*index) {
                    series.push(Series {
                        run: record.name.clone(),
                        label: label.clone(),
                        time_s: record.time_s.clone(),
                        values: values.clone(),
                    });
                }
            }
        }
        if series.is_empty() {
            return;
        }
        let (y_factor, y_unit) = shown(unit);
        let mut moments: Vec<Moment> = Vec::new();
        for record in self.records {
            if record.end_s > 0.0 && moments.iter().all(|m| m.time_s != record.end_s) {
                moments.push(Moment {
                    label: format!("end of {}", record.name),
                    time_s: record.end_s,
                });
            }
        }
        if let [only] = moments.as_mut_slice() {
            only.label = "end of the move".into();
        }
        self.figures.push(Figure {
            id: id.to_owned(),
            title: capital(name),
            x_label: "time (s)".into(),
            y_label: name.to_owned(),
            y_unit: y_unit.to_owned(),
            y_factor,
            // The ringing afterwards is what strain is about.
            window_s: (id != "strain" && self.move_window.1 > 0.0).then_some(self.move_window),
            series,
            limits,
            moments,
            caption: String::new(),
        });
    }
}

/// Shown value per SI value, and its unit.
fn shown(unit: &str) -> (f64, &str) {
    match unit {
        "m" => (1e3, "mm"),
        "m/s" => (1e3, "mm/s"),
        "1/m" => (1e-3, "1/mm"),
        "1/m/s" => (1e-3, "1/(mm·s)"),
        "Pa" => (1e-6, "MPa"),
        "strain" => (1e6, "µε"),
        other => (1.0, other),
    }
}

/// Groups indices by unit, in order of appearance.
fn by_unit<'u>(indices: &[usize], unit: impl Fn(usize) -> &'u str) -> Vec<(&'u str, Vec<usize>)> {
    let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
    for &i in indices {
        match groups.iter_mut().find(|g| g.0 == unit(i)) {
            Some(group) => group.1.push(i),
            None => groups.push((unit(i), vec![i])),
        }
    }
    groups
}

/// A key without unit and underscores.
fn plain(key: &str) -> String {
    let bare = ["_rad", "_m"]
        .iter()
        .find_map(|unit| key.strip_suffix(unit));
    match bare.unwrap_or(key) {
        "phi" => "φ".into(),
        other => other.replace('_', " "),
    }
}

/// What labels that differ in a number have in common.
fn common(labels: &[(usize, String)]) -> String {
    let stem = |label: &str| {
        label
            .trim_end_matches(|c: char| c.is_ascii_digit() || c == ' ')
            .to_owned()
    };
    let first = labels.first().map_or(String::new(), |l| stem(&l.1));
    let same = labels.iter().all(|l| stem(&l.1) == first);
    if same && !first.is_empty() {
        first
    } else {
        "deformation".into()
    }
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars
        .next()
        .map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
}
