//! The hall: how often and how fast each method came through, and every way that it took (PIETRA, figures 9 and 10).

mod plan;
mod tables;

use bench::arena::{Mission, Report, Row, Run};
use bench::closed_loop::Method;
use bench::statistics::Mean;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;
use crate::{Picture, html, verdict};

const TOP: f64 = 140.0;
const BARS_HEIGHT: f64 = 240.0;
const BETWEEN: f64 = 110.0;
const LEFT: f64 = 90.0;
const GAP: f64 = 40.0;
const BELOW_PLAN: f64 = 84.0;
const LEGEND_HEIGHT: f64 = 60.0;
/// Of the width that a row has in a panel, its bar takes so much.
const BAR_SHARE: f64 = 0.5;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);

/// The tables and the rules.
pub fn text(report: &Report) -> String {
    let mut told = tables::rows(report).text();
    if !report.comparisons.is_empty() {
        told += &format!("\n{}", tables::comparisons(report).text());
    }
    if !report.verdicts.is_empty() {
        told += &format!("\n{}", verdict::text(&report.verdicts));
    }
    told
}

/// How one drive ended, in a line.
pub fn run_text(run: &Run) -> String {
    let Run { mission, method, number, bush_height_m, outcome, time_s, .. } = run;
    let (method, mission, way) = (method.name(), mission.name(), tables::way_name(run.way));
    format!(
        "{method:<10} {mission:<6}run {:<4}bushes {bush_height_m:.2} m, {way}: {outcome} after {time_s:.1} s",
        number + 1
    )
}

/// The page, with its picture.
pub fn page(report: &Report, picture: &Picture, revision: &str) -> String {
    let line = format!(
        "{}, {} runs of seed {} with every method over short bushes and over tall ones, alpha {}, time limit {} s, {:?}, \
         revision {revision}.",
        report.vehicle, report.n_runs, report.seed, report.alpha, report.time_limit_s, report.isa,
    );
    let mut body = html::heading("Bushes and a ramp that nobody has driven on", &line);
    if !report.verdicts.is_empty() {
        body += &verdict::section(&report.verdicts);
    }
    if let Some(training) = &report.training {
        let told = format!("Learned from {}: {} footprints.", training.provenance, training.n_training);
        body += &html::paragraph(&told);
    }
    body += &html::figure(picture);
    body += &tables::rows(report).html();
    if !report.comparisons.is_empty() {
        body += &tables::comparisons(report).html();
    }
    html::page("Arena benchmark", &body)
}

/// Draws success and time with their intervals, and below them the hall with all ways of each mission and method, as a PNG
/// 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Picture, EncodeError> {
    let methods = methods(report);
    let n = methods.len().max(1) as f64;
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (n - 1.0)) / n;
    let plan_height = plan::height(width);
    let plans_top = TOP + BARS_HEIGHT + BETWEEN;
    let bottom = plans_top + Mission::ALL.len() as f64 * (plan_height + BELOW_PLAN);
    let told = format!(
        "{} · {} runs of seed {} with every method and mission · alpha {} · bars and whiskers: 95 % intervals",
        report.vehicle, report.n_runs, report.seed, report.alpha
    );
    let mut canvas =
        Canvas::titled(bottom + LEGEND_HEIGHT, "Bushes and a ramp that nobody has driven on", &[&told]);
    draw_bars(report, &mut canvas);
    for (line, &mission) in Mission::ALL.iter().enumerate() {
        for (column, &method) in methods.iter().enumerate() {
            let x = LEFT + (width + GAP) * column as f64;
            let y = plans_top + (plan_height + BELOW_PLAN) * line as f64;
            let frame = Rect { x, y, width, height: plan_height };
            plan::draw(report, (mission, method), frame, &mut canvas);
        }
    }
    plan::draw_legend(bottom + 20.0, &mut canvas);
    let caption = "Success and time of each mission and method, and every way that was taken".to_owned();
    Ok(Picture { file: "arena.png", caption, png: canvas.png()? })
}

/// In the order of their rows.
fn methods(report: &Report) -> Vec<Method> {
    let of_first = report.rows.iter().take_while(|row| row.mission == report.rows[0].mission);
    of_first.map(|row| row.method).collect()
}

fn draw_bars(report: &Report, canvas: &mut Canvas) {
    let half = 0.5 * (PAGE_WIDTH - LEFT - MARGIN - 2.0 * GAP);
    let most_s = report.rows.iter().filter_map(|row| row.time_s).map(|mean| mean.high).fold(1.0, f64::max);
    let panels = [("goal reached [%]", 103.0), ("time of those that arrived [s]", 1.1 * most_s)];
    for (place, (heading, high)) in panels.into_iter().enumerate() {
        let frame =
            Rect { x: LEFT + (half + 2.0 * GAP) * place as f64, y: TOP, width: half, height: BARS_HEIGHT };
        let x = Range { low: -0.5, high: report.rows.len() as f64 - 0.5 };
        let axes = Axes { frame, x, y: Range { low: 0.0, high } };
        axes.draw_frame(canvas);
        axes.draw_y_ticks(canvas);
        canvas.text((frame.x, frame.y - 12.0), heading, TEXT.bold());
        for (place_of_row, row) in report.rows.iter().enumerate() {
            let [value, low, high] = row.goal.map(|share| 100.0 * share);
            let value = if place == 0 { Some(Mean { value, low, high }) } else { row.time_s };
            draw_bar(row, value, place_of_row, &axes, canvas);
        }
    }
}

fn draw_bar(row: &Row, value: Option<Mean>, place: usize, axes: &Axes, canvas: &mut Canvas) {
    let at = |value: f64| axes.place(place as f64, value);
    let (x, bottom) = at(axes.y.low);
    let width = BAR_SHARE * axes.frame.width / axes.x.span();
    let colour = if row.mission == Mission::Short { Rgb::VEGETATION } else { Rgb::PITCH };
    if let Some(Mean { value, low, high }) = value {
        let top = at(value).1;
        canvas.rect(Rect { x: x - 0.5 * width, y: top, width, height: bottom - top }, colour, 0.45);
        canvas.line(at(low), at(high), Stroke::solid(Rgb::INK, 2.5));
        canvas.circle(at(value), 5.0, Rgb::INK, Stroke::solid(Rgb::WHITE, 1.5));
    }
    let style = TextStyle::new(15, Anchor::Middle).coloured(Rgb::INK_SOFT);
    canvas.text((x, axes.frame.bottom() + 22.0), row.method.name(), style);
    canvas.text((x, axes.frame.bottom() + 42.0), row.mission.name(), style);
}
