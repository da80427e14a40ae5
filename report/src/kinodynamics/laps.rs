//! Laps of a track: where they led, which turns failed, how often at which speed, how far from the path.

use bench::kinodynamics::{RowReport, Track, TrackReport};

use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;

const TOP: f64 = 150.0;
const MAP_HEIGHT: f64 = 400.0;
const BARS_HEIGHT: f64 = 300.0;
const LEFT: f64 = 100.0;
const GAP: f64 = 80.0;
const BELOW: f64 = 90.0;
/// Models that are drawn: those of the paper.
const DRAWN: usize = 3;
const COLOURS: [Rgb; DRAWN] = [Rgb::FAILURE, Rgb::ROLL, Rgb::VEGETATION];
const SMALL: TextStyle = TextStyle::new(16, Anchor::Start);

pub(super) fn page(report: &TrackReport, half_width_m: f64) -> Canvas {
    let bars_top = TOP + MAP_HEIGHT + 150.0;
    let title = format!("Laps of the {} track, walls {half_width_m} m from the nominal line", report.track);
    let mut canvas = Canvas::titled(bars_top + BARS_HEIGHT + BELOW, &title, &[]);
    let rows: Vec<&RowReport> = report.rows.iter().take(DRAWN).collect();
    for (k, row) in rows.iter().enumerate() {
        let x = MARGIN + 330.0 * k as f64;
        canvas.rect(Rect { x, y: 70.0, width: 22.0, height: 16.0 }, COLOURS[k], 1.0);
        let told = format!("{}: {:.1} % succeed", row.row.name(), 100.0 * row.success);
        canvas.text((x + 32.0, 85.0), &told, SMALL);
    }
    let speeds = [0, report.speeds_mps.len() / 2, report.speeds_mps.len() - 1];
    let width = (PAGE_WIDTH - LEFT - MARGIN - 2.0 * GAP) / 3.0;
    let frame =
        |place: usize, y: f64, height: f64| Rect { x: LEFT + (width + GAP) * place as f64, y, width, height };
    for (place, speed) in speeds.into_iter().enumerate() {
        draw_map(report, &rows, speed, frame(place, TOP, MAP_HEIGHT), &mut canvas);
    }
    draw_shares(&rows, &report.speeds_mps, frame(0, bars_top, BARS_HEIGHT), &mut canvas);
    draw_turns(&rows, frame(1, bars_top, BARS_HEIGHT), &mut canvas);
    draw_distances(&rows, &report.speeds_mps, frame(2, bars_top, BARS_HEIGHT), &mut canvas);
    canvas
}

fn track_of(report: &TrackReport) -> Track {
    if report.track == "indoor" { Track::indoor() } else { Track::outdoor() }
}

/// Axes of equal scale around a track.
fn map_axes(track: &Track, frame: Rect) -> Axes {
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        track.nodes_m.iter().map(|node| node[axis]).fold(start, pick)
    };
    let [low, high] = [(f64::min as fn(f64, f64) -> f64, f64::INFINITY), (f64::max, f64::NEG_INFINITY)]
        .map(|(pick, start)| [0, 1].map(|axis| bound(axis, pick, start)));
    let margin_m = 0.8;
    let span = [0, 1].map(|axis| high[axis] - low[axis] + 2.0 * margin_m);
    let metres_per_px = (span[0] / frame.width).max(span[1] / frame.height);
    let range = |axis: usize, length: f64| {
        let middle = 0.5 * (low[axis] + high[axis]);
        let half = 0.5 * metres_per_px * length;
        Range { low: middle - half, high: middle + half }
    };
    Axes { frame, x: range(0, frame.width), y: range(1, frame.height) }
}

