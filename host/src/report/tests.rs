//! Reports of made-up runs: well-formed, complete, and robust against whatever a run may contain.

use super::*;
use crate::movefile::MoveFile;
use proptest::prelude::*;
use roxmltree::{Document, ParsingOptions};
use std::f64::consts::TAU;

fn parse(text: &str) -> Document<'_> {
    let options = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options).unwrap_or_else(|e| panic!("{e}"))
}

/// All text of a document, with a space between elements.
fn words(text: &str) -> String {
    let document = parse(text);
    let texts = document
        .descendants()
        .filter(roxmltree::Node::is_text)
        .filter_map(|n| n.text());
    texts.collect::<Vec<_>>().join(" ")
}

fn paper() -> MoveFile {
    MoveFile::parse(include_str!("../../moves/paper.toml"), "paper.toml").expect("paper")
}

/// A run that looks like one of the paper's: a quintic with ringing at the lowest modes.
fn record(file: &MoveFile, name: &str, ringing: f64) -> Record {
    let plant = file.machine.plant();
    let end_s = 0.0508;
    let time_s: Vec<f64> = (0..8001).map(|i| f64::from(i) * 0.05e-3).collect();
    let phase = |t: f64| (t / end_s).min(1.0);
    let ring = |t: f64, k: usize| {
        let after = (t - end_s).max(0.0);
        let wave = (TAU * (35.5 + 11.7 * k as f64) * t + k as f64).sin();
        let pulse = (TAU * phase(t)).sin() * (1.0 - 0.3 * k as f64);
        if t < end_s {
            pulse + 0.3 * ringing * wave
        } else {
            ringing * wave * (-3.0 * after).exp()
        }
    };
    let channel = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { time_s.iter().map(|t| f(*t)).collect() };
    let (from, to) = (plant.rest(&file.from), plant.rest(&file.to));
    let coordinates = plant.coordinates();
    let per_coordinate = |f: &dyn Fn(usize, f64) -> f64| -> Vec<Vec<f64>> {
        (0..coordinates.len())
            .map(|i| channel(&|t| f(i, t)))
            .collect()
    };
    let smooth = |s: f64| s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
    let smooth_rate = |s: f64| 30.0 * s * s * (1.0 - s) * (1.0 - s) / end_s;
    let per_axis = |scale: f64| -> Vec<Vec<f64>> {
        (0..plant.axis_count())
            .map(|i| channel(&|t| scale * ring(t, i)))
            .collect()
    };
    let outputs = plant.outputs();
    let magnitude = |i: usize| match (outputs[i].kind, outputs[i].unit) {
        (crate::machine::OutputKind::Strain, _) => 380e-6,
        (crate::machine::OutputKind::Stress, _) => 190e6,
        (_, "rad") => 4e-3,
        _ => 1.4e-3 / (1.0 + 6.0 * (i % 3) as f64),
    };
    Record {
        name: name.into(),
        end_s,
        coordinates: per_coordinate(&|i, t| {
            from[i]
                + (to[i] - from[i]) * smooth(phase(t))
                + if coordinates[i].elastic {
                    0.35 * ring(t, i)
                } else {
                    0.0
                }
        }),
        rates: per_coordinate(&|i, t| {
            (to[i] - from[i]) * smooth_rate(phase(t))
                + if coordinates[i].elastic {
                    80.0 * ring(t, i)
                } else {
                    0.0
                }
        }),
        outputs: (0..outputs.len())
            .map(|i| channel(&|t| magnitude(i) * ring(t, i)))
            .collect(),
        torque_nm: per_axis(file.limits.torque_nm * 0.9),
        torque_rate_nm_per_s: per_axis(file.limits.torque_rate_nm_per_s),
        joint_speed_rad_per_s: per_axis(9.6),
        time_s,
    }
}

fn row(name: &str, values: [f64; 8]) -> SummaryRow {
    let [
        duration,
        peak,
        residual,
        displacement,
        stress,
        torque,
        rate,
        speed,
    ] = values.map(Some);
    SummaryRow {
        name: name.into(),
        duration_s: duration,
        peak_strain: peak,
        residual_strain: residual,
        elastic_displacement_m: displacement,
        stress_pa: stress,
        torque_nm: torque,
        torque_rate_nm_per_s: rate,
        motor_speed_rpm: speed,
        ..SummaryRow::default()
    }
}

