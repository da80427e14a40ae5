//! Routes over a map in tiles.

use std::path::{Path, PathBuf};

use ::route::{
    FarRouteError, GroundCell, LEVEL_MAX, RouteConfig, RouteError, RouteLine, SpeedLimits, TileMap, far_route,
};
use bicycle::Vehicle;
use terrain::GridMap;

use super::answer::Answer;
use super::failed;
use super::known::Known;
use crate::UsageError;
use crate::arguments::{RouteArguments, RouteGround};

/// Memory that the tiles may take.
pub(crate) const MEMORY_BYTES: usize = 256 << 20;
/// Cells that are searched at once, at most: with their edges and states half a gigabyte.
const CELLS_MAX: f64 = 4e6;
/// Cells of a picture, at most.
const SHOWN_CELLS_MAX: f64 = 2e6;
/// Cells are at least so large, where nothing else is asked for [m].
const CELL_M: f64 = 0.5;

/// A map in tiles, searched by cells of a level.
pub(super) struct Tiles {
    map: TileMap,
    level: u8,
    folder: PathBuf,
}

impl Tiles {
    pub fn open(folder: &Path, asked: &RouteGround) -> Result<Self, UsageError> {
        let map = TileMap::resume(folder, MEMORY_BYTES).map_err(UsageError::from_input)?;
        let wished_m = asked.cell.unwrap_or(CELL_M);
        let [least_m, most_m] = [0, LEVEL_MAX].map(|level| map.cell_m(level));
        if asked.cell.is_some_and(|cell_m| !(0.99 * least_m..=most_m).contains(&cell_m)) {
            let folder = folder.display();
            return Err(UsageError(format!(
                "--cell: expected {least_m} to {most_m} m, as {folder} has, found {wished_m}"
            )));
        }
        let level = (0..=LEVEL_MAX).find(|level| map.cell_m(*level) >= 0.99 * wished_m);
        Ok(Self { map, level: level.unwrap_or(LEVEL_MAX), folder: folder.to_owned() })
    }

    /// Whether the cells between start and goal can be searched at once.
    pub fn fits(&self, ends_m: [[f64; 2]; 2]) -> bool {
        self.map.level_within(self.level, ends_m, CELLS_MAX) == Some(self.level)
    }

    /// What lies around start and goal, in larger cells where they are far apart.
    pub fn known(mut self, ends_m: [[f64; 2]; 2]) -> Result<Known, UsageError> {
        let level = self.map.level_within(self.level, ends_m, CELLS_MAX);
        let outside = RouteError::Outside { name: "goal", found_m: ends_m[1] };
        let level = level.ok_or_else(|| UsageError::from_input(outside))?;
        let ground =
            self.map.around(level, &ends_m, TileMap::room_m(ends_m)).map_err(UsageError::from_input)?;
        Ok(Known { ground, reference: None })
    }

    /// Finds a way over more cells than are searched at once, and shows it.
    pub fn far(
        mut self,
        (vehicle, config, limits): (&Vehicle, &RouteConfig, &SpeedLimits),
        from: ([f64; 2], f64),
        goal_m: [f64; 2],
        arguments: &RouteArguments,
    ) -> anyhow::Result<()> {
        let found = far_route(&mut self.map, self.level, config, from, goal_m, limits);
        let found = found.map_err(|error| match error {
            FarRouteError::Route(error) => failed(error),
            other => UsageError(format!("{}: {other}", self.folder.display())).into(),
        })?;
        let ground = self.shown(&found.line)?;
        let answer = Answer {
            ground: &ground,
            line: &found.line,
            others: &[],
            reference: None,
            cost_m: None,
            n_expanded: found.n_expanded,
        };
        answer.show(vehicle, arguments)
    }

    /// The ground around a line, in cells that a picture can show.
    fn shown(&mut self, line: &RouteLine) -> Result<GridMap<GroundCell>, UsageError> {
        let places_m = line.places_m();
        let along = |axis: usize| places_m.iter().map(move |place| place[axis]);
        let corner = |pick: fn(f64, f64) -> f64, from: f64| [0, 1].map(|axis| along(axis).fold(from, pick));
        let ends_m = [corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY)];
        let level = self.map.level_within(self.level, ends_m, SHOWN_CELLS_MAX);
        let shown = self.map.around(level.unwrap_or(LEVEL_MAX), &ends_m, TileMap::room_m(ends_m));
        shown.map_err(UsageError::from_input)
    }
}
