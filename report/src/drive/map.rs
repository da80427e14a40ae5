//! The map: ground, risk, paths, vehicle, start and goal, with a scale.

use super::relief::relief;
use super::{DrivePicture, PathSample};
use crate::axes::{Axes, round_step};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};

const PATH_WIDTH: f64 = 5.0;
const PATH_RIM: f64 = 9.0;
/// Height from which a map has its scale drawn inside [px].
const SCALED_FROM: f64 = 300.0;
const PLANNED: Stroke = Stroke { colour: Rgb::INK, width: 2.5, dash: "10 7" };

pub(super) fn draw(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    draw_inside(picture, axes, canvas);
    axes.draw_labelled(canvas, "east x [m]", "north y [m]");
}

/// All of it but the frame and its ticks.
pub(super) fn draw_inside(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    canvas.image(axes.frame.x, axes.frame.y, &relief(picture, axes));
    canvas.clipped(axes.frame, |canvas| {
        draw_areas(picture, axes, canvas);
        draw_planned(picture, axes, canvas);
        draw_goal_area(picture, axes, canvas);
        draw_footprints(picture, axes, canvas);
        draw_driven(picture, axes, canvas);
        draw_walked(picture, axes, canvas);
        draw_ends(picture, axes, canvas);
        // On a low map it would hide the way, and the ticks tell lengths too.
        if axes.frame.height > SCALED_FROM {
            draw_scale_bar(axes, canvas);
        }
    });
}

fn draw_areas(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    let Some(areas) = picture.areas else { return };
    let placed = |corners_m: &Vec<[f64; 2]>| -> Vec<Point> {
        corners_m.iter().chain(corners_m.first()).map(|[x_m, y_m]| axes.place(*x_m, *y_m)).collect()
    };
    areas.keep_out_m.iter().for_each(|corners_m| keep_out_mark(&placed(corners_m), canvas));
    if !areas.geofence_m.is_empty() {
        geofence_line(&placed(&areas.geofence_m), canvas);
    }
}

/// The look of an area to keep out of, here and in the legend.
pub(super) fn keep_out_mark(corners: &[Point], canvas: &mut Canvas) {
    canvas.polygon(corners, Rgb::FAILURE, 0.3);
    canvas.polyline(corners, Stroke::solid(Rgb::FAILURE, 2.0));
}

/// The look of the fence, here and in the legend.
pub(super) fn geofence_line(points: &[Point], canvas: &mut Canvas) {
    canvas.polyline(points, Stroke::solid(Rgb::WHITE, 5.0));
    canvas.polyline(points, Stroke { colour: Rgb::FAILURE, width: 3.0, dash: "12 6" });
}

fn draw_planned(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    if picture.planned.len() > 1 {
        let points: Vec<Point> = picture.planned.iter().map(|[x_m, y_m]| axes.place(*x_m, *y_m)).collect();
        planned_line(&points, canvas);
    }
}

/// The look of a planned path, here and in the legend.
pub(super) fn planned_line(points: &[Point], canvas: &mut Canvas) {
    canvas.polyline(points, Stroke::solid(Rgb::WHITE, PLANNED.width + 2.0));
    canvas.polyline(points, PLANNED);
}

/// Fastest speed of a drive, for the colours; never zero [m/s].
pub(super) fn speed_scale_mps(picture: &DrivePicture<'_>) -> f64 {
    let fastest = picture.driven.iter().map(|sample| sample.speed_mps.abs()).fold(0.0, f64::max);
    let step = round_step(fastest / 10.0);
    (fastest / step).ceil().max(1.0) * step
}

