//! The report as one HTML file: no scripts, nothing loaded from elsewhere.

use super::data::{Figure, Origin, Parameter, Proofs, Report, Table};
use super::escape::Text;
use super::summary::{BEYOND, columns};
use super::svg::STYLE;
use std::fmt::Write;

const PAGE_STYLE: &str = include_str!("page.css");

impl Origin {
    /// A sign that needs no colour, a word, and what it means.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::Stated => (
                "●",
                "stated",
                "given by whoever describes the machine or the move.",
            ),
            Self::Derived => ("◆", "derived", "follows from stated values."),
            Self::Assumed => (
                "▲",
                "assumed",
                "nobody measured it: chosen, or fitted to a known result. Figures that depend on it are no better \
                 than it is.",
            ),
        }
    }
}

impl Report {
    /// The whole report, well-formed as HTML and as XML.
    #[must_use]
    pub fn html(&self) -> String {
        // Writing to a string cannot fail.
        let mut out = String::new();
        let title = Text(&self.title);
        let _ = write!(
            out,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <title>{title}</title>\n<style>\n{STYLE}{PAGE_STYLE}</style>\n</head>\n<body>\n\
             <header>\n<h1>{title}</h1>\n"
        );
        if !self.subtitle.is_empty() {
            let _ = writeln!(out, "<p>{}</p>", Text(&self.subtitle));
        }
        if !self.machine.is_empty() {
            let _ = writeln!(
                out,
                "<p class=\"soft small\">Machine: {}</p>",
                Text(&self.machine)
            );
        }
        out.push_str("</header>\n<main>\n");
        self.comparison(&mut out);
        if let Some(proofs) = &self.proofs {
            proofs.html("certificate", "Certificate", &mut out);
        }
        if let Some(plants) = &self.plants {
            plants.html("plants", "Other plants", &mut out);
        }
        if let Some(tradeoff) = &self.tradeoff {
            let _ = writeln!(
                out,
                "<section id=\"planners\">\n{}</section>",
                tradeoff.inline()
            );
        }
        for table in &self.tables {
            table.html(&mut out);
        }
        self.figures(&mut out);
        self.notes(&mut out);
        self.parameters(&mut out);
        out.push_str("</main>\n</body>\n</html>\n");
        out
    }

