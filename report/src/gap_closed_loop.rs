//! The closed-loop table as a picture: for every gap and belief each quantity as a dot on its interval.

mod text;

use bench::gap_closed_loop::{Belief, Ground, Report, Row};
use bench::statistics::Mean;

use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;
pub use text::{drive_text, text};

const TOP: f64 = 180.0;
const LINE_HEIGHT: f64 = 20.0;
const BETWEEN_GAPS: f64 = 16.0;
const BETWEEN_GROUNDS: f64 = 140.0;
const PANELS_X: f64 = 190.0;
const PANEL_GAP: f64 = 42.0;
const N_COLUMNS: usize = 4;

/// One quantity of a row.
struct Panel {
    label: &'static str,
    read: fn(&Row) -> Option<Mean>,
    /// Factor on the value.
    scale: f64,
}

const COURSE: [Panel; 4] = [
    Panel { label: "end reached [%]", read: success, scale: 100.0 },
    Panel { label: "RMS distance from course [m]", read: |row| row.across_rms_m, scale: 1.0 },
    Panel { label: "RMS speed error [m/s]", read: |row| row.speed_rms_mps, scale: 1.0 },
    Panel { label: "RMS error of plans after 0.5 s [m]", read: |row| row.plan_rms_m, scale: 1.0 },
];
const ROCKS: [Panel; 3] = [
    Panel { label: "goal reached [%]", read: success, scale: 100.0 },
    Panel { label: "time to the goal [s]", read: |row| row.time_s, scale: 1.0 },
    Panel { label: "RMS error of plans after 0.5 s [m]", read: |row| row.plan_rms_m, scale: 1.0 },
];

fn success(row: &Row) -> Option<Mean> {
    let [low, high] = row.wilson;
    Some(Mean { value: row.n_goal as f64 / row.n as f64, low, high })
}

fn colour(belief: Belief) -> Rgb {
    match belief {
        Belief::Bare => Rgb(0x9a, 0xa3, 0xb0),
        Belief::Nominal => Rgb(0xd9, 0x6a, 0x0b),
        Belief::Repaired => Rgb(0x1f, 0x6f, 0xd1),
        Belief::True => Rgb(0x1b, 0x22, 0x30),
    }
}

fn meaning(belief: Belief) -> &'static str {
    match belief {
        Belief::Bare => "bare: kinematic bicycle",
        Belief::Nominal => "nominal: calibrated on the simulator",
        Belief::Repaired => "repaired by the diagnosis",
        Belief::True => "true effect",
    }
}

/// Draws the table as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    page(report).png()
}

fn page(report: &Report) -> Canvas {
    let grounds: Vec<(Ground, Vec<&Row>)> = Ground::ALL
        .into_iter()
        .map(|ground| (ground, report.rows.iter().filter(|row| row.ground == ground).collect()))
        .filter(|(_, rows): &(Ground, Vec<&Row>)| !rows.is_empty())
        .collect();
    let height: f64 = grounds.iter().map(|(_, rows)| block_height(rows) + BETWEEN_GROUNDS).sum();
    let told = format!(
        "{} · seeds 1 to {} in every row · means with 95 % intervals over the seeds (shares: Wilson)",
        report.vehicle, report.n_seeds
    );
    let title = "What a repaired model is worth in closed loop";
    let mut canvas = Canvas::titled(TOP + height, title, &[&told]);
    draw_legend(&mut canvas);
    let mut top = TOP;
    for (ground, rows) in &grounds {
        let (title, panels): (_, &[Panel]) = match ground {
            Ground::Course => ("a slalom at speed, over known hills", &COURSE),
            Ground::Rocks => ("the rock field, to a goal, map from scans", &ROCKS),
        };
        let style = TextStyle::new(20, Anchor::Start).bold();
        canvas.text((PANELS_X, top - 16.0), title, style);
        draw_block(rows, panels, top, &mut canvas);
        top += block_height(rows) + BETWEEN_GROUNDS;
    }
    canvas
}