fn sample(file: &MoveFile) -> Report {
    let records = [
        record(file, "stillpoint", 0.03),
        record(file, "quintic, same duration", 0.6),
    ];
    let ends: [&[f64]; 2] = [&file.from, &file.to];
    let mut figures = figures_of(file.machine.plant(), &file.limits, ends, &records);
    number_like_the_paper(&mut figures);
    for figure in &mut figures {
        figure.caption = "What to see here, in a sentence that is long enough to wrap.".into();
    }
    let note = |topic: &str, text: &str, warning| Note {
        topic: topic.into(),
        text: text.into(),
        warning,
    };
    Report {
        title: format!("The move \"{}\"", file.name),
        subtitle: "30 mm in x, from rest to rest, in the shortest time the limits allow.".into(),
        machine: file.machine.name().into(),
        proofs: Some(Proofs {
            verdict: "Not certified: torque < 150 & more.".into(),
            certified: false,
            headings: ["limit of", "unit", "proved"].map(str::to_owned).to_vec(),
            rows: vec![
                (
                    vec!["torque of axis 1".into(), "N·m".into(), "150.5".into()],
                    false,
                ),
                (
                    vec!["speed of axis 1".into(), "rad/s".into(), "9.61".into()],
                    true,
                ),
            ],
        }),
        plants: None,
        rows: vec![
            row(
                "stillpoint",
                [0.050823, 432e-6, 14e-6, 1.5e-3, 193e6, 133.0, 2e4, 1834.0],
            ),
            row(
                "quintic, same duration",
                [
                    0.050823, 576e-6, 228e-6, 2.45e-3, 257e6, 160.0, 31_234.0, 2100.0,
                ],
            ),
            SummaryRow {
                name: "paper".into(),
                duration_s: Some(0.0508),
                peak_strain: Some(4e-4),
                residual_strain: Some(2e-5),
                elastic_displacement_m: Some(1.5e-3),
                ..SummaryRow::default()
            },
            row(
                "shortest quintic",
                [0.0995, 170e-6, 52e-6, 0.7e-3, 80e6, 55.0, 9e3, 1000.0],
            ),
            row(
                "shortest quintic, ZV on the lowest mode",
                [0.0773, 210e-6, 34e-6, 0.9e-3, 99e6, 75.0, 1.2e4, 1210.0],
            ),
        ],
        limit_row: Some(SummaryRow {
            name: "limit".into(),
            elastic_displacement_m: Some(1.5e-3),
            stress_pa: Some(355e6),
            torque_nm: Some(150.0),
            torque_rate_nm_per_s: Some(2e4),
            motor_speed_rpm: Some(6000.0),
            ..SummaryRow::default()
        }),
        figures,
        notes: vec![
            note(
                "solver",
                "pounce, 84 iterations, 0.9 s; 1981 variables, 2316 constraints",
                false,
            ),
            note(
                "largest violation",
                "elastic displacement x, 2.1 % at 12.3 ms",
                true,
            ),
        ],
        parameters: parameters_of(file),
        ..Report::default()
    }
}

#[test]
fn the_papers_report_is_complete_and_small() {
    let report = sample(&paper());
    let html = report.html();
    assert!(html.len() < 400_000, "{} bytes", html.len());
    for outside in ["http://", "https://", "<script", "@import", "url("] {
        let left = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        assert!(!left.contains(outside), "{outside}");
    }
    let words = words(&html);
    for wanted in [
        "Fig. 4a · Position",
        "Fig. 4b · Speed",
        "Fig. 4c · Curvature",
        "Fig. 4d · Curvature rate",
        "Fig. 4e · Elastic displacement",
        "Fig. 4f · Driving torque",
        "Fig. 6 · Strain",
        "position (mm)",
        "speed (mm/s)",
        "curvature (×10⁻⁴ 1/mm)",
        "(1/(mm·s))",
        "(N·m)",
        "(µε)",
        "limit ±150 N·m",
        "limit ±20000 N·m/s",
        "δx limit ±1.5 mm",
        "δy limit ±0.2 mm",
        "limit ±355 MPa",
        "stillpoint",
        "quintic, same duration",
        "link 3",
        "axis 3",
        "▲ assumed",
        "◆ derived",
        "● stated",
        "torque_rate_nm_per_s",
        "2.450 !",
        "Attention:",
    ] {
        assert!(words.contains(wanted), "{wanted}");
    }
    // Everything assumed carries the mark: the rows and the legend.
    let assumed = report
        .parameters
        .iter()
        .filter(|p| p.origin == Origin::Assumed)
        .count();
    assert_eq!(words.matches("▲ assumed").count(), assumed + 1);
}

