//! What a vehicle sees of the ground, kept in a map in tiles.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use ::route::{ClassFriction, MapKeeper, MergeReport, TileMap};
use bus::channel::{Bus, Inlet, RunName, SURFACE};
use bus::payload::surface_map;
use serde::{Deserialize, Serialize};

use crate::route::tiles::MEMORY_BYTES;
use crate::{UsageError, WorkFailed, interrupt};

/// Time between two looks at what a vehicle sees: it makes a few metres of way, a fraction of what its window holds.
pub(crate) const LOOK_PERIOD_S: f64 = 1.0;

/// What became of what was merged into a map; a part of `map.json` and `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Merged {
    /// Where it came from, or where it went.
    pub name: String,
    /// Cells of which nothing was known before.
    pub new: usize,
    /// Cells whose heights agreed.
    pub agreeing: usize,
    /// Cells whose heights contradict each other.
    pub contradicting: usize,
    /// The largest contradiction [m].
    pub largest_contradiction_m: f32,
}

impl Merged {
    pub(crate) fn of(name: String, report: MergeReport) -> Self {
        Self {
            name,
            new: report.n_new,
            agreeing: report.n_agreeing,
            contradicting: report.n_contradicting,
            largest_contradiction_m: report.largest_contradiction_m,
        }
    }
}

impl fmt::Display for Merged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, new, agreeing, contradicting, largest_contradiction_m } = self;
        write!(f, "{name}: {new} cells new, {agreeing} agree, {contradicting} contradict")?;
        if *contradicting > 0 { write!(f, ", by {largest_contradiction_m:.2} m at most") } else { Ok(()) }
    }
}

/// A keeper of a map in a folder, which is made if it is missing.
pub(crate) fn keeper(folder: &Path, cell_m: f64, friction: ClassFriction) -> Result<MapKeeper, UsageError> {
    let map = TileMap::open(folder, cell_m, MEMORY_BYTES).map_err(UsageError::from_input)?;
    Ok(MapKeeper::new(map, friction))
}

/// The map with what the vehicle of a run sees, until the run ends or the user does.
pub(super) fn listened(
    folder: &Path,
    run: &RunName,
    friction: ClassFriction,
) -> anyhow::Result<(TileMap, Vec<Merged>)> {
    let mut is_there = RunName::alive()?.contains(run);
    if !is_there {
        let expected = "--listen: expected a run that is there";
        return Err(UsageError(format!("{expected}, found none named {run}")).into());
    }
    let bus = Bus::visit(run)?;
    let mut surfaces: Inlet<_, _> = bus.inlet(&SURFACE)?;
    let mut kept: Option<MapKeeper> = None;
    println!("run {run}: what it sees is kept until it ends, or Ctrl-C");
    while is_there && !interrupt::interrupted() {
        std::thread::sleep(Duration::from_secs_f64(LOOK_PERIOD_S));
        let seen = surfaces.newest().and_then(|map| surface_map(map.header(), map.payload()));
        if let Some(seen) = seen {
            let keeper = match &mut kept {
                Some(keeper) => keeper,
                none => none.insert(keeper(folder, seen.geometry().resolution_m, friction)?),
            };
            keeper.look(&seen).map_err(UsageError::from_input)?;
        }
        is_there = RunName::alive().is_ok_and(|runs| runs.contains(run));
    }
    let nothing = || WorkFailed(format!("run {run}: expected maps of the ground, found none"));
    let (map, report) = kept.ok_or_else(nothing)?.finish()?;
    Ok((map, vec![Merged::of(format!("run {run}"), report)]))
}
