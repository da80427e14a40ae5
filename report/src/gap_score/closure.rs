//! How far gaps close on held-out drives, against the prediction.

use bench::gap_score::Hit;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const SCATTER: Rect = Rect { x: 130.0, y: 190.0, width: 620.0, height: 620.0 };
const CURVE: Rect = Rect { x: 920.0, y: 190.0, width: 620.0, height: 620.0 };
/// Closed fractions below are drawn at the edge.
const LOWEST: f64 = -0.5;
const HIGHEST: f64 = 1.2;
const EXACT: Rgb = Rgb(0x0d, 0x7a, 0x56);

/// A case that had something to close: achieved, predicted, and whether the right set was announced.
struct Closed {
    achieved: f64,
    predicted: Option<f64>,
    is_exact: bool,
}

pub(super) fn page(cases: &[Hit], title: &str) -> Option<Canvas> {
    let closed: Vec<Closed> = cases
        .iter()
        .filter_map(|hit| {
            let is_exact = hit.is_exact?;
            Some(Closed { achieved: hit.closed?, predicted: hit.predicted_closed, is_exact })
        })
        .collect();
    if closed.is_empty() {
        return None;
    }
    let told = format!("{} cases with one or two effects and a gap to close; held-out drives", closed.len());
    let mut canvas = Canvas::titled(920.0, title, &[&told]);
    draw_scatter(&closed, &mut canvas);
    draw_curve(&closed, &mut canvas);
    Some(canvas)
}

fn draw_axes(axes: &Axes, [x, y]: [&str; 2], canvas: &mut Canvas) {
    axes.draw_rules(canvas);
    axes.draw_labelled(canvas, x, y);
}

fn draw_scatter(closed: &[Closed], canvas: &mut Canvas) {
    let range = Range { low: LOWEST, high: HIGHEST };
    let axes = Axes { frame: SCATTER, x: range, y: range };
    draw_axes(&axes, ["predicted closed fraction [-]", "achieved closed fraction [-]"], canvas);
    let equal = Stroke { colour: Rgb::INK_SOFT, width: 2.0, dash: "8 6" };
    canvas.line(axes.place(LOWEST, LOWEST), axes.place(HIGHEST, HIGHEST), equal);
    for case in closed {
        let Some(predicted) = case.predicted else { continue };
        let [x, y] = [predicted, case.achieved].map(|value| value.clamp(LOWEST, HIGHEST));
        let colour = if case.is_exact { EXACT } else { Rgb::FAILURE };
        canvas.circle(axes.place(x, y), 6.0, colour, Stroke::solid(Rgb::WHITE, 1.0));
    }
    let entries = [("announced exactly what was added", EXACT), ("something else", Rgb::FAILURE)];
    for (place, (name, colour)) in entries.into_iter().enumerate() {
        let (x, y) = (SCATTER.x + 24.0, SCATTER.y + 30.0 + 28.0 * place as f64);
        canvas.circle((x, y - 6.0), 6.0, colour, Stroke::solid(Rgb::WHITE, 1.0));
        canvas.rimmed_text((x + 16.0, y), name, TextStyle::new(16, Anchor::Start));
    }
}

/// Share of cases that close at most so much.
fn draw_curve(closed: &[Closed], canvas: &mut Canvas) {
    let axes =
        Axes { frame: CURVE, x: Range { low: LOWEST, high: HIGHEST }, y: Range { low: 0.0, high: 1.0 } };
    draw_axes(&axes, ["closed fraction [-]", "share of cases that close at most so much [-]"], canvas);
    let mut achieved: Vec<f64> = closed.iter().map(|case| case.achieved.clamp(LOWEST, HIGHEST)).collect();
    achieved.sort_by(f64::total_cmp);
    let n = achieved.len() as f64;
    let mut points = vec![axes.place(LOWEST, 0.0)];
    for (rank, &value) in achieved.iter().enumerate() {
        points.push(axes.place(value, rank as f64 / n));
        points.push(axes.place(value, (rank + 1) as f64 / n));
    }
    points.push(axes.place(HIGHEST, 1.0));
    canvas.polyline(&points, Stroke::solid(Rgb::ROLL, 3.0));
}
