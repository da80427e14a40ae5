//! The vehicle of a case: what its simulator's owner says of it, and the ground that it drives on.

use std::path::{Path, PathBuf};

use bicycle::Vehicle;
use serde::Deserialize;

use super::GapGround;
use super::grid::{Grid, read_grid};
use crate::{ConfigError, ConfigText, read_vehicle, shipped_vehicle_names};

/// A vehicle as a case describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct GapVehicle {
    /// Name, for reports.
    pub name: String,
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Largest steering angle that is ever commanded, if stated [rad].
    pub steering_max_rad: Option<f64>,
    /// Fastest speed that is ever commanded, if stated [m/s].
    pub speed_max_mps: Option<f64>,
    /// Noise of the measurements, as far as stated.
    pub noise: GapNoise,
    /// Ground, if mapped.
    pub ground: Option<GapGround>,
}

/// A vehicle, whichever file describes it.
#[derive(Clone, Debug, PartialEq)]
pub enum DescribedVehicle {
    /// One of the planner's.
    Planned(Vehicle),
    /// One of a case.
    Case(GapVehicle),
}

/// Reads the vehicle that ships under a name, or that a file describes: one with a table `geometry` is the planner's, any
/// other a case's.
///
/// Errors: those of [`read_vehicle`] and [`read_gap_vehicle`].
pub fn read_described_vehicle(name_or_path: &str) -> Result<DescribedVehicle, GapVehicleError> {
    let is_shipped = shipped_vehicle_names().any(|shipped| shipped == name_or_path);
    let path = Path::new(name_or_path);
    if is_shipped || ConfigText::read(path)?.has_key("geometry") {
        return Ok(DescribedVehicle::Planned(read_vehicle(name_or_path)?));
    }
    read_gap_vehicle(path).map(DescribedVehicle::Case)
}

/// Standard deviations of the measurements' noise, as far as stated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub struct GapNoise {
    /// Position east [m].
    pub x: Option<f64>,
    /// Position north [m].
    pub y: Option<f64>,
    /// Yaw [rad].
    pub yaw: Option<f64>,
    /// Forward velocity [m/s].
    pub vx: Option<f64>,
    /// Yaw rate [rad/s].
    pub wz: Option<f64>,
}

/// A vehicle or its ground that cannot be. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum GapVehicleError {
    /// The description is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A grid cannot be read.
    #[error("{file}: expected a readable grid in CSV, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A cell of a grid is wrong, or a row's length.
    #[error("{file}:{line}: column {column}: expected {expected}, found {found}")]
    Cell {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What would do.
        expected: String,
        /// What stands there.
        found: String,
    },
}

#[derive(Deserialize)]
struct VehicleFile {
    name: String,
    reference_point: Option<String>,
    wheelbase: f64,
    max_steer: Option<f64>,
    max_speed: Option<f64>,
    #[serde(default)]
    noise: GapNoise,
    map: Option<MapFile>,
}

#[derive(Deserialize)]
struct MapFile {
    heightmap: PathBuf,
    terrain_class: Option<PathBuf>,
    resolution: f64,
    origin_x: f64,
    origin_y: f64,
    index: Option<String>,
}

/// The order in which the grids stand.
const INDEX: &str = "row = x, column = y";

/// Reads a case's vehicle and, if it has a map, the ground.
///
/// Errors: a file that cannot be read, a key missing or mistyped, a value that no vehicle can have, poses of another
/// point than the rear axle, grids of different shapes or in another order.
pub fn read_gap_vehicle(path: &Path) -> Result<GapVehicle, GapVehicleError> {
    parse_gap_vehicle(&ConfigText::read(path)?, path.parent().unwrap_or(Path::new("")))
}

/// The same from a text, whose grids lie in `folder`.
///
/// Errors: those of [`read_gap_vehicle`].
pub fn parse_gap_vehicle(text: &ConfigText, folder: &Path) -> Result<GapVehicle, GapVehicleError> {
    let file: VehicleFile = text.parse()?;
    check(&file, text)?;
    let ground = file.map.as_ref().map(|map| read_ground(map, folder, text)).transpose()?;
    Ok(GapVehicle {
        name: file.name,
        wheelbase_m: file.wheelbase,
        steering_max_rad: file.max_steer,
        speed_max_mps: file.max_speed,
        noise: file.noise,
        ground,
    })
}

fn check(file: &VehicleFile, text: &ConfigText) -> Result<(), ConfigError> {
    let noise = &file.noise;
    let positive = [
        ("wheelbase", Some(file.wheelbase)),
        ("max_steer", file.max_steer),
        ("max_speed", file.max_speed),
        ("map.resolution", file.map.as_ref().map(|map| map.resolution)),
    ];
    refuse_unless(text, &positive, "a finite number > 0", |value| value > 0.0)?;
    let deviations = [
        ("noise.x", noise.x),
        ("noise.y", noise.y),
        ("noise.yaw", noise.yaw),
        ("noise.vx", noise.vx),
        ("noise.wz", noise.wz),
    ];
    refuse_unless(text, &deviations, "a finite number >= 0", |value| value >= 0.0)?;
    let angle = [("max_steer", file.max_steer)];
    refuse_unless(text, &angle, "an angle below 1.5 rad (degrees?)", |value| value < 1.5)?;
    let origin =
        file.map.as_ref().map(|map| [("map.origin_x", map.origin_x), ("map.origin_y", map.origin_y)]);
    let origin = origin.into_iter().flatten().map(|(field, value)| (field, Some(value))).collect::<Vec<_>>();
    refuse_unless(text, &origin, "a finite number", |_| true)?;
    let words = [
        ("reference_point", file.reference_point.as_deref(), "rear_axle"),
        ("map.index", file.map.as_ref().and_then(|map| map.index.as_deref()), INDEX),
    ];
    match words.iter().find(|(_, found, expected)| found.is_some_and(|found| found != *expected)) {
        Some((field, found, expected)) => Err(text.refuse(field, expected, found.unwrap_or_default())),
        None => Ok(()),
    }
}

fn refuse_unless(
    text: &ConfigText,
    fields: &[(&str, Option<f64>)],
    expected: &str,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<(), ConfigError> {
    let stated = fields.iter().filter_map(|(field, value)| value.map(|value| (*field, value)));
    for (field, value) in stated {
        if !(value.is_finite() && is_allowed(value)) {
            return Err(text.refuse(field, expected, value));
        }
    }
    Ok(())
}

fn read_ground(map: &MapFile, folder: &Path, text: &ConfigText) -> Result<GapGround, GapVehicleError> {
    let height = read_grid(&folder.join(&map.heightmap), "a finite height in metres", f32::is_finite)?;
    let class = match &map.terrain_class {
        Some(path) => read_grid(&folder.join(path), "a class from 0 to 255", |_: u8| true)?,
        None => Grid { shape: height.shape, cells: vec![0; height.cells.len()] },
    };
    if class.shape != height.shape {
        let told = |shape: [usize; 2]| format!("{} x {} nodes", shape[0], shape[1]);
        let expected = format!("{} as in map.heightmap", told(height.shape));
        return Err(text.refuse("map.terrain_class", expected, told(class.shape)).into());
    }
    Ok(GapGround {
        origin_m: [map.origin_x, map.origin_y],
        resolution_m: map.resolution,
        n_nodes: height.shape,
        height_m: height.cells,
        class: class.cells,
    })
}

#[cfg(test)]
mod tests;
