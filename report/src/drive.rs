//! One drive as one page: the map with everything that mattered on it, a legend, and speed and attitude over time.

mod legend;
mod map;
mod relief;
mod strips;

use bicycle::Vehicle;
use navigator::Areas;
use scenarios::{Bounds, World};
use terrain::GridMap;

use crate::canvas::{Canvas, EncodeError};
use crate::view::{self, LEFT, LEGEND_X, MAP_WIDTH};
pub(crate) use relief::{lit, relief};

/// One drive, as far as a picture needs it. All positions are in the map frame.
#[derive(Clone, Debug)]
pub struct DrivePicture<'a> {
    /// First line on the page.
    pub title: &'a str,
    /// Further lines, smaller.
    pub subtitles: &'a [String],
    /// The ground as it truly is.
    pub world: &'a World,
    /// Risk as the controller saw it, where it ever knew it.
    pub risk: Option<RiskLayer<'a>>,
    /// Which cells the mapping ever knew; the rest fades. `None` = everything is known.
    pub known: Option<&'a GridMap<bool>>,
    /// Which cells were unlike what the controller's networks were trained on; they are hatched. `None` = nobody can
    /// tell.
    pub unfamiliar: Option<&'a GridMap<bool>>,
    /// The path driven, in the order of time; may be empty.
    pub driven: &'a [PathSample],
    /// The ways of people who walked about, each east and north [m] in the order of time.
    pub walked: &'a [Vec<[f64; 2]>],
    /// A reference path or the like, east and north [m]; may be empty.
    pub planned: &'a [[f64; 2]],
    /// Where the vehicle might be; `None` = everywhere.
    pub areas: Option<&'a Areas>,
    /// Where the drive starts, east and north [m].
    pub start_m: [f64; 2],
    /// Where it should end, east and north [m].
    pub goal_m: [f64; 2],
    /// How near counts as arrived [m].
    pub goal_radius_m: f64,
    /// What went wrong, in a word or two, at the end of the path; `None` = nothing.
    pub failure: Option<&'a str>,
    /// Footprint and attitude limits.
    pub vehicle: &'a Vehicle,
}

/// A field of risk over the ground.
#[derive(Clone, Copy, Debug)]
pub struct RiskLayer<'a> {
    /// Value per cell, NaN where none was ever known. Any geometry.
    pub values: &'a GridMap<f32>,
    /// What the value is, with its unit, e.g. "worst expected traction [-]".
    pub label: &'a str,
    /// Value that is painted as no risk; may be above `worst`.
    pub harmless: f32,
    /// Value that is painted as the worst.
    pub worst: f32,
}

impl RiskLayer<'_> {
    /// 0 = harmless, 1 = worst.
    fn share(&self, value: f32) -> f32 {
        ((value - self.harmless) / (self.worst - self.harmless)).clamp(0.0, 1.0)
    }
}

/// The vehicle at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathSample {
    /// Since the start [s].
    pub time_s: f64,
    /// East, of the rear axle's centre [m].
    pub x_m: f64,
    /// North, of the rear axle's centre [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Forward, negative in reverse [m/s].
    pub speed_mps: f64,
    /// Roll [rad].
    pub roll_rad: f64,
    /// Pitch [rad].
    pub pitch_rad: f64,
}

/// Draws one drive as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(picture: &DrivePicture<'_>) -> Result<Vec<u8>, EncodeError> {
    page(picture).png()
}

/// Draws the map alone, as a frame of a film: all frames of a task show the same part of the world, start and goal with
/// room around them, whatever was driven. `width_px` bounds both sides.
///
/// # Errors
/// The encoder refuses.
pub fn frame(picture: &DrivePicture<'_>, width_px: u32) -> Result<Vec<u8>, EncodeError> {
    let side = f64::from(width_px);
    let task = DrivePicture { driven: &[], planned: &[], ..picture.clone() };
    let slot = view::Slot { left: 0.0, top: 0.0, width: side, height_min: 0.5 * side, height_max: side };
    let mut axes = view::map_axes(interest(&task), 1.5 * margin_m(&task), picture.world.bounds(), slot);
    axes.frame.x = 0.0;
    let mut canvas = Canvas::blank(axes.frame.width, axes.frame.height);
    map::draw_inside(picture, &axes, &mut canvas);
    canvas.png()
}

fn page(picture: &DrivePicture<'_>) -> Canvas {
    let header_height = 96.0 + 26.0 * picture.subtitles.len() as f64;
    let slot = view::Slot {
        left: LEFT,
        top: header_height,
        width: MAP_WIDTH,
        height_min: legend::HEIGHT,
        height_max: 980.0,
    };
    let axes = view::map_axes(interest(picture), margin_m(picture), picture.world.bounds(), slot);
    let strips_top = axes.frame.y + axes.frame.height.max(legend::HEIGHT) + 110.0;
    let strips_height = if picture.driven.len() > 1 { strips::HEIGHT } else { 0.0 };

    let lines: Vec<&str> = picture.subtitles.iter().map(String::as_str).collect();
    let mut canvas = Canvas::titled(strips_top + strips_height, picture.title, &lines);
    map::draw(picture, &axes, &mut canvas);
    legend::draw(picture, (LEGEND_X, axes.frame.y), &mut canvas);
    if picture.driven.len() > 1 {
        strips::draw(picture, strips_top, &mut canvas);
    }
    canvas
}

/// The least rectangle around start, goal and paths, held inside the world.
fn interest(picture: &DrivePicture<'_>) -> Bounds {
    let driven = picture.driven.iter().map(|sample| [sample.x_m, sample.y_m]);
    let points = driven.chain(picture.planned.iter().copied()).chain([picture.start_m, picture.goal_m]);
    let world = picture.world.bounds();
    let mut south_west_m = world.north_east_m;
    let mut north_east_m = world.south_west_m;
    for point in points.filter(|point| point.iter().all(|value| value.is_finite())) {
        for axis in 0..2 {
            let inside = point[axis].clamp(world.south_west_m[axis], world.north_east_m[axis]);
            south_west_m[axis] = south_west_m[axis].min(inside);
            north_east_m[axis] = north_east_m[axis].max(inside);
        }
    }
    Bounds { south_west_m, north_east_m }
}

/// Room around the path: enough to see what was avoided.
fn margin_m(picture: &DrivePicture<'_>) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| picture.goal_m[axis] - picture.start_m[axis]);
    (0.15 * dx.hypot(dy)).max(2.5 * picture.vehicle.geometry.length_m)
}
