//! The crossings: how every run ended, and one of them from above.

mod text;

use bench::crossings::{Crossing, Moment, Report, Row};
use scenarios::{Outcome, Walker};

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN};
use crate::colour::{Ramp, Rgb};
pub use text::{run_text, text};

const GRID_TOP: f64 = 126.0;
/// Runs beside each other.
const COLUMNS: usize = 50;
const CELL: f64 = 24.0;
const ROW_GAP: f64 = 66.0;
const PLAN_SIDE: f64 = 760.0;
/// Half of what is shown of the ground [m].
const PLAN_M: f64 = 12.0;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);

/// Draws how every run ended, and the first run in which the vehicle stopped for somebody, as a PNG 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    page(report).png()
}

fn page(report: &Report) -> Canvas {
    let lines = (report.n_runs as usize).div_ceil(COLUMNS);
    let block = CELL * lines as f64 + ROW_GAP;
    let plan_top = GRID_TOP + block * report.rows.len() as f64 + 70.0;
    let told = format!(
        "{}, {} people in each run, seed {}; one square is a run",
        report.vehicle, report.n_walkers, report.seed
    );
    let mut canvas = Canvas::titled(plan_top + PLAN_SIDE + 80.0, "People who cross the way", &[&told]);
    for (row, sum) in report.rows.iter().enumerate() {
        let runs: Vec<&Crossing> = report.runs.iter().filter(|run| run.handling == sum.handling).collect();
        draw_row(sum, &runs, GRID_TOP + block * row as f64, &mut canvas);
    }
    draw_meanings(plan_top - 50.0, &mut canvas);
    if let Some(run) = report.runs.iter().find(|run| run.n_stops_for_moving > 2) {
        draw_plan(run, plan_top, &mut canvas);
    }
    canvas
}

fn draw_row(sum: &Row, runs: &[&Crossing], top: f64, canvas: &mut Canvas) {
    let told = format!(
        "{}: {} of {} reached the goal, {} struck somebody, {} of them avoidably",
        sum.handling.name(),
        sum.n_goal,
        sum.n_runs,
        sum.n_struck,
        sum.n_avoidable
    );
    canvas.text((MARGIN, top + 14.0), &told, TEXT.bold());
    for (place, run) in runs.iter().enumerate() {
        let (column, line) = (place % COLUMNS, place / COLUMNS);
        let (x, y) = (MARGIN + CELL * column as f64, top + 26.0 + CELL * line as f64);
        let (fill, letter) = look(run);
        canvas.rect(Rect { x, y, width: CELL - 2.0, height: CELL - 2.0 }, fill, 1.0);
        let centre = (x + 0.5 * CELL - 1.0, y + 0.5 * CELL + 5.0);
        canvas.text(centre, letter, TextStyle::new(15, Anchor::Middle).bold().coloured(Rgb::WHITE));
    }
}

/// Colour and letter of how a run ended.
fn look(run: &Crossing) -> (Rgb, &'static str) {
    match (run.outcome, run.contact.is_some_and(|contact| contact.was_avoidable)) {
        (Outcome::Goal, _) if run.n_stops_for_moving > 0 => (Rgb(0x4f, 0xa8, 0x7c), ""),
        (Outcome::Goal, _) => (Rgb(0xbf, 0xe3, 0xd0), ""),
        (_, true) => (Rgb::FAILURE, "A"),
        (Outcome::WalkerStruck, false) => (Rgb(0x7d, 0x2a, 0x14), "U"),
        _ => (Rgb::INK_SOFT, "X"),
    }
}

fn draw_meanings(y: f64, canvas: &mut Canvas) {
    let meanings = [
        (Rgb(0xbf, 0xe3, 0xd0), "", "goal"),
        (Rgb(0x4f, 0xa8, 0x7c), "", "goal, stopped for somebody"),
        (Rgb::FAILURE, "A", "struck, a stop would have avoided it"),
        (Rgb(0x7d, 0x2a, 0x14), "U", "struck, unavoidably"),
        (Rgb::INK_SOFT, "X", "else"),
    ];
    let mut x = MARGIN;
    for (fill, letter, meaning) in meanings {
        canvas.rect(Rect { x, y: y - 16.0, width: CELL, height: CELL }, fill, 1.0);
        let style = TextStyle::new(15, Anchor::Middle).bold().coloured(Rgb::WHITE);
        canvas.text((x + 0.5 * CELL, y + 2.0), letter, style);
        canvas.text((x + CELL + 8.0, y + 2.0), meaning, TEXT);
        x += CELL + 30.0 + 9.4 * meaning.len() as f64;
    }
}

/// Where everybody was, twice a second: the same colour is the same time.
fn draw_plan(run: &Crossing, top: f64, canvas: &mut Canvas) {
    let Some(middle) = run.trail.iter().find(|moment| moment.stops).or(run.trail.first()) else { return };
    let [x_m, y_m, _] = middle.pose;
    let frame = Rect { x: MARGIN + 60.0, y: top, width: PLAN_SIDE, height: PLAN_SIDE };
    let axes = Axes {
        frame,
        x: Range { low: x_m - PLAN_M, high: x_m + PLAN_M },
        y: Range { low: y_m - PLAN_M, high: y_m + PLAN_M },
    };
    let end_s = run.trail.last().map_or(1.0, |moment| moment.time_s.max(1.0));
    canvas.clipped(frame, |canvas| {
        for moment in &run.trail {
            let colour = time_colour(moment.time_s / end_s);
            draw_moment(moment, colour, &axes, canvas);
        }
    });
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "east x [m]");
    axes.draw_y_label(canvas, "north y [m]");
    let x = frame.right() + 40.0;
    let lines = [
        format!("{}, run {}", run.handling.name(), run.number),
        format!("{} after {:.1} s", run.outcome, run.time_s),
        "rings: people, twice a second".to_owned(),
        "dots: the rear axle; with a bar: it stopped for somebody".to_owned(),
        format!("the same colour is the same time, from 0 to {end_s:.0} s"),
    ];
    for (line, told) in lines.iter().enumerate() {
        canvas.text((x, top + 30.0 + 30.0 * line as f64), told, TEXT);
    }
    for step in 0..100 {
        let bar = Rect { x: x + 4.0 * f64::from(step), y: top + 190.0, width: 4.0, height: 18.0 };
        canvas.rect(bar, time_colour(f64::from(step) / 99.0), 1.0);
    }
}

/// Without the end of the ramp that is nearly white.
fn time_colour(share: f64) -> Rgb {
    Ramp::SPEED.at(0.75 * share as f32)
}

fn draw_moment(moment: &Moment, colour: Rgb, axes: &Axes, canvas: &mut Canvas) {
    let [x_m, y_m, yaw_rad] = moment.pose;
    let centre = axes.place(x_m, y_m);
    let scale = axes.frame.width / axes.x.span();
    for [x_m, y_m] in &moment.walkers_m {
        let place = axes.place(*x_m, *y_m);
        canvas.circle(place, scale * Walker::RADIUS_M, Rgb::WHITE, Stroke::solid(colour, 3.0));
    }
    if moment.stops {
        let across = |sense: f64| -> Point {
            let (sin, cos) = yaw_rad.sin_cos();
            axes.place(x_m - sense * 0.9 * sin, y_m + sense * 0.9 * cos)
        };
        canvas.line(across(-1.0), across(1.0), Stroke::solid(colour, 4.0));
    }
    canvas.circle(centre, 6.0, colour, Stroke::solid(Rgb::INK, 1.0));
}