    fn comparison(&self, out: &mut String) {
        if self.rows.is_empty() {
            return;
        }
        let columns = columns(&self.rows, self.limit_row.as_ref());
        out.push_str(
            "<section id=\"comparison\">\n<h2>Comparison</h2>\n\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Comparison\">\n\
             <table class=\"runs\">\n<thead><tr><th></th>",
        );
        for column in &columns {
            let heading = column.heading.join(" ");
            let _ = write!(
                out,
                "<th class=\"number\" scope=\"col\">{}<br/><span class=\"unit\">{}</span></th>",
                heading.trim().replace(' ', "<br/>"),
                Text(column.unit)
            );
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for (i, row) in self.rows.iter().chain(&self.limit_row).enumerate() {
            let class = match i {
                0 => " class=\"ours\"",
                i if i == self.rows.len() => " class=\"bound\"",
                _ => "",
            };
            let _ = write!(out, "<tr{class}><th scope=\"row\">{}</th>", Text(&row.name));
            for column in &columns {
                let cell = &column.cells[i];
                let (class, mark) = if cell.beyond {
                    (" beyond", "<span class=\"excess\">!</span>")
                } else {
                    ("", "")
                };
                let _ = write!(
                    out,
                    "<td class=\"number{class}\">{}{mark}</td>",
                    Text(&cell.text)
                );
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody>\n</table>\n</div>\n");
        if columns
            .iter()
            .any(|c| c.cells.iter().any(|cell| cell.beyond))
        {
            let _ = writeln!(
                out,
                "<p class=\"small\"><span class=\"beyond\">!</span> {BEYOND}</p>"
            );
        }
        out.push_str("</section>\n");
    }

    fn figures(&self, out: &mut String) {
        if self.figures.is_empty() {
            return;
        }
        out.push_str("<section id=\"figures\">\n<h2>Figures</h2>\n<div class=\"figures\">\n");
        for figure in &self.figures {
            figure.html(out);
        }
        out.push_str("</div>\n</section>\n");
    }

    fn notes(&self, out: &mut String) {
        if self.notes.is_empty() {
            return;
        }
        out.push_str("<section id=\"notes\">\n<h2>How it was planned and checked</h2>\n<dl>\n");
        for note in &self.notes {
            let warning = if note.warning {
                "<span class=\"warning\">Attention:</span> "
            } else {
                ""
            };
            let _ = writeln!(
                out,
                "<dt>{}</dt><dd>{warning}{}</dd>",
                Text(&note.topic),
                Text(&note.text)
            );
        }
        out.push_str("</dl>\n</section>\n");
    }

    fn parameters(&self, out: &mut String) {
        if self.parameters.is_empty() {
            return;
        }
        out.push_str(
            "<section id=\"parameters\">\n<h2>Parameters</h2>\n<ul class=\"legend small\">\n",
        );
        for origin in [Origin::Stated, Origin::Derived, Origin::Assumed] {
            if self.parameters.iter().any(|p| p.origin == origin) {
                let _ = writeln!(
                    out,
                    "<li>{}: {}</li>",
                    origin_mark(origin),
                    origin.words().2
                );
            }
        }
        out.push_str(
            "</ul>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Parameters\">\n<table>\n\
             <thead><tr><th scope=\"col\">key</th><th class=\"number\" scope=\"col\">value</th>\
             <th scope=\"col\">unit</th><th scope=\"col\">origin</th></tr></thead>\n<tbody>\n",
        );
        let mut group = None;
        for parameter in &self.parameters {
            if group != Some(&parameter.group) {
                let _ = writeln!(
                    out,
                    "<tr class=\"group\"><th colspan=\"4\" scope=\"rowgroup\">{}</th></tr>",
                    Text(&parameter.group)
                );
                group = Some(&parameter.group);
            }
            row(parameter, out);
        }
        out.push_str("</tbody>\n</table>\n</div>\n</section>\n");
    }
}

impl Proofs {
    fn html(&self, id: &str, title: &str, out: &mut String) {
        let warning = if self.certified {
            ""
        } else {
            "<span class=\"warning\">Attention:</span> "
        };
        let _ = write!(
            out,
            "<section id=\"{id}\">\n<h2>{title}</h2>\n<p>{warning}{}</p>\n\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\">\n<table>\n<thead><tr>",
            Text(&self.verdict)
        );
        let class = |column: usize| if column < 2 { "" } else { " class=\"number\"" };
        for (column, heading) in self.headings.iter().enumerate() {
            let _ = write!(
                out,
                "<th{} scope=\"col\">{}</th>",
                class(column),
                Text(heading)
            );
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for (cells, holds) in &self.rows {
            out.push_str("<tr>");
            for (column, cell) in cells.iter().enumerate() {
                let mark = if column == 2 && !holds {
                    "<span class=\"excess\">!</span>"
                } else {
                    ""
                };
                let _ = write!(out, "<td{}>{}{mark}</td>", class(column), Text(cell));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody>\n</table>\n</div>\n</section>\n");
    }
}

impl Table {
    fn html(&self, out: &mut String) {
        let _ = write!(
            out,
            "<section id=\"{}\">\n<h2>{title}</h2>\n<p>{}</p>\n\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\">\n<table>\n<thead><tr>",
            Text(&self.id),
            Text(&self.text),
            title = Text(&self.title)
        );
        let class = |column: usize| if column == 0 { "" } else { " class=\"number\"" };
        for (column, heading) in self.headings.iter().enumerate() {
            let _ = write!(
                out,
                "<th{} scope=\"col\">{}</th>",
                class(column),
                Text(heading)
            );
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for cells in &self.rows {
            let missing = self.headings.len().saturating_sub(cells.len());
            out.push_str("<tr>");
            for (column, cell) in cells.iter().enumerate() {
                let text = Text(cell);
                if missing > 0 && column + 1 == cells.len() {
                    let _ = write!(out, "<td colspan=\"{}\">{text}</td>", missing + 1);
                } else {
                    let _ = write!(out, "<td{}>{text}</td>", class(column));
                }
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody>\n</table>\n</div>\n</section>\n");
    }
}

fn row(parameter: &Parameter, out: &mut String) {
    let source = if parameter.source.is_empty() {
        String::new()
    } else {
        format!(
            " <span class=\"soft small\">{}</span>",
            Text(&parameter.source)
        )
    };
    let _ = writeln!(
        out,
        "<tr><td class=\"key\">{}</td><td class=\"number\">{}</td><td class=\"mark\">{}</td><td>{}{source}</td></tr>",
        Text(&parameter.key),
        Text(&parameter.value),
        Text(&parameter.unit),
        origin_mark(parameter.origin),
    );
}

fn origin_mark(origin: Origin) -> String {
    let (sign, word, _) = origin.words();
    let class = if origin == Origin::Assumed {
        "mark assumed"
    } else {
        "mark"
    };
    format!("<span class=\"{class}\">{sign} {word}</span>")
}

impl Figure {
    fn html(&self, out: &mut String) {
        let panels = self.panels();
        let wide = if panels.len() > 1 {
            " class=\"wide\""
        } else {
            ""
        };
        let _ = writeln!(
            out,
            "<figure id=\"{}\"{wide}>\n<h3>{}</h3>\n<div class=\"panels\">",
            Text(&self.id),
            Text(&self.title)
        );
        for panel in &panels {
            out.push_str(&self.panel_svg(panel));
        }
        out.push_str("</div>\n");
        if !self.caption.is_empty() {
            let _ = writeln!(out, "<figcaption>{}</figcaption>", Text(&self.caption));
        }
        out.push_str("</figure>\n");
    }
}
