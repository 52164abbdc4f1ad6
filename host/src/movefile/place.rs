//! A place in a text, shown with its line and a caret.

use std::fmt;
use std::ops::Range;

/// Longest piece of a line that is shown.
const WIDTH: usize = 100;

/// A place in a move file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line, cut to what is shown, and where the carets go in it.
    excerpt: String,
    carets: Range<usize>,
}

impl Place {
    /// The place of a range of bytes; anything outside the text means its end.
    pub(super) fn new(file: &str, text: &str, bytes: Range<usize>) -> Self {
        let start = floor_char(text, bytes.start);
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let end = floor_char(text, bytes.end).clamp(start, line_end);
        let column = text[line_start..start].chars().count();
        let length = text[start..end].chars().count().max(1);
        // A window on the line, so that a file without line breaks does not flood the terminal.
        let skip = column.saturating_sub(WIDTH / 2);
        let excerpt = text[line_start..line_end]
            .trim_end_matches('\r')
            .chars()
            .skip(skip)
            .take(WIDTH)
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        let first = column - skip;
        Self {
            file: printable(file),
            line: before.matches('\n').count() + 1,
            column: column + 1,
            excerpt,
            carets: first..(first + length).min(WIDTH.max(first + 1)),
        }
    }
}

/// The nearest character boundary at or before an index.
fn floor_char(text: &str, index: usize) -> usize {
    let mut index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

/// Text from a file without what a terminal would obey.
pub(super) fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

impl Place {
    /// The line with carets under the place.
    pub(super) fn excerpt(&self) -> String {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let indent = " ".repeat(self.carets.start);
        let carets = "^".repeat(self.carets.len());
        format!(
            "{margin} |\n{number} | {}\n{margin} | {indent}{carets}",
            self.excerpt
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Place;
    use proptest::prelude::*;

    #[test]
    fn points_at_the_word() {
        let text = "[a]\n\tµ = 1\nend";
        let place = Place::new("m.toml", text, 10..11);
        assert_eq!(place.to_string(), "m.toml:2:6");
        assert_eq!(place.excerpt(), "  |\n2 |  µ = 1\n  |      ^");
    }

    #[test]
    fn a_long_line_is_cut_around_the_place() {
        let text = format!("{}x{}", "a".repeat(500), "b".repeat(500));
        let excerpt = Place::new("m", &text, 500..501).excerpt();
        assert!(excerpt.lines().all(|l| l.chars().count() <= 104));
        let lines: Vec<&str> = excerpt.lines().collect();
        assert_eq!(lines[1].find('x'), lines[2].find('^'));
    }

    proptest! {
        #[test]
        fn any_range_of_any_text_has_a_place(text in ".*", a in 0_usize..99, b in 0_usize..99) {
            let place = Place::new("\u{1b}[m", &text, a..b);
            let obeyed = place.excerpt().contains('\u{1b}');
            prop_assert!(!obeyed);
        }
    }
}
