//! Tables of words, for the terminal and for a page.

use crate::html;

/// A titled table; the first column is left-aligned, the others right-aligned.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Table {
    pub title: String,
    /// What a reader must know, below the title; may be empty.
    pub note: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// Blanks between columns.
const GAP: usize = 2;

impl Table {
    /// Aligned text.
    pub fn text(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().chain([&self.header]).filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let line = |row: &Vec<String>| {
            let mut line = String::from(" ");
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                let blanks = " ".repeat(width - cell.chars().count());
                line += &match column {
                    0 => format!(" {cell}{blanks}"),
                    _ => format!("{}{blanks}{cell}", " ".repeat(GAP)),
                };
            }
            line.trim_end().to_owned() + "\n"
        };
        let mut text = format!("  {}\n", self.title);
        for note in self.note.lines() {
            text += &format!("  {note}\n");
        }
        text += &line(&self.header);
        text + &self.rows.iter().map(line).collect::<String>()
    }

    /// HTML.
    pub fn html(&self) -> String {
        let rows: String = self.rows.iter().map(|cells| html::row(cells)).collect();
        let note = html::soft(&self.note.replace('\n', " "));
        html::section(&self.title, &(note + &html::table(&self.header, &rows)))
    }
}

/// A probability as tables tell it.
pub(super) fn probability(p: f64) -> String {
    if p < 1e-3 { "<0.001".to_owned() } else { format!("{p:.3}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let words = |words: [&str; 2]| words.map(str::to_owned).to_vec();
        Table {
            title: "A & B".to_owned(),
            note: "first\nsecond".to_owned(),
            header: words(["name", "value"]),
            rows: vec![words(["a", "1.5 ± 0.1"]), words(["longer", "< 2"])],
        }
    }

    #[test]
    fn columns_line_up() {
        let expected =
            "  A & B\n  first\n  second\n  name        value\n  a       1.5 ± 0.1\n  longer        < 2\n";
        assert_eq!(table().text(), expected);
    }

    #[test]
    fn markup_is_escaped() {
        let html = table().html();
        assert!(html.contains("<h2>A &amp; B</h2>") && html.contains("<td>&lt; 2</td>"), "{html}");
        assert!(html.contains("<p class=\"soft\">first second</p>"), "{html}");
    }
}
