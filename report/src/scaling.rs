//! How cost grows, as text and picture.

use bench::scaling::{Curve, Over, Point, Report};

use crate::axes::{Axes, Range, round_step};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const TOP: f64 = 170.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 100.0;
const GAP: f64 = 90.0;
/// From the top of one row of panels to that of the next.
const ROW: f64 = 440.0;
const N_COLS: usize = 4;
const LINE: Stroke = Stroke::solid(Rgb::ROLL, 2.5);
const WHISKER: Stroke = Stroke::solid(Rgb::INK_SOFT, 1.5);

/// Draws every curve as a PNG of 1600 px width: medians as rings, from the least to the 99th percentile as lines.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let n_rows = report.curves.len().div_ceil(N_COLS);
    let title = format!("Cost of an update, {} threads", report.threads);
    let note = "rings: median; lines: from the least to the 99th percentile";
    let mut canvas = Canvas::titled(TOP + ROW * n_rows as f64, &title, &[note]);
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (N_COLS as f64 - 1.0)) / N_COLS as f64;
    for (index, curve) in report.curves.iter().enumerate() {
        let (row, col) = (index / N_COLS, index % N_COLS);
        let x = LEFT + (width + GAP) * col as f64;
        let frame = Rect { x, y: TOP + ROW * row as f64, width, height: HEIGHT };
        draw(curve, frame, &mut canvas);
    }
    canvas.png()
}

fn draw(curve: &Curve, frame: Rect, canvas: &mut Canvas) {
    let scale = scale(curve.over);
    let most = |of: fn(&Point) -> f64| curve.points.iter().map(of).fold(0.0, f64::max);
    let axes =
        Axes { frame, x: upto(scale * most(|point| point.value)), y: upto(most(|point| point.ms.p99)) };
    let [title, x_label] = words(curve.over);
    canvas.text((frame.x, frame.y - 44.0), title, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    let place = |point: &Point, ms: f64| axes.place(scale * point.value, ms);
    canvas.clipped(frame, |canvas| {
        for point in &curve.points {
            canvas.line(place(point, point.ms.min), place(point, point.ms.p99), WHISKER);
        }
        let medians: Vec<_> = curve.points.iter().map(|point| place(point, point.ms.median)).collect();
        canvas.polyline(&medians, LINE);
        medians.iter().for_each(|&at| canvas.circle(at, 4.0, Rgb::WHITE, LINE));
    });
    axes.draw_labelled(canvas, x_label, "time [ms]");
}

/// From nothing to a little more than the largest value.
fn upto(most: f64) -> Range {
    let step = round_step(most / 5.0);
    Range { low: 0.0, high: step * (most / step * 1.02).ceil().max(1.0) }
}

/// Shares are shown in percent.
fn scale(over: Over) -> f64 {
    match over {
        Over::ChangedBlock | Over::ChangedScattered => 100.0,
        _ => 1.0,
    }
}

/// What a panel shows, and over what.
fn words(over: Over) -> [&'static str; 2] {
    match over {
        Over::Rollouts => ["Controller update", "rollouts"],
        Over::Steps => ["Controller update", "steps of the horizon"],
        Over::ControllerThreads => ["Controller update", "threads"],
        Over::Cells => ["Whole learned map", "cells"],
        Over::Yaws => ["Whole learned map", "yaw bins"],
        Over::ChangedBlock => ["Map, one block changed", "changed cells [%]"],
        Over::ChangedScattered => ["Map, scattered changes", "changed cells [%]"],
        Over::MapThreads => ["Whole learned map", "threads"],
    }
}

/// What was measured, for a terminal.
pub fn text(report: &Report) -> String {
    report.curves.iter().map(curve_text).collect()
}

fn curve_text(curve: &Curve) -> String {
    let [title, over] = words(curve.over);
    let judged = |point: &Point| {
        point.judged_share.map_or_else(String::new, |share| format!("{:>13.1} %", 100.0 * share))
    };
    let head = if curve.points.iter().any(|point| point.judged_share.is_some()) { "judged anew" } else { "" };
    let mut told = format!("  {title}\n");
    told += format!("  {over:>22}{:>13}{head:>15}", "median [ms]").trim_end();
    told.push('\n');
    for point in &curve.points {
        let value = scale(curve.over) * point.value;
        told += format!("  {value:>22}{:>13.3}{}", point.ms.median, judged(point)).trim_end();
        told.push('\n');
    }
    told + "\n"
}
