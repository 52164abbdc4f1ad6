//! The comparison for a terminal.

use super::summary::{BEYOND, SummaryRow, columns};

/// Draws the comparison with aligned columns, units, and `–` for what is missing; values beyond the limit row carry a `!`.
#[must_use]
pub fn text_table(rows: &[SummaryRow], limit: Option<&SummaryRow>) -> String {
    // The grid as text: heading, unit, a line per run, and a space or a mark behind every cell.
    let columns = columns(rows, limit);
    let mut grid: Vec<Vec<String>> = (0..2)
        .map(|part| {
            columns
                .iter()
                .map(|c| format!("{} ", c.heading[part]))
                .collect()
        })
        .collect();
    grid.push(columns.iter().map(|c| format!("{} ", c.unit)).collect());
    let mut names = vec![String::new(); grid.len()];
    for (i, row) in rows.iter().chain(limit).enumerate() {
        let marked = |beyond| if beyond { '!' } else { ' ' };
        names.push(printable(&row.name));
        grid.push(
            columns
                .iter()
                .map(|c| format!("{}{}", c.cells[i].text, marked(c.cells[i].beyond)))
                .collect(),
        );
    }
    let name_width = names.iter().map(|n| width(n)).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len())
        .map(|k| grid.iter().map(|line| width(&line[k])).max().unwrap_or(0))
        .collect();
    let rule = "─".repeat(name_width + widths.iter().map(|w| w + 1).sum::<usize>());
    let mut text = String::new();
    for (i, (name, line)) in names.iter().zip(&grid).enumerate() {
        let at_limit = limit.is_some() && i == grid.len() - 1;
        if i == 3 || at_limit {
            text.push_str(&rule);
            text.push('\n');
        }
        let mut row = format!("{name}{}", " ".repeat(name_width - width(name)));
        for (cell, wide) in line.iter().zip(&widths) {
            row.push_str(&" ".repeat(1 + wide - width(cell)));
            row.push_str(cell);
        }
        text.push_str(row.trim_end());
        text.push('\n');
    }
    if columns
        .iter()
        .any(|c| c.cells.iter().any(|cell| cell.beyond))
    {
        text.push_str(&format!("! {BEYOND}\n"));
    }
    text
}

/// Rows under headings, numbers to the right; a row of fewer cells than headings ends with words that run over the others.
#[must_use]
pub fn plain_table(headings: &[String], rows: &[Vec<String>]) -> String {
    let whole = |row: &&Vec<String>| row.len() == headings.len();
    let widths: Vec<usize> = (0..headings.len())
        .map(|column| {
            let cells = rows.iter().filter(whole).map(|row| width(&row[column]));
            cells.fold(width(&headings[column]), usize::max)
        })
        .collect();
    let mut text = String::new();
    for row in std::iter::once(headings).chain(rows.iter().map(Vec::as_slice)) {
        for (column, (cell, wide)) in row.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(wide.saturating_sub(width(cell)));
            let words = column == 0 || (row.len() < headings.len() && column + 1 == row.len());
            let gap = if column == 0 { "" } else { "  " };
            text += &match words {
                true => format!("{gap}{}{pad}", printable(cell)),
                false => format!("{gap}{pad}{}", printable(cell)),
            };
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    text
}

fn width(text: &str) -> usize {
    text.chars().count()
}

fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{SummaryRow, text_table};

    #[test]
    fn aligns_marks_and_leaves_out() {
        let row = |name: &str, ms: f64, torque: Option<f64>| SummaryRow {
            name: name.into(),
            duration_s: Some(ms * 1e-3),
            torque_nm: torque,
            stress_pa: Some(f64::NAN),
            ..SummaryRow::default()
        };
        let rows = [
            row("stillpoint", 50.82, Some(150.1)),
            row("quintic, µ", 101.0, Some(152.0)),
            row("paper", 50.8, None),
        ];
        let limit = SummaryRow {
            name: "limit".into(),
            torque_nm: Some(150.0),
            ..SummaryRow::default()
        };
        let expected = "\
            \x20                      peak\n\
            \x20          duration  torque\n\
            \x20                ms     N·m\n\
            ────────────────────────────\n\
            stillpoint    50.82   150.1\n\
            quintic, µ   101.00   152.0!\n\
            paper         50.80       –\n\
            ────────────────────────────\n\
            limit             –   150.0\n\
            ! beyond the machine's limit by more than 0.5 %\n";
        assert_eq!(text_table(&rows, Some(&limit)), expected);
        assert_eq!(text_table(&[], None), "\n\n\n");
    }
}
