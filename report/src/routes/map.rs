//! A task's routes on its landscape, coloured by speed: AnyNav's figures 15 to 17.

use bench::route::{End, Method, Shown, ShownRoute};
use route::RoutePoint;
use scenarios::{Bounds, GroundKind, Landscape};

use crate::axes::Axes;
use crate::canvas::{Anchor, Canvas, EncodeError, Image, Point, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::ColourBar;
use crate::drive::lit;
use crate::view::{LEFT, LEGEND_X, MAP_WIDTH, Slot, map_axes};

const TOP: f64 = 125.0;
/// Fastest speed of the ramp [m/s].
const FASTEST_MPS: f64 = 12.0;
/// Around the routes [m].
const MARGIN_M: f64 = 30.0;
const TEXT: TextStyle = TextStyle::new(17, Anchor::Start);
/// Water, and what stands on the ground.
const WATER: Rgb = Rgb(0x7d, 0xa9, 0xd6);
const TREE: Rgb = Rgb(0x1e, 0x4d, 0x2b);

/// Draws the routes of a task as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn map(shown: &Shown) -> Result<Vec<u8>, EncodeError> {
    let slot = Slot { left: LEFT, top: TOP, width: MAP_WIDTH, height_min: 620.0, height_max: 1000.0 };
    let axes = map_axes(interest(shown), MARGIN_M, shown.landscape.world.bounds(), slot);
    let height = axes.frame.bottom().max(TOP + 860.0) + 90.0;
    let title =
        format!("Task {} in the {}: routes and their speeds", shown.task, shown.landscape.kind.name());
    let mut canvas = Canvas::titled(height, &title, &[]);
    draw_ground(&shown.landscape, &axes, &mut canvas);
    canvas.clipped(axes.frame, |canvas| {
        shown.routes.iter().for_each(|route| draw_route(route, &axes, canvas));
        if let Some(route) = shown.routes.last() {
            draw_ends(&route.points, &axes, canvas);
        }
    });
    axes.draw_labelled(&mut canvas, "east x [m]", "north y [m]");
    draw_legend(shown, &mut canvas);
    canvas.png()
}

fn interest(shown: &Shown) -> Bounds {
    let points = || shown.routes.iter().flat_map(|route| &route.points);
    let along = |axis: usize| points().map(move |point| point.at_m[axis]);
    Bounds {
        south_west_m: [0, 1].map(|axis| along(axis).fold(f64::INFINITY, f64::min)),
        north_east_m: [0, 1].map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max)),
    }
}

fn draw_ground(landscape: &Landscape, axes: &Axes, canvas: &mut Canvas) {
    let (width, height) = (axes.frame.width as usize, axes.frame.height as usize);
    let pixels = (0..width * height).map(|pixel| {
        let share = |place: usize, n: usize| (place as f64 + 0.5) / n as f64;
        let x_m = axes.x.low + share(pixel % width, width) * axes.x.span();
        let y_m = axes.y.high - share(pixel / width, height) * axes.y.span();
        let patch = landscape.world.patch(x_m, y_m);
        if patch.is_water() {
            return WATER;
        }
        let ground = landscape.grounds.at(x_m, y_m).map_or(Rgb::UNSEEN, |ground| colour(*ground));
        let colour = if patch.obstacle_height_m > 0.0 { TREE } else { ground };
        colour.lit(lit(landscape.world.gradient(x_m, y_m).map(|rise| rise as f32)))
    });
    canvas.image(axes.frame.x, axes.frame.y, &Image { width, pixels: pixels.collect() });
}

const fn colour(ground: GroundKind) -> Rgb {
    match ground {
        GroundKind::Asphalt => Rgb(0x9a, 0x9c, 0xa3),
        GroundKind::Rock => Rgb(0xb9, 0xa8, 0x98),
        GroundKind::Dirt => Rgb(0xc9, 0xa8, 0x7c),
        GroundKind::Grass => Rgb(0xa9, 0xc9, 0x8a),
        GroundKind::Mud => Rgb(0x8a, 0x6f, 0x55),
        GroundKind::Sand => Rgb(0xee, 0xdd, 0xa5),
        GroundKind::Ice => Rgb(0xe2, 0xf2, 0xfb),
    }
}

