//! A route on its map, and speed and height along it.

use route::{GroundCell, RouteLine, RoutePoint};
use scenarios::Bounds;
use terrain::{Cell, GridMap};

use crate::axes::{Axes, Range, round_step};
use crate::canvas::EncodeError;
use crate::canvas::{Anchor, Canvas, Image, Point, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::ColourBar;
use crate::drive::lit;
use crate::view::{LEFT, LEGEND_X, MAP_WIDTH};
use crate::view::{Slot, map_axes};

const TOP: f64 = 125.0;
/// Where the map stands on the page.
const SLOT: Slot = Slot { left: LEFT, top: TOP, width: MAP_WIDTH, height_min: 420.0, height_max: 980.0 };
const STRIP_HEIGHT: f64 = 150.0;
const STRIP_GAP: f64 = 46.0;
/// Friction that is painted as good, and as the worst.
const FRICTION: [f32; 2] = [0.9, 0.2];
/// Speed of sliding at which frictions are compared [m/s].
const SLIDING_MPS: f32 = 1.0;

/// A route as far as a picture needs it.
#[derive(Clone, Copy, Debug)]
pub struct RoutePicture<'a> {
    /// First line on the page.
    pub title: &'a str,
    /// Second line, smaller.
    pub subtitle: &'a str,
    /// The map that it was searched on.
    pub ground: &'a GridMap<GroundCell>,
    /// The route.
    pub line: &'a RouteLine,
    /// Other ways to the same goal.
    pub others: &'a [&'a RouteLine],
}

/// Draws a route as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(picture: &RoutePicture<'_>) -> Result<Vec<u8>, EncodeError> {
    page(picture).png()
}

/// Draws a map alone, as routes are searched on it.
///
/// # Errors
/// The encoder refuses.
pub fn map(title: &str, subtitle: &str, ground: &GridMap<GroundCell>) -> Result<Vec<u8>, EncodeError> {
    let axes = map_axes(known(ground), 0.0, bounds(ground), SLOT);
    let mut canvas = Canvas::titled(axes.frame.bottom() + 110.0, title, &[subtitle]);
    paint(ground, &axes, &mut canvas);
    axes.draw_labelled(&mut canvas, "east x [m]", "north y [m]");
    friction_bar().draw((LEGEND_X, axes.frame.y), &mut canvas);
    draw_swatches(axes.frame.y + 290.0, &mut canvas);
    canvas.png()
}

fn page(picture: &RoutePicture<'_>) -> Canvas {
    let (world, interest) = (known(picture.ground), interest(picture));
    let margin_m =
        0.15 * (0..2).map(|k| interest.north_east_m[k] - interest.south_west_m[k]).fold(20.0, f64::max);
    let axes = map_axes(interest, margin_m, world, SLOT);
    let strips_top = axes.frame.bottom() + 110.0;
    let height = strips_top + 2.0 * STRIP_HEIGHT + STRIP_GAP + 75.0;
    let mut canvas = Canvas::titled(height, picture.title, &[picture.subtitle]);
    draw_map(picture, &axes, &mut canvas);
    draw_legend(picture, axes.frame.y, &mut canvas);
    draw_strips(picture.line, strips_top, &mut canvas);
    canvas
}

fn bounds(ground: &GridMap<GroundCell>) -> Bounds {
    let geometry = ground.geometry();
    let south_west_m = geometry.south_west_m();
    let n = [geometry.n_cols, geometry.n_rows];
    let north_east_m = [0, 1].map(|axis| south_west_m[axis] + n[axis] as f64 * geometry.resolution_m);
    Bounds { south_west_m, north_east_m }
}

