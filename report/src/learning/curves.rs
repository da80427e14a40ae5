//! Figure 6: errors over the unevenness of the ground.

use bench::learning::{Report, Row};

use super::{draw_legend, draw_title, look, stroke};
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

pub(super) fn draw(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let axes = Axes { frame, x: unevenness_range(report), y: error_range(report) };
    draw_title("Error over unevenness (figure 6), mean and standard deviation over the seeds", frame, canvas);
    axes.draw_rules(canvas);
    canvas.clipped(frame, |canvas| {
        Row::ALL.into_iter().for_each(|row| draw_spread(report, row, &axes, canvas));
        Row::ALL.into_iter().rev().for_each(|row| draw_curve(report, row, &axes, canvas));
    });
    draw_boundary(report, &axes, canvas);
    draw_counts(report, &axes, canvas);
    axes.draw_labelled(
        canvas,
        "standard deviation of elevation under the footprint [m]",
        "EMD², sum of four parameters [squared bins]",
    );
    draw_legend(&Row::ALL, (frame.right() + 36.0, frame.y + 24.0), canvas);
}

/// From level ground to the end of the last bin.
pub(super) fn unevenness_range(report: &Report) -> Range {
    Range { low: 0.0, high: report.unevenness_bins.last().map_or(1.0, |bin| f64::from(bin.high_m)) }
}

/// Middle of a bin of unevenness [m].
pub(super) fn middle_m(report: &Report, bin: usize) -> f64 {
    let bin = &report.unevenness_bins[bin];
    0.5 * (f64::from(bin.low_m) + f64::from(bin.high_m))
}

fn error_range(report: &Report) -> Range {
    let errors = report.rows.iter().flat_map(|row| &row.curve).filter(|point| point.mean.is_finite());
    let reach = |sign: f64| errors.clone().map(move |point| point.mean + sign * point.deviation);
    let (low, high) = (reach(-1.0).fold(f64::INFINITY, f64::min), reach(1.0).fold(0.0, f64::max));
    if low >= high {
        return Range { low: 0.0, high: 1.0 };
    }
    // Room above for the numbers of footprints.
    Range { low: (low - 0.05 * (high - low)).max(0.0), high: high + 0.1 * (high - low) }
}

/// Places of a curve at `sign` deviations from its mean, where anything was measured.
fn places(report: &Report, row: Row, axes: &Axes, sign: f64) -> Vec<Point> {
    let curve = report.row(row).curve.iter().enumerate().filter(|(_, point)| point.mean.is_finite());
    curve.map(|(bin, p)| axes.place(middle_m(report, bin), p.mean + sign * p.deviation)).collect()
}

fn draw_spread(report: &Report, row: Row, axes: &Axes, canvas: &mut Canvas) {
    let mut outline = places(report, row, axes, 1.0);
    outline.extend(places(report, row, axes, -1.0).into_iter().rev());
    if outline.len() > 2 {
        canvas.polygon(&outline, look(row).0, 0.18);
    }
}

fn draw_curve(report: &Report, row: Row, axes: &Axes, canvas: &mut Canvas) {
    let points = places(report, row, axes, 0.0);
    canvas.polyline(&points, stroke(row));
    for point in points {
        canvas.circle(point, 4.0, look(row).0, Stroke::solid(Rgb::WHITE, 1.0));
    }
}

/// Where the training ends.
pub(super) fn draw_boundary(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    let x = axes.place(f64::from(report.testbed.unevenness_max_m), axes.y.low).0;
    let line = Stroke { dash: "8 5", ..Stroke::solid(Rgb::INK, 1.5) };
    canvas.line((x, axes.frame.y), (x, axes.frame.bottom()), line);
    let style = TextStyle::new(15, Anchor::Start).coloured(Rgb::INK_SOFT);
    canvas.text((x + 6.0, axes.frame.bottom() - 10.0), "out of distribution →", style);
}

/// How many footprints stand behind each point.
fn draw_counts(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    for (bin, counted) in report.unevenness_bins.iter().enumerate() {
        let x = axes.place(middle_m(report, bin), axes.y.low).0;
        let style = TextStyle::new(14, Anchor::Middle).coloured(Rgb::INK_SOFT);
        canvas.text((x, axes.frame.y + 20.0), &format!("n = {}", counted.n), style);
    }
}
