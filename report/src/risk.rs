//! The risk sweep: how often the goal is reached, and how soon, over the risk tolerance.

mod text;

use bench::risk::{Cell, Report, Row};

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;
pub use text::text;

/// Panels beside each other.
const COLUMNS: usize = 4;
const TOP: f64 = 190.0;
const LEFT: f64 = 80.0;
const GAP: f64 = 60.0;
const SUCCESS_HEIGHT: f64 = 340.0;
const TIME_HEIGHT: f64 = 200.0;
const BETWEEN: f64 = 110.0;
const BELOW: f64 = 140.0;
/// How far marks of the same tolerance stand apart.
const ASIDE: f64 = 0.016;
/// Longest time that is shown: that of a run [s].
const LONGEST_S: f64 = 15.0;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);

/// A method's colour, and where its marks stand beside the tolerance.
#[derive(Clone, Copy)]
struct Look {
    colour: Rgb,
    aside: f64,
}

const WHOLE_BIN: Look = Look { colour: Rgb::PITCH, aside: 0.0 };
const EXACT: Look = Look { colour: Rgb::ROLL, aside: ASIDE };
const PUBLISHED: Look = Look { colour: Rgb::INK, aside: -ASIDE };

/// Draws success over the risk tolerance, a panel for each density, and below it the time to the goal, as a PNG 1600 px
/// wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    page(report).png()
}

fn page(report: &Report) -> Canvas {
    let panels = panels(report);
    let line_height = SUCCESS_HEIGHT + BETWEEN + TIME_HEIGHT + BELOW;
    let n_lines = panels.len().div_ceil(COLUMNS);
    let told = format!(
        "EVORA's semantic grid, {} runs a point and method, seeds from {}; bars are 95 % Wilson intervals",
        report.n_runs, report.first_seed
    );
    let height = TOP + line_height * n_lines as f64;
    let mut canvas = Canvas::titled(height, "Risk tolerance and how often the goal is reached", &[&told]);
    draw_legend(&mut canvas);
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (COLUMNS - 1) as f64) / COLUMNS as f64;
    for (index, panel) in panels.into_iter().enumerate() {
        let (column, line) = (index % COLUMNS, index / COLUMNS);
        let corner = (LEFT + (width + GAP) * column as f64, TOP + line_height * line as f64);
        draw_panel(panel, corner, width, &mut canvas);
    }
    canvas
}

/// The cells of each density, which lie together.
fn panels(report: &Report) -> Vec<&[Cell]> {
    report.cells.chunk_by(|cell, next| cell.density == next.density).collect()
}

fn draw_legend(canvas: &mut Canvas) {
    let y = 128.0;
    let meanings = [
        (PUBLISHED, "published, whole bins", 270.0),
        (WHOLE_BIN, "whole bins", 180.0),
        (EXACT, "exact CVaR", 0.0),
    ];
    let mut x = MARGIN + 8.0;
    for (look, meaning, width) in meanings {
        draw_mark((x, y - 6.0), look, canvas);
        canvas.text((x + 18.0, y), meaning, TEXT);
        x += width;
    }
}

fn draw_panel(cells: &[Cell], (x, y): Point, width: f64, canvas: &mut Canvas) {
    let tolerances = Range { low: 0.0, high: 1.05 };
    let frame = Rect { x, y, width, height: SUCCESS_HEIGHT };
    let success = Axes { frame, x: tolerances, y: Range { low: 0.0, high: 103.0 } };
    let frame = Rect { x, y: y + SUCCESS_HEIGHT + BETWEEN, width, height: TIME_HEIGHT };
    let time = Axes { frame, x: tolerances, y: Range { low: 0.0, high: LONGEST_S } };
    for axes in [success, time] {
        axes.draw_rules(canvas);
        axes.draw_frame(canvas);
        axes.draw_x_ticks(canvas);
        axes.draw_y_ticks(canvas);
        axes.draw_x_label(canvas, "risk tolerance alpha [-]");
    }
    let density = cells.first().map_or(0.0, |cell| cell.density);
    let heading = |y: f64| (x, y - 14.0);
    canvas.text(heading(y), &format!("density {density}: goal reached [%]"), TEXT.bold());
    canvas.text(heading(time.frame.y), "mean time to the goal [s]", TEXT);
    draw_success(cells, &success, canvas);
    draw_times(cells, &time, canvas);
}

fn draw_success(cells: &[Cell], axes: &Axes, canvas: &mut Canvas) {
    let percent = |cell: &Cell, row: &Row| (cell.alpha, 100.0 * row.success);
    draw_line(cells.iter().map(|cell| percent(cell, &cell.whole_bin)), axes, WHOLE_BIN, canvas);
    draw_line(cells.iter().map(|cell| percent(cell, &cell.exact)), axes, EXACT, canvas);
    for cell in cells {
        for (row, look) in [(&cell.whole_bin, WHOLE_BIN), (&cell.exact, EXACT)] {
            let at = |share: f64| axes.place(cell.alpha + look.aside, 100.0 * share);
            canvas.line(at(row.wilson_low), at(row.wilson_high), Stroke::solid(look.colour, 2.5));
            draw_mark(at(row.success), look, canvas);
        }
        if let Some(published) = &cell.published {
            draw_mark(axes.place(cell.alpha + PUBLISHED.aside, 100.0 * published.success), PUBLISHED, canvas);
        }
    }
}

fn draw_times(cells: &[Cell], axes: &Axes, canvas: &mut Canvas) {
    for (look, row) in [(WHOLE_BIN, whole_bin as fn(&Cell) -> &Row), (EXACT, exact)] {
        let times = cells.iter().filter_map(|cell| Some((cell.alpha, row(cell).mean_time_to_goal_s?)));
        draw_line(times.clone(), axes, look, canvas);
        times.for_each(|(alpha, time_s)| draw_mark(axes.place(alpha + look.aside, time_s), look, canvas));
    }
    for cell in cells {
        let Some(published) = &cell.published else { continue };
        let [low, high] =
            published.time_to_goal_s.map(|time_s| axes.place(cell.alpha + PUBLISHED.aside, time_s));
        canvas.line(low, high, Stroke::solid(PUBLISHED.colour, 2.5));
        draw_mark((low.0, 0.5 * (low.1 + high.1)), PUBLISHED, canvas);
    }
}

fn whole_bin(cell: &Cell) -> &Row {
    &cell.whole_bin
}

fn exact(cell: &Cell) -> &Row {
    &cell.exact
}

/// By ascending tolerance, however they were asked for.
fn draw_line(points: impl Iterator<Item = (f64, f64)>, axes: &Axes, look: Look, canvas: &mut Canvas) {
    let mut points: Vec<(f64, f64)> = points.collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let places: Vec<Point> = points.iter().map(|&(x, y)| axes.place(x + look.aside, y)).collect();
    canvas.polyline(&places, Stroke::solid(look.colour, 2.0));
}

fn draw_mark(place: Point, look: Look, canvas: &mut Canvas) {
    canvas.circle(place, 6.0, look.colour, Stroke::solid(Rgb::WHITE, 1.5));
}