fn draw_legend(canvas: &mut Canvas) {
    let mut x = MARGIN + 8.0;
    for belief in Belief::ALL {
        canvas.circle((x, 108.0), 7.0, colour(belief), Stroke::solid(Rgb::WHITE, 1.5));
        canvas.text((x + 16.0, 114.0), meaning(belief), TextStyle::new(17, Anchor::Start));
        x += 60.0 + 8.8 * meaning(belief).len() as f64;
    }
}

/// Lines of a block from its top, each with the height of its middle; a gap's lines stand together.
fn lines<'a>(rows: &[&'a Row]) -> Vec<(&'a Row, f64)> {
    let mut y = 0.0;
    let mut lines: Vec<(&Row, f64)> = Vec::new();
    for &row in rows {
        let is_next_gap = lines.last().is_some_and(|(last, _)| last.gap != row.gap);
        y += if is_next_gap { BETWEEN_GAPS } else { 0.0 } + LINE_HEIGHT;
        lines.push((row, y));
    }
    lines
}

fn block_height(rows: &[&Row]) -> f64 {
    lines(rows).last().map_or(0.0, |(_, y)| y + LINE_HEIGHT)
}

fn draw_block(rows: &[&Row], panels: &[Panel], top: f64, canvas: &mut Canvas) {
    let (lines, height) = (lines(rows), block_height(rows));
    let all_width = PAGE_WIDTH - MARGIN - PANELS_X;
    let width = (all_width - PANEL_GAP * (N_COLUMNS - 1) as f64) / N_COLUMNS as f64;
    for (index, panel) in panels.iter().enumerate() {
        let x = PANELS_X + index as f64 * (width + PANEL_GAP);
        let frame = Rect { x, y: top, width, height };
        draw_panel(&lines, panel, frame, canvas);
    }
    let mut last = None;
    for &(row, y) in &lines {
        if last.replace(row.gap) != Some(row.gap) {
            let name = TextStyle::new(18, Anchor::End);
            canvas.text((PANELS_X - 14.0, top + y + 6.0), row.gap.name(), name);
        }
    }
}

fn draw_panel(lines: &[(&Row, f64)], panel: &Panel, frame: Rect, canvas: &mut Canvas) {
    let read = |row: &Row| {
        let Mean { value, low, high } = (panel.read)(row)?;
        Some([value, low, high].map(|value| panel.scale * value))
    };
    let highest = lines.iter().filter_map(|(row, _)| read(row)).map(|[_, _, high]| high).fold(0.0, f64::max);
    let high = if highest > 0.0 { 1.05 * highest } else { 1.0 };
    let axes = Axes { frame, x: Range { low: 0.0, high }, y: Range { low: -frame.height, high: 0.0 } };
    let (ticks, decimals) = axes.x.ticks(5.0);
    let soft = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);
    for &tick in &ticks {
        let x = axes.place(tick, 0.0).0;
        canvas.line((x, frame.y), (x, frame.bottom()), Stroke::solid(Rgb::RULE, 1.0));
        canvas.text((x, frame.bottom() + 22.0), &number(tick, decimals), soft);
    }
    for (row, y) in lines {
        let Some([value, low, high]) = read(row) else {
            let style = TextStyle::new(14, Anchor::Start).coloured(colour(row.belief));
            canvas.text((frame.x + 6.0, frame.y + y + 5.0), "none arrived", style);
            continue;
        };
        let at = |value: f64| axes.place(value, -y);
        canvas.line(at(low), at(high), Stroke::solid(colour(row.belief), 2.5));
        canvas.circle(at(value), 6.0, colour(row.belief), Stroke::solid(Rgb::WHITE, 1.5));
    }
    axes.draw_frame(canvas);
    axes.draw_x_label(canvas, panel.label);
}