/// What holds all that is known.
fn known(ground: &GridMap<GroundCell>) -> Bounds {
    let geometry = ground.geometry();
    let cells = ground.values().iter().enumerate().filter(|(_, cell)| cell.is_known());
    let all = bounds(ground);
    let none = Bounds { south_west_m: all.north_east_m, north_east_m: all.south_west_m };
    let half_m = 0.5 * geometry.resolution_m;
    let known = cells.fold(none, |so_far, (index, _)| {
        let centre_m = geometry.centre_m(geometry.cell(index));
        Bounds {
            south_west_m: [0, 1].map(|axis| so_far.south_west_m[axis].min(centre_m[axis] - half_m)),
            north_east_m: [0, 1].map(|axis| so_far.north_east_m[axis].max(centre_m[axis] + half_m)),
        }
    });
    if known.north_east_m[0] > known.south_west_m[0] { known } else { all }
}

fn interest(picture: &RoutePicture<'_>) -> Bounds {
    let ways = std::iter::once(picture.line).chain(picture.others.iter().copied());
    let along = |axis: usize| ways.clone().flat_map(|way| &way.points).map(move |point| point.at_m[axis]);
    Bounds {
        south_west_m: [0, 1].map(|axis| along(axis).fold(f64::INFINITY, f64::min)),
        north_east_m: [0, 1].map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max)),
    }
}

fn draw_map(picture: &RoutePicture<'_>, axes: &Axes, canvas: &mut Canvas) {
    paint(picture.ground, axes, canvas);
    let placed = |way: &RouteLine| -> Vec<Point> {
        way.points.iter().map(|point| axes.place(point.at_m[0], point.at_m[1])).collect()
    };
    let points = placed(picture.line);
    let scale_mps = speed_scale_mps(picture.line);
    canvas.clipped(axes.frame, |canvas| {
        picture.others.iter().for_each(|other| draw_other(&placed(other), canvas));
        canvas.polyline(&points, Stroke::solid(Rgb::INK, 9.0));
        for (ends, point) in points.windows(2).zip(&picture.line.points) {
            let colour = Ramp::SPEED.at((point.speed_mps / scale_mps) as f32);
            canvas.polyline(ends, Stroke::solid(colour, 5.0));
        }
        for (point, name) in
            points.first().into_iter().zip(["start"]).chain(points.last().into_iter().zip(["goal"]))
        {
            canvas.circle(*point, 8.0, Rgb::GOAL, Stroke::solid(Rgb::INK, 2.0));
            canvas.rimmed_text((point.0, point.1 - 16.0), name, TextStyle::new(18, Anchor::Middle).bold());
        }
    });
    axes.draw_labelled(canvas, "east x [m]", "north y [m]");
}

/// Paints the ground behind axes.
fn paint(ground: &GridMap<GroundCell>, axes: &Axes, canvas: &mut Canvas) {
    let (width, height) = (axes.frame.width as usize, axes.frame.height as usize);
    let pixels = (0..width * height).map(|pixel| {
        let share = |place: usize, n: usize| (place as f64 + 0.5) / n as f64;
        let x_m = axes.x.low + share(pixel % width, width) * axes.x.span();
        let y_m = axes.y.high - share(pixel / width, height) * axes.y.span();
        colour(ground, x_m, y_m)
    });
    canvas.image(axes.frame.x, axes.frame.y, &Image { width, pixels: pixels.collect() });
}

/// The look of another way, here and in the legend.
fn draw_other(points: &[Point], canvas: &mut Canvas) {
    canvas.polyline(points, Stroke::solid(Rgb::WHITE, 5.0));
    canvas.polyline(points, Stroke { colour: Rgb::INK, width: 2.5, dash: "9 6" });
}

/// How good the ground is, in the light of its slope.
fn colour(ground: &GridMap<GroundCell>, x_m: f64, y_m: f64) -> Rgb {
    let Some(cell) = ground.geometry().cell_at(x_m, y_m) else { return Rgb::UNSEEN };
    let here = &ground[cell];
    if !here.is_known() {
        return Rgb::UNSEEN;
    }
    if here.is_obstacle {
        return Rgb::OBSTACLE;
    }
    let share = (FRICTION[0] - here.friction.at(SLIDING_MPS)) / (FRICTION[0] - FRICTION[1]);
    let tint = Ramp::RISK.at(share.clamp(0.0, 1.0));
    let steep = Ramp::GROUND.at(0.5).blend(tint, 0.55);
    steep.lit(lit(slope(ground, cell)))
}

