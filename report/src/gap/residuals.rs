//! How large: residuals by quantity and horizon, before, after and the floor.

use sim_to_real::{ResidualCell, ResidualState};

use super::{AFTER, BEFORE, FLOOR, Pictures, draw_legend, words};
use crate::axes::{Axes, Range};
use crate::canvas::MARGIN;
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const STATES: [ResidualState; 6] = [
    ResidualState::Along,
    ResidualState::Across,
    ResidualState::Yaw,
    ResidualState::ForwardSpeed,
    ResidualState::YawRate,
    ResidualState::SideSpeed,
];
const LEFT: f64 = 100.0;
const TOP: f64 = 210.0;
const WIDTH: f64 = 222.0;
const HEIGHT: f64 = 300.0;
const STEP: [f64; 2] = [250.0, 450.0];

/// One of the sizes of a residual.
type Size = fn(&ResidualCell) -> f64;

pub(super) fn page(pictures: &Pictures<'_>) -> Option<Canvas> {
    let rows = [
        ("The drives the cause was sought in", &pictures.findings.residuals[..]),
        ("Held-out drives", pictures.heldout_residuals),
    ];
    let rows: Vec<_> = rows.into_iter().filter(|(_, cells)| !cells.is_empty()).collect();
    if rows.is_empty() {
        return None;
    }
    let unit = pictures.reference.unit();
    let line = format!("root mean square residual in {unit}, by how far ahead is predicted");
    let mut canvas =
        Canvas::titled(TOP + STEP[1] * rows.len() as f64 - 50.0, "How large the residual is", &[&line]);
    let floor = Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 3.0) };
    let below = format!("floor: {}", pictures.reference.floor());
    let entries = [
        (pictures.reference.model(), Stroke::solid(BEFORE, 3.0)),
        ("with the announced effects", Stroke::solid(AFTER, 3.0)),
        (below.as_str(), floor),
    ];
    draw_legend(&entries, (MARGIN, 122.0), &mut canvas);
    for (row, (title, cells)) in rows.iter().enumerate() {
        let top = TOP + STEP[1] * row as f64;
        canvas.text((MARGIN, top - 44.0), title, TextStyle::new(20, Anchor::Start).bold());
        draw_row(cells, top, &mut canvas);
    }
    Some(canvas)
}

fn draw_row(cells: &[ResidualCell], top: f64, canvas: &mut Canvas) {
    let sizes = cells.iter().flat_map(|cell| [cell.before, cell.after, cell.floor]);
    let most = sizes.filter(|size| size.is_finite()).fold(1.0, f64::max);
    let furthest_s = cells.iter().map(|cell| cell.horizon_s).fold(0.1, f64::max);
    for (column, state) in STATES.into_iter().enumerate() {
        let frame = Rect { x: LEFT + STEP[0] * column as f64, y: top, width: WIDTH, height: HEIGHT };
        let range = Range { low: 0.0, high: 1.08 * most };
        let axes = Axes { frame, x: Range { low: 0.0, high: 1.08 * furthest_s }, y: range };
        axes.draw_rules(canvas);
        let mut own: Vec<_> = cells.iter().filter(|cell| cell.state == state).collect();
        own.sort_by(|a, b| a.horizon_s.total_cmp(&b.horizon_s));
        draw_curves(&own, &axes, canvas);
        axes.draw_frame(canvas);
        axes.draw_x_ticks(canvas);
        if column == 0 {
            axes.draw_y_ticks(canvas);
            let place = (frame.x - 70.0, frame.y - 16.0);
            canvas.text(place, "[st. dev.]", TextStyle::new(16, Anchor::Start).coloured(Rgb::INK_SOFT));
        }
        axes.draw_x_label(canvas, "predicted ahead [s]");
        let middle = (frame.x + 0.5 * WIDTH + 20.0, frame.y - 14.0);
        canvas.text(middle, words::state(state), TextStyle::new(18, Anchor::Middle));
    }
}

fn draw_curves(cells: &[&ResidualCell], axes: &Axes, canvas: &mut Canvas) {
    // The first ones are wider, to be seen below the others.
    let curves: [(Size, Stroke); 3] = [
        (|cell| cell.before, Stroke::solid(BEFORE, 6.0)),
        (|cell| cell.after, Stroke::solid(AFTER, 3.0)),
        (|cell| cell.floor, Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 2.0) }),
    ];
    for (value, stroke) in curves {
        let own = cells.iter().filter(|cell| value(cell).is_finite());
        let points: Vec<_> = own.map(|cell| axes.place(cell.horizon_s, value(cell))).collect();
        canvas.polyline(&points, stroke);
        let radius = 2.5 + stroke.width;
        points.iter().for_each(|point| {
            canvas.circle(*point, radius, stroke.colour, Stroke::solid(Rgb::WHITE, 1.5));
        });
    }
}