#[test]
fn every_series_and_limit_is_drawn_or_told() {
    for figure in sample(&paper()).figures {
        let svg = figure.svg();
        let document = parse(&svg);
        let with_class = |class: &str| {
            let has = |n: &roxmltree::Node<'_, '_>| {
                n.attribute("class").is_some_and(|c| c.starts_with(class))
            };
            document.descendants().filter(has).count()
        };
        // Once in the legend, once as a curve.
        assert_eq!(
            with_class("line "),
            2 * figure.series.len(),
            "{}",
            figure.id
        );
        let panels = figure.panels().len();
        assert_eq!(
            with_class("limit-text"),
            figure.limits.len() * panels,
            "{}",
            figure.id
        );
        let drawn = with_class("limit") - with_class("limit-text");
        let outside = svg.matches("outside the plot").count();
        assert!(
            drawn + outside >= figure.limits.len() * panels,
            "{}",
            figure.id
        );
    }
}

#[test]
fn a_machine_with_one_axis_has_a_report_too() {
    let file = MoveFile::parse(include_str!("../../moves/axis.toml"), "axis.toml").expect("axis");
    let records = [record(&file, "stillpoint", 0.02)];
    let figures = figures_of(
        file.machine.plant(),
        &file.limits,
        [&file.from, &file.to],
        &records,
    );
    let ids: Vec<&str> = figures.iter().map(|f| f.id.as_str()).collect();
    assert_eq!(
        ids,
        [
            "position",
            "speed",
            "elastic-displacement",
            "torque",
            "torque-rate",
            "joint-speed"
        ]
    );
    assert!(words(&figures[2].svg()).contains("twist limit ±0.05 rad"));
    parse(&sample(&file).html());
}

#[test]
fn summary_json_has_exactly_the_agreed_keys() {
    let rows = [SummaryRow {
        name: "a \"b\"".into(),
        duration_s: Some(0.05),
        stress_pa: Some(f64::NAN),
        ..SummaryRow::default()
    }];
    let value: serde_json::Value = serde_json::from_str(&summary_json(&rows)).expect("JSON");
    let keys: Vec<&String> = value[0].as_object().expect("row").keys().collect();
    let mut expected = [
        "name",
        "duration_s",
        "peak_strain",
        "residual_strain",
        "elastic_displacement_m",
        "stress_pa",
        "torque_nm",
        "torque_rate_nm_per_s",
        "motor_speed_rpm",
    ];
    expected.sort_unstable();
    let mut keys: Vec<&str> = keys.into_iter().map(String::as_str).collect();
    keys.sort_unstable();
    assert_eq!(keys, expected);
    assert_eq!(value[0]["duration_s"], 0.05);
    assert!(value[0]["stress_pa"].is_null() && value[0]["torque_nm"].is_null());
}

fn empty_figure() -> Figure {
    Figure {
        id: "f".into(),
        title: String::new(),
        x_label: String::new(),
        y_label: String::new(),
        y_unit: String::new(),
        y_factor: 1.0,
        window_s: None,
        series: vec![],
        limits: vec![],
        moments: vec![],
        caption: String::new(),
    }
}

#[test]
fn markup_in_the_data_stays_text() {
    let evil = "<script>alert(1)</script>&\"'\u{0}";
    let mut report = sample(&paper());
    report.title = evil.into();
    report.subtitle = evil.into();
    report.machine = evil.into();
    for row in &mut report.rows {
        row.name = evil.into();
    }
    for figure in &mut report.figures {
        for text in [
            &mut figure.id,
            &mut figure.title,
            &mut figure.x_label,
            &mut figure.y_label,
            &mut figure.y_unit,
            &mut figure.caption,
        ] {
            *text = evil.into();
        }
        figure
            .series
            .iter_mut()
            .for_each(|s| (s.run, s.label) = (evil.into(), evil.into()));
        figure.limits.iter_mut().for_each(|l| l.label = evil.into());
        figure
            .moments
            .iter_mut()
            .for_each(|m| m.label = evil.into());
        parse(&figure.svg());
    }
    report
        .notes
        .iter_mut()
        .for_each(|n| (n.topic, n.text) = (evil.into(), evil.into()));
    for p in &mut report.parameters {
        for text in [
            &mut p.group,
            &mut p.key,
            &mut p.value,
            &mut p.unit,
            &mut p.source,
        ] {
            *text = evil.into();
        }
    }
    let html = report.html();
    parse(&html);
    assert!(!html.contains("<script"));
}