fn draw_map(report: &TrackReport, rows: &[&RowReport], speed: usize, frame: Rect, canvas: &mut Canvas) {
    let track = track_of(report);
    let axes = map_axes(&track, frame);
    let title = format!("{} m/s; circles: failed turns", number(report.speeds_mps[speed], 1));
    canvas.text((frame.x, frame.y - 38.0), &title, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    canvas.clipped(frame, |canvas| {
        for (row, colour) in rows.iter().zip(COLOURS) {
            let per_speed = row.laps.len() / report.speeds_mps.len();
            for lap in &row.laps[speed * per_speed..(speed + 1) * per_speed] {
                for piece in &lap.path_m {
                    let points: Vec<Point> =
                        piece.iter().map(|[x, y]| axes.place(f64::from(*x), f64::from(*y))).collect();
                    canvas.polyline(&points, Stroke::solid(Rgb::WHITE.blend(colour, 0.55), 1.0));
                }
            }
        }
        let mut nodes: Vec<Point> = track.nodes_m.iter().map(|[x, y]| axes.place(*x, *y)).collect();
        nodes.push(nodes[0]);
        canvas.polyline(&nodes, Stroke::solid(Rgb::INK, 1.5));
    });
    for turn in 0..track.n_turns() {
        let middle_m = 0.5 * (track.turn_begin_m(turn) + track.turn_begin_m(turn + 1));
        let ([x, y], _) = track.place(middle_m);
        let place = axes.place(x, y);
        canvas.rimmed_text((place.0 - 8.0, place.1 - 14.0), &format!("T{}", turn + 1), SMALL);
        for (k, (row, colour)) in rows.iter().zip(COLOURS).enumerate() {
            let per_speed = row.laps.len() / report.speeds_mps.len();
            let share = row.failures_at[speed][turn] as f64 / per_speed as f64;
            if share > 0.0 {
                let centre = (place.0 + 12.0 * (k as f64 - 1.0), place.1 + 10.0);
                canvas.circle(
                    centre,
                    3.0 + 11.0 * share,
                    Rgb::WHITE.blend(colour, 0.6),
                    Stroke::solid(colour, 2.0),
                );
            }
        }
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "east [m]");
    canvas.text((frame.x - 62.0, frame.y - 14.0), "north [m]", TextStyle::new(16, Anchor::Start));
}

/// A frame for shares of failed turns.
fn share_frame(title: &str, x: Range, frame: Rect, label: &str, canvas: &mut Canvas) -> Axes {
    let axes = Axes { frame, x, y: Range { low: 0.0, high: 100.0 } };
    canvas.text((frame.x, frame.y - 44.0), title, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    axes.draw_labelled(canvas, label, "failed turns [%]");
    axes
}

fn draw_shares(rows: &[&RowReport], speeds_mps: &[f64], frame: Rect, canvas: &mut Canvas) {
    let range = Range { low: speeds_mps[0] - 0.05, high: speeds_mps[speeds_mps.len() - 1] + 0.05 };
    let axes = share_frame("Failures over target speed", range, frame, "target speed [m/s]", canvas);
    for (row, colour) in rows.iter().zip(COLOURS) {
        let points = speeds_mps.iter().zip(&row.failed_per_speed);
        let points: Vec<Point> = points.map(|(speed, share)| axes.place(*speed, 100.0 * share)).collect();
        canvas.polyline(&points, Stroke::solid(colour, 2.5));
        for point in points {
            canvas.circle(point, 4.0, colour, Stroke::solid(colour, 1.0));
        }
    }
}

fn draw_turns(rows: &[&RowReport], frame: Rect, canvas: &mut Canvas) {
    let n = rows.first().map_or(1, |row| row.failed_per_turn.len());
    let range = Range { low: 0.5, high: n as f64 + 0.5 };
    let axes = share_frame("Failures at each turn", range, frame, "turn", canvas);
    for (k, (row, colour)) in rows.iter().zip(COLOURS).enumerate() {
        for (turn, share) in row.failed_per_turn.iter().enumerate() {
            let left = turn as f64 + 1.0 + 0.25 * (k as f64 - 1.5);
            let (x, y) = axes.place(left, 100.0 * share);
            let width = 0.23 * frame.width / n as f64;
            canvas.rect(Rect { x, y, width, height: frame.bottom() - y }, colour, 1.0);
        }
    }
}

/// Box plots of the laps' mean distance to the path.
fn draw_distances(rows: &[&RowReport], speeds_mps: &[f64], frame: Rect, canvas: &mut Canvas) {
    let most =
        rows.iter().flat_map(|row| &row.distance_m).map(|quartiles| quartiles.0[4]).fold(0.1, f64::max);
    let x = Range { low: speeds_mps[0] - 0.05, high: speeds_mps[speeds_mps.len() - 1] + 0.05 };
    let axes = Axes { frame, x, y: Range { low: 0.0, high: 1.05 * most } };
    canvas.text(
        (frame.x, frame.y - 44.0),
        "Mean distance of a lap to the path",
        TextStyle::new(20, Anchor::Start).bold(),
    );
    axes.draw_rules(canvas);
    axes.draw_labelled(canvas, "target speed [m/s]", "distance [m]: extremes, quartiles, median");
    for (k, (row, colour)) in rows.iter().zip(COLOURS).enumerate() {
        for (speed, quartiles) in speeds_mps.iter().zip(&row.distance_m) {
            let [least, quarter, middle, three, largest] = quartiles.0;
            let centre = speed + 0.028 * (k as f64 - 1.0);
            let at = |value: f64| axes.place(centre, value);
            let half = 0.011 / axes.x.span() * frame.width;
            canvas.line(at(least), at(largest), Stroke::solid(colour, 1.0));
            let (x, top) = at(three);
            let height = at(quarter).1 - top;
            canvas.rect(
                Rect { x: x - half, y: top, width: 2.0 * half, height },
                Rgb::WHITE.blend(colour, 0.5),
                1.0,
            );
            let y = at(middle).1;
            canvas.line((x - half, y), (x + half, y), Stroke::solid(colour, 2.0));
        }
    }
}
