//! `surefoot map`: a map of the ground in tiles, and what is merged into it.

pub(crate) mod keep;

use std::path::Path;

use ::route::{ClassFriction, LEVEL_MAX, MeasuredCell, MergeReport, TileMap};
use formats::read_elevation;
use serde::Serialize;
use terrain::{GridGeometry, GridMap};

use crate::arguments::MapArguments;
use crate::route::known::{class_friction, ground_of};
use crate::route::tiles::MEMORY_BYTES;
use crate::summary::revision;
use crate::{UsageError, WorkFailed, interrupt};
use keep::Merged;

/// Cells of a picture, at most.
const SHOWN_CELLS_MAX: usize = 2_000_000;
/// Nothing lies farther from the map's origin: half the way around the globe [m].
const FARTHEST_M: f64 = 2e7;

/// What the map holds, and what came to it; the content of `map.json`.
#[derive(Serialize)]
struct Summary {
    revision: &'static str,
    map: String,
    cell_m: f64,
    tiles: usize,
    /// South-west and north-east corner of the tiles; null of an empty map.
    corners_m: Option<[[f64; 2]; 2]>,
    merged: Vec<Merged>,
}

pub(crate) fn run(arguments: &MapArguments) -> anyhow::Result<()> {
    let friction = class_friction(&arguments.kinds)?;
    if !(0.01..=2.5).contains(&arguments.deviation) {
        let found = arguments.deviation;
        return Err(UsageError(format!("--deviation: expected 0.01 to 2.5 m, found {found}")).into());
    }
    let at_m = [arguments.at.x_m, arguments.at.y_m];
    if at_m.iter().any(|at_m| at_m.abs() > FARTHEST_M) {
        return Err(UsageError(format!("--at: expected at most {FARTHEST_M:.0} m, found {at_m:?}")).into());
    }
    arguments.results.prepare()?;
    interrupt::catch_interrupts()?;
    let (map, merged) = match &arguments.listen {
        Some(run) => keep::listened(&arguments.map, run, friction)?,
        None => merged(arguments, &friction)?,
    };
    show(arguments, map, merged)
}

/// The map with all sources in it.
fn merged(arguments: &MapArguments, friction: &ClassFriction) -> anyhow::Result<(TileMap, Vec<Merged>)> {
    let mut map = opened(arguments)?;
    let mut merged = Vec::new();
    for source in &arguments.sources {
        if interrupt::interrupted() {
            let (n, all) = (merged.len(), arguments.sources.len());
            return Err(WorkFailed(format!("interrupted by the user; {n} of {all} are merged")).into());
        }
        let report = merge(arguments, friction, source, &mut map)?;
        merged.push(Merged::of(source.display().to_string(), report));
    }
    Ok((map, merged))
}

/// The map that is there, or a new one in the cells that were asked for or of what is merged first.
fn opened(arguments: &MapArguments) -> Result<TileMap, UsageError> {
    let folder = &arguments.map;
    // No folder is made for what cannot be read.
    let first_m = match arguments.sources.first() {
        Some(first) if !TileMap::is_at(folder) => Some(cell_of(first)?),
        _ => None,
    };
    let cell_m = match arguments.cell.or(first_m) {
        Some(cell_m) if (0.05..=100.0).contains(&cell_m) => cell_m,
        Some(found) => return Err(UsageError(format!("--cell: expected 0.05 to 100 m, found {found}"))),
        None => return TileMap::resume(folder, MEMORY_BYTES).map_err(UsageError::from_input),
    };
    TileMap::open(folder, cell_m, MEMORY_BYTES).map_err(UsageError::from_input)
}

fn cell_of(source: &Path) -> Result<f64, UsageError> {
    if source.is_dir() {
        let map = TileMap::resume(source, MEMORY_BYTES).map_err(UsageError::from_input)?;
        return Ok(map.cell_m(0));
    }
    let file = read_elevation(source).map_err(UsageError::from_input)?;
    Ok(file.elevation.geometry().resolution_m)
}

fn merge(
    arguments: &MapArguments,
    friction: &ClassFriction,
    source: &Path,
    map: &mut TileMap,
) -> Result<MergeReport, UsageError> {
    if source.is_dir() {
        let is_itself = source.canonicalize().ok() == arguments.map.canonicalize().ok();
        if is_itself {
            let map = source.display();
            return Err(UsageError(format!("{map}: expected another map to merge, found the map itself")));
        }
        let mut other = TileMap::resume(source, MEMORY_BYTES).map_err(UsageError::from_input)?;
        return map.merge_map(&mut other).map_err(UsageError::from_input);
    }
    let file = read_elevation(source).map_err(UsageError::from_input)?;
    let cell_m = map.cell_m(0);
    let ground = ground_of(&file, friction, cell_m)?;
    let at_m = [arguments.at.x_m, arguments.at.y_m];
    let from = *ground.geometry();
    let moved = [0, 1].map(|axis| from.origin[axis] + (at_m[axis] / cell_m).round() as i64);
    let deviation_m = arguments.deviation as f32;
    let cells = ground.values().iter().map(|ground| MeasuredCell { ground: *ground, deviation_m });
    let patch = GridMap::from_values(GridGeometry { origin: moved, ..from }, cells.collect());
    let report = patch.map(|patch| map.merge(&patch)).transpose().map_err(UsageError::from_input)?;
    Ok(report.unwrap_or_default())
}

fn show(arguments: &MapArguments, mut map: TileMap, merged: Vec<Merged>) -> anyhow::Result<()> {
    let (folder, results) = (arguments.map.display(), &arguments.results);
    let corners_m = map.extent(0).map(|all| {
        let north_east = [all.n_cols, all.n_rows];
        let at_m = |place: [i64; 2]| place.map(|index| index as f64 * all.resolution_m);
        [at_m(all.origin), at_m([0, 1].map(|axis| all.origin[axis] + north_east[axis] as i64))]
    });
    let summary = Summary {
        revision: revision(),
        map: folder.to_string(),
        cell_m: map.cell_m(0),
        tiles: map.n_tiles(),
        corners_m,
        merged,
    };
    println!("  {folder}: {} tiles in cells of {} m", summary.tiles, summary.cell_m);
    if let Some([[west_m, south_m], [east_m, north_m]]) = corners_m {
        println!("  from ({west_m:.0}, {south_m:.0}) to ({east_m:.0}, {north_m:.0}) m");
    }
    summary.merged.iter().for_each(|merged| println!("  {merged}"));
    results.write_json("map.json", &summary)?;
    let shown = (0..=LEVEL_MAX)
        .filter_map(|level| Some((level, map.extent(level)?)))
        .find(|(_, all)| all.n_cells() <= SHOWN_CELLS_MAX);
    let Some((level, all)) = shown else {
        println!(
            "\n  map.json in {}; there is nothing to draw, or it lies too far apart",
            results.out.display()
        );
        return Ok(());
    };
    let ground = map.window(level, &all).map_err(UsageError::from_input)?;
    let subtitle = format!("{} tiles, shown in cells of {} m", summary.tiles, all.resolution_m);
    results.write("map.png", &report::route::map(&summary.map, &subtitle, &ground)?)?;
    println!("\n  map.png and map.json in {}", results.out.display());
    Ok(())
}
