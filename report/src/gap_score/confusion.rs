//! What is taken for what, as a matrix.

use bench::gap_score::{Confusion, truth};

use crate::canvas::PAGE_WIDTH;
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const LEFT: f64 = 270.0;
const TOP: f64 = 280.0;
const WIDEST_CELL: f64 = 64.0;
const CELL_HEIGHT: f64 = 34.0;
/// Levels that the columns' names take turns on.
const LEVELS: usize = 5;
const RIGHT: Rgb = Rgb(0x0d, 0x7a, 0x56);

/// How an answer stands to what had been added.
fn is_right(truth: &str, answer: &str) -> bool {
    let mimics = truth::mimics(truth).is_some_and(|names| names.contains(&answer));
    truth == answer || mimics || (answer == "unknown" && truth.starts_with("unk_"))
}

pub(crate) fn page(confusion: &Confusion, title: &str) -> Option<Canvas> {
    let (n_rows, n_columns) = (confusion.truths.len(), confusion.answers.len());
    if n_rows == 0 {
        return None;
    }
    let height = CELL_HEIGHT * n_rows as f64;
    let cell_width = ((PAGE_WIDTH - LEFT - 120.0) / n_columns as f64).min(WIDEST_CELL);
    let mut canvas = Canvas::titled(
        TOP + height + 60.0,
        title,
        &["rows: what had been added · columns: what was announced first · green: right"],
    );
    for (row, (truth, counts)) in confusion.truths.iter().zip(&confusion.counts).enumerate() {
        let y = TOP + CELL_HEIGHT * row as f64;
        let n: usize = counts.iter().sum();
        let name = TextStyle::new(16, Anchor::End);
        canvas.text((LEFT - 46.0, y + 23.0), truth, name);
        canvas.text((LEFT - 12.0, y + 23.0), &n.to_string(), name.coloured(Rgb::INK_SOFT));
        for (column, (answer, &count)) in confusion.answers.iter().zip(counts).enumerate() {
            let x = LEFT + cell_width * column as f64;
            let cell = Rect { x: x + 1.0, y: y + 1.0, width: cell_width - 2.0, height: CELL_HEIGHT - 2.0 };
            draw_cell(cell, count, n, is_right(truth, answer), &mut canvas);
        }
    }
    for (column, answer) in confusion.answers.iter().enumerate() {
        let x = LEFT + cell_width * (column as f64 + 0.5);
        draw_staggered(answer, x, column % LEVELS, &mut canvas);
    }
    Some(canvas)
}

fn draw_cell(cell: Rect, count: usize, n: usize, is_right: bool, canvas: &mut Canvas) {
    let (colour, faint) = if is_right { (RIGHT, 0.12) } else { (Rgb::FAILURE, 0.0) };
    canvas.rect(cell, Rgb::RULE, 0.35);
    if count == 0 {
        canvas.rect(cell, colour, faint);
        return;
    }
    let share = count as f64 / n as f64;
    canvas.rect(cell, colour, 0.25 + 0.75 * share);
    let ink = if share > 0.4 { Rgb::WHITE } else { Rgb::INK };
    let style = TextStyle::new(16, Anchor::Middle).coloured(ink).bold();
    canvas.text((cell.x + 0.5 * cell.width, cell.y + 22.0), &count.to_string(), style);
}

/// Names of columns, letter below letter would be hard to read: neighbours on different levels, with a line down.
fn draw_staggered(name: &str, x: f64, level: usize, canvas: &mut Canvas) {
    let y = TOP - 30.0 - 26.0 * level as f64;
    canvas.line((x, y + 6.0), (x, TOP - 3.0), Stroke::solid(Rgb::RULE, 1.5));
    canvas.rimmed_text((x, y), name, TextStyle::new(15, Anchor::Middle));
}