/// What a route is rimmed with.
const fn rim(method: Method) -> Rgb {
    match method {
        Method::Ours => Rgb::INK,
        Method::NoSteering => Rgb::WHITE,
        _ => Rgb::FAILURE,
    }
}

fn draw_route(route: &ShownRoute, axes: &Axes, canvas: &mut Canvas) {
    let place = |point: &RoutePoint| axes.place(point.at_m[0], point.at_m[1]);
    let points: Vec<Point> = route.points.iter().map(place).collect();
    canvas.polyline(&points, Stroke::solid(rim(route.method), 9.0));
    for (ends, point) in points.windows(2).zip(&route.points) {
        let colour = Ramp::SPEED.at((point.speed_mps / FASTEST_MPS) as f32);
        canvas.polyline(ends, Stroke::solid(colour, 4.0));
    }
    if route.drive.end != End::Goal {
        let (x, y) = axes.place(route.drive.at_m[0], route.drive.at_m[1]);
        for slant in [-1.0, 1.0] {
            let stroke = Stroke::solid(rim(route.method), 5.0);
            canvas.line((x - 11.0, y - 11.0 * slant), (x + 11.0, y + 11.0 * slant), stroke);
        }
    }
}

fn draw_ends(points: &[RoutePoint], axes: &Axes, canvas: &mut Canvas) {
    let named = points.first().into_iter().zip(["start"]).chain(points.last().into_iter().zip(["goal"]));
    for (point, name) in named {
        let (x, y) = axes.place(point.at_m[0], point.at_m[1]);
        canvas.circle((x, y), 8.0, Rgb::GOAL, Stroke::solid(Rgb::INK, 2.0));
        canvas.rimmed_text((x, y - 16.0), name, TextStyle::new(18, Anchor::Middle).bold());
    }
}

fn draw_legend(shown: &Shown, canvas: &mut Canvas) {
    let speed = ColourBar { title: ["speed", "[m/s]"], low: 0.0, high: FASTEST_MPS, ramp: Ramp::SPEED };
    speed.draw((LEGEND_X, TOP), canvas);
    let mut y = TOP + 290.0;
    for kind in GroundKind::ALL {
        draw_swatch(colour(kind), kind.name(), y, canvas);
        y += 30.0;
    }
    for (colour, name) in [(TREE, "tree"), (WATER, "water")] {
        draw_swatch(colour, name, y, canvas);
        y += 30.0;
    }
    y += 14.0;
    for route in &shown.routes {
        canvas.line((LEGEND_X, y - 5.0), (LEGEND_X + 32.0, y - 5.0), Stroke::solid(Rgb::INK_SOFT, 11.0));
        canvas.line((LEGEND_X, y - 5.0), (LEGEND_X + 32.0, y - 5.0), Stroke::solid(rim(route.method), 9.0));
        canvas.text((LEGEND_X + 44.0, y), route.method.name(), TEXT.bold());
        let told = match route.drive.end {
            End::Goal => format!("{:.0} m in {:.1} s", route.drive.length_m, route.drive.time_s),
            end => format!("{:.0} m; {} (cross)", route.drive.length_m, end.name()),
        };
        canvas.text((LEGEND_X + 44.0, y + 23.0), &told, TEXT);
        y += 58.0;
    }
}

fn draw_swatch(colour: Rgb, name: &str, y: f64, canvas: &mut Canvas) {
    let swatch = Rect { x: LEGEND_X, y: y - 14.0, width: 28.0, height: 20.0 };
    canvas.rect(swatch, colour, 1.0);
    canvas.frame(swatch, Stroke::solid(Rgb::INK_SOFT, 1.0));
    canvas.text((LEGEND_X + 44.0, y + 2.0), name, TEXT);
}
