//! Pictures of what happened. One drive becomes one page: the map with everything that mattered on it, a legend, and
//! speed and attitude over time.

mod axes;
mod canvas;
mod collection;
mod colour;
mod gap;
mod gap_closed_loop;
mod gap_score;
mod laps;
mod learning;
mod legend;
mod loss_curves;
mod map;
mod navigation_table;
mod plant;
mod relief;
mod route;
mod signatures;
mod strips;
mod traction_map;
mod view;

use std::path::{Path, PathBuf};

use bicycle::Vehicle;
use navigator::Areas;
use scenarios::{Bounds, World};
use terrain::GridMap;

use canvas::{Anchor, Canvas, TextStyle};
pub use collection::draw_collection;
use colour::Rgb;
#[cfg(test)]
pub(crate) use gap::examples as gap_examples;
pub use gap::{GapPicture, GapPictures, HeldOutSample, HeldOutStrip, Reference, draw_gap};
pub use gap_closed_loop::draw_gap_closed_loop;
pub use gap_score::draw_gap_score;
pub use laps::draw_laps;
pub use learning::{draw_learning, learning_svg};
pub use loss_curves::draw_loss_curves;
pub use navigation_table::draw_navigation_table;
pub use plant::draw_plant;
pub use route::{RoutePicture, draw_route};
pub use signatures::draw_signatures;
pub use traction_map::draw_traction_map;

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

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The page could not be turned into a PNG.
    #[error("{}: expected a page to encode as PNG, found: {reason}", path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] formats::OutputError),
}

const PAGE_WIDTH: f64 = 1600.0;
const LEFT: f64 = 100.0;
const MAP_WIDTH: f64 = 1150.0;
const LEGEND_X: f64 = 1290.0;
const MARGIN: f64 = 30.0;

/// Draws one drive as a PNG of 1600 px width.
///
/// # Errors
/// The file cannot be written.
pub fn draw_drive(picture: &DrivePicture<'_>, path: &Path) -> Result<(), PictureError> {
    let png =
        drive_page(picture).png().map_err(|reason| PictureError::Encode { path: path.to_owned(), reason })?;
    Ok(formats::write_bytes_atomic(path, &png)?)
}

fn drive_page(picture: &DrivePicture<'_>) -> Canvas {
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

    let mut canvas = Canvas::new(PAGE_WIDTH, strips_top + strips_height);
    draw_header(picture, &mut canvas);
    map::draw(picture, &axes, &mut canvas);
    legend::draw(picture, (LEGEND_X, axes.frame.y), &mut canvas);
    if picture.driven.len() > 1 {
        strips::draw(picture, strips_top, &mut canvas);
    }
    canvas
}

fn draw_header(picture: &DrivePicture<'_>, canvas: &mut Canvas) {
    canvas.text((MARGIN, 48.0), picture.title, TextStyle::new(30, Anchor::Start).bold());
    let style = TextStyle::new(18, Anchor::Start).coloured(Rgb::INK_SOFT);
    for (line, y) in picture.subtitles.iter().zip((0..).map(|i| 78.0 + 26.0 * f64::from(i))) {
        canvas.text((MARGIN, y), line, style);
    }
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