#[test]
fn nothing_to_show_is_shown_as_such() {
    let report = Report::default();
    parse(&report.html());
    let svg = empty_figure().svg();
    assert!(words(&svg).contains("no data"));
    let missing = Series {
        run: "r".into(),
        label: "l".into(),
        time_s: vec![0.0, f64::NAN, 1.0],
        values: vec![f64::NAN, 1.0, f64::INFINITY, 4.0],
    };
    let figure = Figure {
        series: vec![missing],
        limits: vec![LimitLine {
            label: "limit".into(),
            value: 3.0,
        }],
        ..empty_figure()
    };
    let words = words(&figure.svg());
    assert!(words.contains("no data") && words.contains("limit ±3"));
}

#[test]
fn one_run_with_many_curves_is_one_plot() {
    let series = |run: &str, label: &str| Series {
        run: run.into(),
        label: label.into(),
        time_s: vec![0.0, 1.0],
        values: vec![0.0, 1.0],
    };
    let figure = |series| Figure {
        series,
        ..empty_figure()
    };
    assert_eq!(
        figure(vec![series("a", "x"), series("a", "y")])
            .panels()
            .len(),
        1
    );
    assert_eq!(
        figure(vec![series("a", "x"), series("b", "x")])
            .panels()
            .len(),
        1
    );
    assert_eq!(
        figure(vec![series("a", "x"), series("a", "y"), series("b", "x")])
            .panels()
            .len(),
        2
    );
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -1.0_f64..1.0, 1 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(0.0), 1 => Just(1e300), 1 => Just(5e-324)]
}

proptest! {
    #[test]
    fn any_numbers_give_a_well_formed_figure(
        times in prop::collection::vec(number(), 0..30), values in prop::collection::vec(number(), 0..30),
        factor in number(), limit in number(), moment in number(),
        window in prop::option::of((number(), number())), label in any::<String>(),
    ) {
        let figure = Figure {
            title: label.clone(),
            y_factor: factor,
            window_s: window,
            series: vec![Series { run: label.clone(), label: label.clone(), time_s: times, values }],
            limits: vec![LimitLine { label: label.clone(), value: limit }],
            moments: vec![Moment { label, time_s: moment }],
            ..empty_figure()
        };
        let svg = figure.svg();
        parse(&svg);
        prop_assert!(!svg.contains("NaN") || figure.title.contains("NaN") || limit.is_nan() || (limit * factor).is_nan());
        for bad in ["d=\"MNaN", "Minf", "L-inf", "\"NaN\"", "\"inf\""] {
            prop_assert!(!svg.contains(bad));
        }
    }

    #[test]
    fn any_rows_give_a_table(values in prop::collection::vec(prop::array::uniform8(number()), 0..6), name in any::<String>()) {
        let rows: Vec<SummaryRow> = values.into_iter().map(|v| row(&name, v)).collect();
        let _ = text_table(&rows, rows.first());
        let report = Report { rows, ..Report::default() };
        parse(&report.html());
    }
}

#[test]
fn a_certificate_shows_its_verdict_and_marks_what_does_not_hold() {
    let file = MoveFile::parse(crate::movefile::PAPER_MOVE, "paper.toml").expect("a move");
    let html = sample(&file).html();
    let text = words(&html);
    assert!(text.contains("Attention: "), "{text}");
    assert!(text.contains("Not certified: torque < 150 & more."));
    let row = "<td>torque of axis 1</td><td>N·m</td><td class=\"number\">150.5<span class=\"excess\">!</span></td>";
    assert!(html.contains(row));
    assert!(html.contains("<td class=\"number\">9.61</td>"));
}