fn draw_driven(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    let points: Vec<Point> = picture.driven.iter().map(|sample| axes.place(sample.x_m, sample.y_m)).collect();
    if points.len() < 2 {
        return;
    }
    canvas.polyline(&points, Stroke::solid(Rgb::INK, PATH_RIM));
    let scale_mps = speed_scale_mps(picture);
    for (ends, sample) in points.windows(2).zip(picture.driven) {
        let colour = Ramp::SPEED.at((sample.speed_mps.abs() / scale_mps) as f32);
        canvas.polyline(ends, Stroke::solid(colour, PATH_WIDTH));
    }
}

fn draw_walked(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    for way_m in picture.walked {
        let points: Vec<Point> = way_m.iter().map(|[x_m, y_m]| axes.place(*x_m, *y_m)).collect();
        walker_line(&points, canvas);
    }
}

/// The look of somebody's way, with a ring where it ends, here and in the legend.
pub(super) fn walker_line(points: &[Point], canvas: &mut Canvas) {
    canvas.polyline(points, Stroke::solid(Rgb::WHITE, 5.0));
    canvas.polyline(points, Stroke { colour: Rgb::WALKER, width: 3.0, dash: "3 4" });
    if let Some(end) = points.last() {
        canvas.circle(*end, 6.0, Rgb::WHITE, Stroke::solid(Rgb::WALKER, 3.0));
    }
}

/// The vehicle's outline every few lengths of the way, and where it ended.
fn draw_footprints(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    let spacing_m = (2.5 * picture.vehicle.geometry.length_m).max(axes.x.span() / 12.0);
    for sample in spaced(picture.driven, spacing_m) {
        let outline = footprint(picture, sample, axes);
        footprint_mark(&outline, canvas);
    }
}

/// The look of a vehicle's outline from its rear right corner on, with a strong front edge.
pub(super) fn footprint_mark(corners: &[Point; 5], canvas: &mut Canvas) {
    canvas.polygon(corners, Rgb::WHITE, 0.35);
    canvas.polyline(corners, Stroke::solid(Rgb::INK, 1.6));
    canvas.line(corners[1], corners[2], Stroke::solid(Rgb::INK, 4.0));
}

/// Samples at least `distance_m` apart, the last one always.
fn spaced(samples: &[PathSample], distance_m: f64) -> Vec<&PathSample> {
    let mut chosen: Vec<&PathSample> = Vec::new();
    for sample in samples {
        let far = chosen
            .last()
            .is_none_or(|last| (sample.x_m - last.x_m).hypot(sample.y_m - last.y_m) >= distance_m);
        if far {
            chosen.push(sample);
        }
    }
    match (chosen.last(), samples.last()) {
        (Some(chosen_last), Some(last)) if *chosen_last != last => chosen.push(last),
        _ => {}
    }
    chosen
}

/// Corners of the vehicle around its rear axle, closed: rear right, front right, front left, rear left.
fn footprint(picture: &DrivePicture<'_>, sample: &PathSample, axes: &Axes) -> [Point; 5] {
    let geometry = &picture.vehicle.geometry;
    let (rear, front) = (-geometry.rear_overhang_m, geometry.length_m - geometry.rear_overhang_m);
    let side = geometry.width_m / 2.0;
    let (sin, cos) = sample.yaw_rad.sin_cos();
    [(rear, -side), (front, -side), (front, side), (rear, side), (rear, -side)].map(|(ahead, left)| {
        axes.place(sample.x_m + ahead * cos - left * sin, sample.y_m + ahead * sin + left * cos)
    })
}

fn draw_goal_area(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    let centre = axes.place(picture.goal_m[0], picture.goal_m[1]);
    let radius = picture.goal_radius_m * axes.frame.width / axes.x.span();
    let rim: Vec<Point> = (0..=64)
        .map(|i| (f64::from(i) * std::f64::consts::TAU / 64.0).sin_cos())
        .map(|(sin, cos)| (centre.0 + radius * cos, centre.1 + radius * sin))
        .collect();
    canvas.polygon(&rim, Rgb::GOAL, 0.3);
    canvas.polyline(&rim, Stroke::solid(Rgb::INK, 1.5));
}