/// Rise per metre east and north.
fn slope(ground: &GridMap<GroundCell>, cell: Cell) -> [f32; 2] {
    let slope = terrain::slope_at(ground, cell, 1);
    slope.gradient.map(|rise| if rise.is_finite() { rise } else { 0.0 })
}

fn speed_scale_mps(line: &RouteLine) -> f64 {
    let fastest = line.points.iter().map(|point| point.speed_mps).fold(0.1, f64::max);
    let step = round_step(fastest / 10.0);
    (fastest / step).ceil() * step
}

fn draw_legend(picture: &RoutePicture<'_>, top: f64, canvas: &mut Canvas) {
    let scale_mps = speed_scale_mps(picture.line);
    let speed = ColourBar { title: ["speed", "[m/s]"], low: 0.0, high: scale_mps, ramp: Ramp::SPEED };
    speed.draw((LEGEND_X, top), canvas);
    friction_bar().draw((LEGEND_X + 130.0, top), canvas);
    draw_swatches(top + 290.0, canvas);
    if !picture.others.is_empty() {
        let y = top + 358.0;
        draw_other(&[(LEGEND_X, y - 4.0), (LEGEND_X + 32.0, y - 4.0)], canvas);
        canvas.text((LEGEND_X + 44.0, y + 2.0), "another way", TextStyle::new(17, Anchor::Start));
    }
}

fn friction_bar() -> ColourBar<'static> {
    let [good, worst] = FRICTION.map(f64::from);
    ColourBar { title: ["friction", "[-]"], low: good, high: worst, ramp: Ramp::RISK }
}

/// What has a colour of its own.
fn draw_swatches(top: f64, canvas: &mut Canvas) {
    let entries = [(Rgb::OBSTACLE, "water, obstacle"), (Rgb::UNSEEN, "never measured")];
    for ((colour, text), y) in entries.into_iter().zip([top, top + 34.0]) {
        let swatch = Rect { x: LEGEND_X, y: y - 14.0, width: 28.0, height: 20.0 };
        canvas.rect(swatch, colour, 1.0);
        canvas.frame(swatch, Stroke::solid(Rgb::INK_SOFT, 1.0));
        canvas.text((LEGEND_X + 44.0, y + 2.0), text, TextStyle::new(17, Anchor::Start));
    }
}

/// A strip's label and what it shows of a point.
type Strip = (&'static str, fn(&RoutePoint) -> f64);

/// Speed and height over the way.
fn draw_strips(line: &RouteLine, top: f64, canvas: &mut Canvas) {
    let length_m = line.length_m();
    let rows: [Strip; 2] = [("speed [m/s]", |point| point.speed_mps), ("height [m]", |point| point.height_m)];
    for (row, (label, value)) in rows.into_iter().enumerate() {
        let values = line.points.iter().map(value).filter(|value| value.is_finite());
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let air = 0.08 * (high - low).max(0.1);
        let axes = Axes {
            frame: Rect {
                x: LEFT,
                y: top + row as f64 * (STRIP_HEIGHT + STRIP_GAP),
                width: MAP_WIDTH,
                height: STRIP_HEIGHT,
            },
            x: Range { low: 0.0, high: length_m.max(1.0) },
            y: Range { low: if row == 0 { 0.0 } else { low - air }, high: high + air },
        };
        axes.draw_rules(canvas);
        let place =
            |(index, point): (usize, &RoutePoint)| axes.place(index as f64 * line.spacing_m, value(point));
        let points: Vec<Point> = line.points.iter().enumerate().map(place).collect();
        canvas.clipped(axes.frame, |canvas| canvas.polyline(&points, Stroke::solid(Rgb::INK, 2.5)));
        axes.draw_frame(canvas);
        axes.draw_y_ticks(canvas);
        axes.draw_y_label(canvas, label);
        if row == 1 {
            axes.draw_x_ticks(canvas);
            axes.draw_x_label(canvas, "way [m]");
        }
    }
}
