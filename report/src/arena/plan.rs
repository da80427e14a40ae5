//! The hall from above, with all drives of one mission and method.

use bench::arena::{Mission, Report, Run};
use bench::closed_loop::Method;
use scenarios::{ARENA_GOAL_M, ARENA_SIZE_M, ArenaPart, ArenaWay, arena_parts};

use super::tables::way_name;
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, MARGIN, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const FLOOR: Rgb = Rgb(0xee, 0xec, 0xe8);
const TURF: Rgb = Rgb(0xc9, 0xdd, 0xb2);
const BUSHES: Rgb = Rgb(0x6f, 0x9e, 0x55);
const RAMP: Rgb = Rgb(0xd9, 0xb3, 0x82);
const RAIL: Rgb = Rgb(0x8a, 0x66, 0x3a);
const CRATES: Rgb = Rgb(0x5a, 0x64, 0x74);
const SOFT: TextStyle = TextStyle::new(15, Anchor::Start).coloured(Rgb::INK_SOFT);
/// How near to the goal counts as there [m].
const GOAL_RADIUS_M: f64 = 0.3;

/// Height of a plan of a width.
pub(super) fn height(width: f64) -> f64 {
    width * ARENA_SIZE_M[1] / ARENA_SIZE_M[0]
}

fn colour_of(part: ArenaPart) -> Rgb {
    match part {
        ArenaPart::Turf => TURF,
        ArenaPart::Bushes => BUSHES,
        ArenaPart::Ramp => RAMP,
        ArenaPart::Rail => RAIL,
        ArenaPart::Crates => CRATES,
    }
}

fn colour_of_way(way: Option<ArenaWay>) -> Rgb {
    match way {
        Some(ArenaWay::Bushes) => Rgb(0x1d, 0x5c, 0x2e),
        Some(ArenaWay::Ramp) => Rgb::PITCH,
        Some(ArenaWay::Floor) => Rgb::ROLL,
        None => Rgb::INK_SOFT,
    }
}

/// Draws the drives of a mission and method.
pub(super) fn draw(report: &Report, (mission, method): (Mission, Method), frame: Rect, canvas: &mut Canvas) {
    let [east_m, north_m] = ARENA_SIZE_M;
    let axes = Axes { frame, x: Range { low: 0.0, high: east_m }, y: Range { low: 0.0, high: north_m } };
    canvas.rect(frame, FLOOR, 1.0);
    for (part, [west, south, east, north]) in arena_parts() {
        let ((x, y), (right, bottom)) = (axes.place(west, north), axes.place(east, south));
        canvas.rect(Rect { x, y, width: right - x, height: bottom - y }, colour_of(part), 1.0);
    }
    let radius = GOAL_RADIUS_M * frame.width / east_m;
    let goal = axes.place(ARENA_GOAL_M[0], ARENA_GOAL_M[1]);
    canvas.circle(goal, radius, Rgb::WHITE, Stroke::solid(Rgb::INK, 1.5));
    let runs = report.runs.iter().filter(|run| (run.mission, run.method) == (mission, method));
    canvas.clipped(frame, |canvas| runs.for_each(|run| draw_run(run, &axes, canvas)));
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "east x, north y [m]");
    let told = format!("{}, {} bushes", method.name(), mission.name());
    canvas.text((frame.x, frame.y - 10.0), &told, TextStyle::new(17, Anchor::Start).bold());
}

fn draw_run(run: &Run, axes: &Axes, canvas: &mut Canvas) {
    let points: Vec<Point> = run.path_m.iter().map(|&[x_m, y_m]| axes.place(x_m, y_m)).collect();
    canvas.polyline(&points, Stroke::solid(colour_of_way(run.way), 1.6));
    if let (false, Some(&(x, y))) = (run.arrived(), points.last()) {
        for (right, down) in [(6.0, 6.0), (6.0, -6.0)] {
            canvas.line((x - right, y - down), (x + right, y + down), Stroke::solid(Rgb::FAILURE, 3.0));
        }
    }
}

/// What the colours mean.
pub(super) fn draw_legend(y: f64, canvas: &mut Canvas) {
    let ways = [Some(ArenaWay::Bushes), Some(ArenaWay::Ramp), Some(ArenaWay::Floor), None];
    let lines = ways.map(|way| (colour_of_way(way), format!("way: {}", way_name(way))));
    let parts = [(TURF, "turf"), (BUSHES, "bushes"), (RAMP, "ramp"), (RAIL, "rail"), (CRATES, "crates")];
    let parts = parts.map(|(colour, name)| (colour, name.to_owned()));
    let mut x = MARGIN;
    for (colour, meaning) in lines.into_iter().chain(parts) {
        canvas.rect(Rect { x, y: y - 13.0, width: 26.0, height: 16.0 }, colour, 1.0);
        canvas.text((x + 34.0, y), &meaning, SOFT);
        x += 56.0 + 8.2 * meaning.len() as f64;
    }
    canvas.text((x, y), "red cross: where a drive ended that did not arrive", SOFT);
}
