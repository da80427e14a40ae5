//! The navigation table as a picture: how every drive ended, and what each row adds up to.

mod levels;
mod page;
mod tables;
mod text;

use bench::navigation::{DriveResult, Report, Row, name_of_outcome};
use scenarios::Outcome;

use crate::Picture;
use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN};
use crate::colour::Rgb;
pub use levels::picture as picture_of_levels;
pub use page::page;
pub use text::{drive_text, text};

const ROW_HEIGHT: f64 = 48.0;
const GRID_TOP: f64 = 150.0;
const GRID_X: f64 = 270.0;
/// Narrowest and widest grid.
const GRID_WIDTHS: [f64; 2] = [110.0, 770.0];
const WIDEST_CELL: f64 = 48.0;
/// Cells narrower than this hold no text.
const NARROWEST_WITH_TEXT: f64 = 28.0;
/// Columns are numbered so that two numbers are at least this far apart.
const NUMBER_SPACING: f64 = 34.0;
const SHARE_WIDTH: f64 = 270.0;
const GAP: f64 = 36.0;
const BELOW_GRID: f64 = 96.0;
const LEGEND_HEIGHT: f64 = 50.0;

const TEXT: TextStyle = TextStyle::new(17, Anchor::Start);
const SOFT: TextStyle = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);

/// All outcomes of drives where nobody walks about, in the order of the legend. The letter tells them apart where colours do not.
const OUTCOMES: [Outcome; 9] = [
    Outcome::Goal,
    Outcome::Stuck,
    Outcome::Timeout,
    Outcome::Stopped,
    Outcome::OutOfBounds,
    Outcome::InWater,
    Outcome::AttitudeLimit,
    Outcome::Collision,
    Outcome::RolledOver,
];

/// Colour, colour of what is written on it, and letter. Worse for the vehicle is darker and redder; no failure is
/// green.
fn look(outcome: Outcome) -> (Rgb, Rgb, &'static str) {
    match outcome {
        Outcome::Goal => (Rgb(0xbf, 0xe3, 0xd0), Rgb(0x0d, 0x53, 0x3b), ""),
        Outcome::Stuck => (Rgb(0xff, 0xc4, 0x2e), Rgb::INK, "S"),
        Outcome::Timeout => (Rgb(0x9f, 0xb4, 0xd6), Rgb::INK, "T"),
        Outcome::Stopped => (Rgb(0x5a, 0x64, 0x74), Rgb::WHITE, "X"),
        Outcome::OutOfBounds => (Rgb(0x7a, 0x5a, 0xa8), Rgb::WHITE, "O"),
        Outcome::InWater => (Rgb(0x2b, 0x5c, 0x9e), Rgb::WHITE, "W"),
        Outcome::AttitudeLimit => (Rgb(0xe2, 0x6a, 0x2c), Rgb::WHITE, "A"),
        Outcome::Collision => (Rgb(0x7d, 0x2a, 0x14), Rgb::WHITE, "C"),
        Outcome::RolledOver => (Rgb(0xa8, 0x10, 0x2c), Rgb::WHITE, "R"),
        Outcome::WalkerStruck => (Rgb(0x4a, 0x04, 0x2a), Rgb::WHITE, "P"),
    }
}

/// Draws how every drive ended, with each row's share of success and median time, as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Picture, EncodeError> {
    let caption = "How every drive ended, and how often each row reached the goal".to_owned();
    Ok(Picture { file: "navigation.png", caption, png: drawn(report).png()? })
}

fn drawn(report: &Report) -> Canvas {
    let height = ROW_HEIGHT * report.rows.len() as f64;
    let rows = Range { low: -(report.rows.len() as f64), high: 0.0 };
    let n = f64::from(report.plan.n_maps * report.plan.n_pairs).max(1.0);
    let width = (WIDEST_CELL * n).clamp(GRID_WIDTHS[0], GRID_WIDTHS[1]);
    let frame = Rect { x: GRID_X, y: GRID_TOP, width, height };
    let grid = Axes { frame, x: Range { low: 0.5, high: n + 0.5 }, y: rows };
    let frame = Rect { x: frame.right() + GAP, width: SHARE_WIDTH, ..frame };
    let shares = Axes { frame, x: Range { low: 0.0, high: 100.0 }, y: rows };

    let told = format!(
        "40 m · {} at up to {} m/s · maps in every row: {}, starts and goals on each: {} · time limit {} s{}",
        report.plan.vehicle,
        report.plan.speed_mps,
        report.plan.n_maps,
        report.plan.n_pairs,
        report.plan.time_limit_s,
        if width / n < NARROWEST_WITH_TEXT { "" } else { " · numbers in cells: seconds to the goal" }
    );
    let height_px = GRID_TOP + height + BELOW_GRID + LEGEND_HEIGHT;
    let mut canvas = Canvas::titled(height_px, "How often the goal is reached", &[&told]);
    draw_grid(report, &grid, &mut canvas);
    draw_shares(report, &shares, &mut canvas);
    draw_numbers(report, &shares, &mut canvas);
    draw_legend(report, GRID_TOP + height + BELOW_GRID, &mut canvas);
    canvas
}

/// Middle of a row's height on the page.
fn row_y(axes: &Axes, row: usize) -> f64 {
    axes.place(axes.x.low, -(row as f64) - 0.5).1
}

/// "physics, alpha 0.6", or the method alone where it needs no level.
fn row_name(row: &Row) -> String {
    match row.alpha {
        Some(alpha) => format!("{}, alpha {alpha}", row.method.name()),
        None => row.method.name().to_owned(),
    }
}

