//! What is left: the quantities that the announced effects leave off, each over the condition that it follows most.

use sim_to_real::{Answer, LeftBin, LeftOver};

use super::{BEFORE, FLOOR, Reference, draw_legend, words};
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, MARGIN, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const TOP: f64 = 230.0;
const PANEL: Rect = Rect { x: 120.0, y: 0.0, width: 390.0, height: 220.0 };
const STEP: [f64; 2] = [505.0, 370.0];
const N_COLUMNS: usize = 3;

pub(super) fn page(answer: &Answer, reference: Reference) -> Option<Canvas> {
    let shapes: Vec<&LeftOver> = answer.left.iter().filter(|shape| shape.bins.len() > 1).collect();
    let horizon_s = shapes.first()?.horizon_s;
    let line = format!(
        "mean of what was measured less what was foretold {horizon_s} s ahead with the announced effects"
    );
    let height = TOP + STEP[1] * shapes.len().div_ceil(N_COLUMNS) as f64 - 40.0;
    let mut canvas = Canvas::titled(height, "What is left", &[&line]);
    let entries = [
        ("real drives", Stroke::solid(BEFORE, 3.0)),
        (reference.floor(), Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 3.0) }),
    ];
    draw_legend(&entries, (MARGIN, 130.0), &mut canvas);
    for (place, shape) in shapes.iter().enumerate() {
        let (column, row) = ((place % N_COLUMNS) as f64, (place / N_COLUMNS) as f64);
        let frame = Rect { x: PANEL.x + column * STEP[0], y: TOP + row * STEP[1], ..PANEL };
        draw_panel(shape, frame, &mut canvas);
    }
    Some(canvas)
}

fn draw_panel(shape: &LeftOver, frame: Rect, canvas: &mut Canvas) {
    let means = shape.bins.iter().flat_map(|bin| [Some(bin.mean), bin.null_mean, Some(0.0)]).flatten();
    let y = around(means);
    let x = around(shape.bins.iter().flat_map(|bin| [bin.low, bin.high]));
    let axes = Axes { frame, x, y };
    axes.draw_rules(canvas);
    let zero = axes.place(x.low, 0.0).1;
    canvas.line((frame.x, zero), (frame.right(), zero), Stroke::solid(Rgb::INK_SOFT, 1.5));
    let dashed = Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 3.0) };
    let null: fn(&LeftBin) -> Option<f64> = |bin| bin.null_mean;
    let real: fn(&LeftBin) -> Option<f64> = |bin| Some(bin.mean);
    for (mean, stroke) in [(null, dashed), (real, Stroke::solid(BEFORE, 3.0))] {
        let steps = shape.bins.iter().filter_map(|bin| Some((bin, mean(bin)?)));
        let steps = steps.filter(|(_, mean)| mean.is_finite());
        let points: Vec<Point> =
            steps.flat_map(|(bin, mean)| [bin.low, bin.high].map(|x| axes.place(x, mean))).collect();
        canvas.polyline(&points, stroke);
    }
    let (name, unit) = words::condition(shape.condition);
    let quantity = words::state(shape.quantity);
    axes.draw_labelled(
        canvas,
        &format!("{name} [{unit}]"),
        &format!("{quantity} [{}]", shape.quantity.unit()),
    );
    let share = format!("{:.0} % of what is left", 100.0 * shape.share);
    let style = TextStyle::new(16, Anchor::End).coloured(Rgb::INK_SOFT);
    canvas.text((frame.right(), frame.y - 14.0), &share, style);
}

/// From the least to the greatest of the finite values, with some room.
fn around(values: impl Iterator<Item = f64>) -> Range {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let room = if high > low { 0.08 * (high - low) } else { 0.5 };
    if low.is_finite() {
        Range { low: low - room, high: high + room }
    } else {
        Range { low: -0.5, high: 0.5 }
    }
}
