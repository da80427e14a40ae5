//! `surefoot inspect`: what a file holds.

mod bag;
mod recording;

use std::io::Write;
use std::path::Path;

use ::route::TileMap;
use serde_json::{Value, json};

use crate::UsageError;
use crate::arguments::InspectArguments;
use crate::drive::read_checkpoint;
use crate::route::tiles::MEMORY_BYTES;

pub(crate) fn run(arguments: &InspectArguments) -> anyhow::Result<()> {
    let found = look(&arguments.file)?;
    arguments.copy.prepare()?;
    arguments.copy.write(&found)?;
    // Whoever reads only the first lines has read enough.
    match writeln!(std::io::stdout(), "{}", serde_json::to_string_pretty(&found)?) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

fn look(path: &Path) -> Result<Value, UsageError> {
    if formats::Bag::is_at(path) {
        return bag::look(path);
    }
    if TileMap::is_at(path) {
        return tiles(path);
    }
    if path.is_dir() {
        return networks(path);
    }
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("mcap") => recording::look(path),
        Some("npz" | "tif" | "tiff" | "png") => elevation(path),
        Some("toml") => vehicle(path),
        None if formats::shipped_vehicle_names().any(|name| Path::new(name) == path) => vehicle(path),
        _ => Err(UsageError(format!(
            "{}: expected a recording, a bag of ROS 2, elevation, a map in tiles, a vehicle or a folder with networks, found another file",
            path.display()
        ))),
    }
}

fn elevation(path: &Path) -> Result<Value, UsageError> {
    let file = formats::read_elevation(path).map_err(UsageError::from_input)?;
    let geometry = *file.elevation.geometry();
    let known = file.elevation.values().iter().map(|height_m| f64::from(*height_m)).filter(|m| m.is_finite());
    let (n_known, lowest_m, highest_m) = known.fold((0u64, f64::INFINITY, f64::NEG_INFINITY), |so_far, m| {
        (so_far.0 + 1, so_far.1.min(m), so_far.2.max(m))
    });
    let layers = &file.layers;
    let present = [
        ("canopy_height", layers.canopy_height_m.is_some()),
        ("low_veg_fraction", layers.low_vegetation_fraction.is_some()),
        ("water", layers.water.is_some()),
        ("ground_gap", layers.ground_gap_m.is_some()),
    ];
    Ok(json!({
        "kind": "elevation",
        "rows": geometry.n_rows,
        "columns": geometry.n_cols,
        "cell_m": geometry.resolution_m,
        "known_share": n_known as f64 / geometry.n_cells().max(1) as f64,
        "lowest_m": (n_known > 0).then_some(lowest_m),
        "highest_m": (n_known > 0).then_some(highest_m),
        "layers": present.iter().filter(|(_, is_there)| *is_there).map(|(name, _)| *name).collect::<Vec<_>>(),
    }))
}

fn tiles(folder: &Path) -> Result<Value, UsageError> {
    let map = TileMap::resume(folder, MEMORY_BYTES).map_err(UsageError::from_input)?;
    let all = map.extent(0);
    Ok(json!({
        "kind": "map in tiles",
        "tiles": map.n_tiles(),
        "cell_m": map.cell_m(0),
        "rows": all.map_or(0, |all| all.n_rows),
        "columns": all.map_or(0, |all| all.n_cols),
        "south_west_m": all.map(|all| all.south_west_m()),
    }))
}

fn vehicle(path: &Path) -> Result<Value, UsageError> {
    let vehicle = formats::read_vehicle(&path.to_string_lossy()).map_err(UsageError::from_input)?;
    Ok(json!({ "kind": "vehicle", "vehicle": vehicle }))
}

fn networks(folder: &Path) -> Result<Value, UsageError> {
    let checkpoint = read_checkpoint(folder)?;
    let sidecar = serde_json::to_value(&checkpoint.sidecar).map_err(UsageError::from_input)?;
    Ok(json!({ "kind": "networks", "sidecar": sidecar }))
}