fn draw_ends(picture: &DrivePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    let label = TextStyle::new(18, Anchor::Middle).bold();
    let start = axes.place(picture.start_m[0], picture.start_m[1]);
    let goal = axes.place(picture.goal_m[0], picture.goal_m[1]);
    start_marker(start, canvas);
    canvas.rimmed_text((start.0, start.1 - 18.0), "start", label);
    goal_marker(goal, canvas);
    canvas.rimmed_text((goal.0, goal.1 - 20.0), "goal", label);
    if let (Some(failure), Some(end)) = (picture.failure, picture.driven.last()) {
        let place = axes.place(end.x_m, end.y_m);
        failure_marker(place, canvas);
        canvas.rimmed_text((place.0, place.1 + 34.0), failure, label.coloured(Rgb::FAILURE));
    }
}

/// A white disc with a dark rim.
pub(super) fn start_marker(place: Point, canvas: &mut Canvas) {
    canvas.circle(place, 8.0, Rgb::WHITE, Stroke::solid(Rgb::INK, 3.0));
}

/// A golden star with a dark rim.
pub(super) fn goal_marker(place: Point, canvas: &mut Canvas) {
    let star = |size: f64| -> Vec<Point> {
        (0..=10)
            .map(|i| (f64::from(i) * std::f64::consts::PI / 5.0).sin_cos())
            .zip([size, 0.45 * size].into_iter().cycle())
            .map(|((sin, cos), radius)| (place.0 + radius * sin, place.1 - radius * cos))
            .collect()
    };
    canvas.polyline(&star(13.0), Stroke::solid(Rgb::INK, 4.0));
    canvas.polygon(&star(13.0), Rgb::GOAL, 1.0);
}

/// A red cross with a white rim.
pub(super) fn failure_marker((x, y): Point, canvas: &mut Canvas) {
    for stroke in [Stroke::solid(Rgb::WHITE, 9.0), Stroke::solid(Rgb::FAILURE, 5.0)] {
        canvas.line((x - 10.0, y - 10.0), (x + 10.0, y + 10.0), stroke);
        canvas.line((x - 10.0, y + 10.0), (x + 10.0, y - 10.0), stroke);
    }
}

/// A round length, about a seventh of the map's width, in the lower left corner.
fn draw_scale_bar(axes: &Axes, canvas: &mut Canvas) {
    let length_m = round_step(axes.x.span() / 8.0);
    let length = length_m * axes.frame.width / axes.x.span();
    let (x, y) = (axes.frame.x + 28.0, axes.frame.bottom() - 24.0);
    let plate = Rect { x: x - 14.0, y: y - 34.0, width: length + 28.0, height: 46.0 };
    canvas.rect(plate, Rgb::WHITE, 0.8);
    canvas.rect(Rect { x, y: y - 6.0, width: length / 2.0, height: 8.0 }, Rgb::INK, 1.0);
    canvas.rect(Rect { x: x + length / 2.0, y: y - 6.0, width: length / 2.0, height: 8.0 }, Rgb::WHITE, 1.0);
    canvas.frame(Rect { x, y: y - 6.0, width: length, height: 8.0 }, Stroke::solid(Rgb::INK, 1.5));
    canvas.text((x + length / 2.0, y - 13.0), &format!("{length_m} m"), TextStyle::new(16, Anchor::Middle));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprints_are_spaced_and_the_last_pose_is_among_them() {
        let samples: Vec<PathSample> =
            (0..=24).map(|i| PathSample { x_m: f64::from(i), ..PathSample::default() }).collect();
        let chosen: Vec<f64> = spaced(&samples, 10.0).iter().map(|sample| sample.x_m).collect();
        assert_eq!(chosen, [0.0, 10.0, 20.0, 24.0]);
        assert!(spaced(&[], 10.0).is_empty());
        assert_eq!(spaced(&samples[..1], 10.0).len(), 1);
    }
}