fn draw_grid(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    let cell_width = axes.frame.width / axes.x.span();
    for (row, (sum, drives)) in report.rows_with_drives().enumerate() {
        let y = row_y(axes, row);
        let name = TextStyle::new(18, Anchor::End);
        canvas.text((axes.frame.x - 14.0, y + 6.0), &row_name(sum), name);
        for drive in drives {
            let x = axes.place(f64::from(column(report, drive)), 0.0).0;
            draw_cell(drive, (x, y), cell_width, canvas);
        }
    }
    let every = (NUMBER_SPACING / cell_width).ceil() as u32;
    let every = if every > 1 { every.next_multiple_of(5) } else { 1 };
    let columns = 1..=report.plan.n_maps * report.plan.n_pairs;
    for column in columns.filter(|column| column.is_multiple_of(every)) {
        let place = (axes.place(f64::from(column), 0.0).0, axes.frame.bottom() + 24.0);
        canvas.text(place, &column.to_string(), SOFT);
    }
    axes.draw_x_label(canvas, "start and goal, map by map");
}

/// Drives of one start and goal stand below each other, map by map, from 1.
fn column(report: &Report, drive: &DriveResult) -> u32 {
    drive.map * report.plan.n_pairs + drive.pair + 1
}

fn draw_cell(drive: &DriveResult, (x, y): Point, width: f64, canvas: &mut Canvas) {
    let (fill, ink, letter) = look(drive.outcome);
    // A hair of white between neighbours, but not where that would be most of the cell.
    let gap = if width > 8.0 { 2.0 } else { 0.0 };
    let (height, width_inside) = (ROW_HEIGHT - 4.0, width - gap);
    let rect = Rect { x: x - 0.5 * width_inside, y: y - 0.5 * height, width: width_inside, height };
    canvas.rect(rect, fill, 1.0);
    if width < NARROWEST_WITH_TEXT {
        return;
    }
    let style = TextStyle::new(16, Anchor::Middle).coloured(ink);
    match drive.outcome {
        Outcome::Goal => canvas.text((x, y + 6.0), &number(drive.time_s, 0), style),
        _ => canvas.text((x, y + 6.0), letter, style.bold()),
    }
}

/// Share of success as a dot on its interval.
fn draw_shares(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    let (ticks, decimals) = axes.x.ticks(5.0);
    for &tick in &ticks {
        let x = axes.place(tick, 0.0).0;
        canvas.line((x, axes.frame.y), (x, axes.frame.bottom()), Stroke::solid(Rgb::RULE, 1.0));
        canvas.text((x, axes.frame.bottom() + 24.0), &number(tick, decimals), SOFT);
    }
    for (index, row) in report.rows.iter().enumerate() {
        let y = row_y(axes, index);
        let at = |share: f64| (axes.place(100.0 * share, 0.0).0, y);
        let (low, high) = (at(row.wilson_low), at(row.wilson_high));
        let stroke = Stroke::solid(Rgb::INK, 2.5);
        canvas.line(low, high, stroke);
        for end in [low, high] {
            canvas.line((end.0, y - 7.0), (end.0, y + 7.0), stroke);
        }
        canvas.circle(at(row.success), 7.0, look(Outcome::Goal).1, Stroke::solid(Rgb::WHITE, 1.5));
    }
    axes.draw_frame(canvas);
    axes.draw_x_label(canvas, "goal reached [%], 95 % Wilson interval");
}

fn draw_numbers(report: &Report, shares: &Axes, canvas: &mut Canvas) {
    let right = shares.frame.right();
    let (count_x, time_x) = (right + 22.0, right + 144.0);
    let heading = TEXT.coloured(Rgb::INK_SOFT);
    canvas.text((count_x, GRID_TOP - 14.0), "reached", heading);
    canvas.text((time_x, GRID_TOP - 36.0), "median", heading);
    canvas.text((time_x, GRID_TOP - 14.0), "time [s]", heading);
    for (index, row) in report.rows.iter().enumerate() {
        let y = row_y(shares, index) + 6.0;
        canvas.text((count_x, y), &format!("{} of {}", row.n_goal, row.n), TEXT);
        let time = row.median_time_to_goal_s.map_or("none".to_owned(), |time_s| number(time_s, 1));
        canvas.text((time_x, y), &time, TEXT);
    }
}

/// The outcomes that occur.
fn draw_legend(report: &Report, y: f64, canvas: &mut Canvas) {
    let mut x = MARGIN;
    for outcome in OUTCOMES {
        let n: usize = report.rows.iter().filter_map(|row| row.outcomes.get(&outcome)).sum();
        if n == 0 {
            continue;
        }
        let (fill, ink, letter) = look(outcome);
        canvas.rect(Rect { x, y: y - 15.0, width: 30.0, height: 30.0 }, fill, 1.0);
        let style = TextStyle::new(16, Anchor::Middle).coloured(ink).bold();
        canvas.text((x + 15.0, y + 6.0), letter, style);
        let meaning = format!("{n} {}", name_of_outcome(outcome));
        canvas.text((x + 40.0, y + 6.0), &meaning, TEXT);
        x += 40.0 + 8.9 * meaning.len() as f64 + 22.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_has_a_look_of_its_own() {
        for (i, &outcome) in OUTCOMES.iter().enumerate() {
            for &other in &OUTCOMES[i + 1..] {
                assert_ne!(outcome, other);
                let ((fill, _, letter), (other_fill, _, other_letter)) = (look(outcome), look(other));
                assert!(fill != other_fill && letter != other_letter, "{outcome:?}, {other:?}");
            }
        }
    }
}
