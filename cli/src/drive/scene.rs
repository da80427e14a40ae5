//! From arguments to a vehicle, a world and a task in it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bicycle::{Model, Vehicle};
use formats::{ConfigText, ElevationFile, overlay, read_elevation, read_model, read_vehicle};
use navigator::{Config, GuardConfig};
use scenarios::{
    ArenaConfig, ArenaError, Bounds, LayerConfig, Pair, PairWish, ROCK_FIELD_DISTANCE_M, RockFieldConfig,
    Task, WorldLayers, check_pair, feasible_pair, world_from_layers,
};

use super::knowledge::Knowledge;
use super::open_loop::Script;
use crate::UsageError;
use crate::arguments::{DriveArguments, WorldSource};

/// Maps up to so many cells a side are built whole.
const WHOLE_MAP_CELLS: f64 = 3500.0;
/// What of a larger map is built around its start and goal, beyond the distance between them [m].
const WINDOW_MARGIN_M: f64 = 30.0;
/// Places of a large map that are searched for a start and a goal.
const WINDOWS_TRIED: u64 = 8;

/// What is driven, with what.
pub(super) struct Scene {
    pub vehicle: Vehicle,
    pub model: Model,
    pub config: Config,
    pub task: Task,
    pub knowledge: Knowledge,
    /// Commands to carry out instead of planning.
    pub script: Option<Script>,
}

/// A vehicle and what its planner knows, wherever it drives.
pub(crate) struct Machine {
    pub vehicle: Vehicle,
    pub model: Model,
    pub config: Config,
    pub knowledge: Knowledge,
}

/// Reads and builds everything; whatever cannot be is refused here, before anything drives.
pub(super) fn prepare(arguments: &DriveArguments) -> Result<Scene, UsageError> {
    let Machine { vehicle, model, config, knowledge } = machine(arguments, GuardConfig::default())?;
    let mut task = task(arguments, &vehicle)?;
    let read = |path: &PathBuf| Script::read(path, &vehicle.limits);
    let script = arguments.commands.as_ref().map(read).transpose()?;
    if script.is_some() {
        // Whoever follows commands to their end passes the goal by.
        task.goal_tolerance_m = 0.0;
    }
    Ok(Scene { vehicle, model, config, task, knowledge, script })
}

/// The machine alone, with a guard that its configuration may change.
pub(crate) fn machine(arguments: &DriveArguments, guard: GuardConfig) -> Result<Machine, UsageError> {
    let vehicle = read_vehicle(arguments.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    let model = match &arguments.model {
        Some(path) => read_model(path).map_err(UsageError::from_input)?,
        None => Model::of(&vehicle),
    };
    let mut config = Config { guard, ..Config::for_vehicle(&vehicle) };
    if let Some(path) = &arguments.config {
        let text = ConfigText::read(path).map_err(UsageError::from_input)?;
        config = overlay(&text, &config).map_err(UsageError::from_input)?;
    }
    config.controller.n_threads = arguments.n_threads();
    config.controller.isa = arguments.isa.into();
    let knowledge = Knowledge::choose(arguments, &vehicle)?;
    Ok(Machine { vehicle, model, config, knowledge })
}

/// Where to drive, from where, where to.
pub(crate) fn task(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Task, UsageError> {
    let standard = match &arguments.world {
        WorldSource::Rocks => {
            Task::rock_field(&RockFieldConfig::default(), arguments.seed).map_err(UsageError::from_input)?
        }
        WorldSource::Arena => arena(arguments)?,
        WorldSource::File(path) => return in_file(arguments, vehicle, path),
    };
    if arguments.start.is_none() && arguments.goal.is_none() {
        return Ok(standard);
    }
    let pair = Pair {
        start: arguments.start.map_or(standard.start, |start| [start.x_m, start.y_m, start.yaw_rad]),
        goal_m: arguments.goal.map_or(standard.goal_m, |goal| [goal.x_m, goal.y_m]),
    };
    check_pair(&standard.world, vehicle, &pair).map_err(UsageError::from_input)?;
    Ok(Task { start: pair.start, goal_m: pair.goal_m, ..standard })
}

fn arena(arguments: &DriveArguments) -> Result<Task, UsageError> {
    let config = ArenaConfig { bush_height_m: arguments.bush_height_m()?, ..ArenaConfig::default() };
    Task::arena(&config).map_err(|error: ArenaError| UsageError::from_input(error))
}

fn in_file(arguments: &DriveArguments, vehicle: &Vehicle, path: &Path) -> Result<Task, UsageError> {
    let layers = layers(read_elevation(path).map_err(UsageError::from_input)?);
    let bounds = layers.bounds();
    let shortest_m = (0..2).map(|k| bounds.north_east_m[k] - bounds.south_west_m[k]).fold(f64::MAX, f64::min);
    let wish = PairWish {
        start: arguments.start.map(|start| [start.x_m, start.y_m, start.yaw_rad]),
        goal_m: arguments.goal.map(|goal| [goal.x_m, goal.y_m]),
        distance_m: ROCK_FIELD_DISTANCE_M.min(0.5 * shortest_m),
    };
    let whole_m = WHOLE_MAP_CELLS * LayerConfig::for_vehicle(vehicle).resolution_m;
    let mut windows = windows(&bounds, &wish, (arguments.seed, whole_m)).into_iter().peekable();
    loop {
        let window = windows.next().flatten();
        let config = LayerConfig { window, ..LayerConfig::for_vehicle(vehicle) };
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let world =
            world_from_layers(name, &layers, &config, arguments.seed).map_err(UsageError::from_input)?;
        let world = Arc::new(world);
        match feasible_pair(&world, vehicle, &wish, arguments.seed) {
            Ok(Pair { start, goal_m }) => {
                return Ok(Task::in_world(world, start, goal_m, Task::tolerance_m(vehicle)));
            }
            Err(error) if windows.peek().is_none() => return Err(UsageError::from_input(error)),
            Err(_) => {}
        }
    }
}

/// The parts of a map to build and look for a pair in, one after the other: all of a small map; of a large one what
/// lies around the ends that are given, or places by the seed.
fn windows(map: &Bounds, wish: &PairWish, (seed, whole_m): (u64, f64)) -> Vec<Option<Bounds>> {
    let side_m = [0, 1].map(|k| map.north_east_m[k] - map.south_west_m[k]);
    if side_m[0].max(side_m[1]) <= whole_m {
        return vec![None];
    }
    let ends = wish.start.map(|[x_m, y_m, _]| [x_m, y_m]).into_iter().chain(wish.goal_m);
    let given: Vec<[f64; 2]> = ends.collect();
    let around = |places: &[[f64; 2]], within_m: f64| {
        let bound = |k: usize, pick: fn(f64, f64) -> f64| {
            places.iter().map(|place| place[k]).fold(places[0][k], pick)
        };
        Bounds {
            south_west_m: [0, 1].map(|k| bound(k, f64::min) - within_m),
            north_east_m: [0, 1].map(|k| bound(k, f64::max) + within_m),
        }
    };
    if !given.is_empty() {
        let free_m = if given.len() == 2 { 0.0 } else { wish.distance_m };
        return vec![Some(around(&given, WINDOW_MARGIN_M + free_m))];
    }
    // The fractional parts of multiples of the plastic number's powers spread evenly over a square.
    let place = |try_: u64| {
        let turn = (seed.wrapping_mul(WINDOWS_TRIED).wrapping_add(try_) % (1 << 32)) as f64;
        [(0, 0.754_877_666_246_693), (1, 0.569_840_290_998_053)]
            .map(|(k, step)| map.south_west_m[k] + side_m[k] * (turn * step).fract())
    };
    (0..WINDOWS_TRIED).map(|try_| Some(around(&[place(try_)], WINDOW_MARGIN_M + wish.distance_m))).collect()
}

fn layers(file: ElevationFile) -> WorldLayers {
    WorldLayers {
        elevation_m: file.elevation,
        canopy_height_m: file.layers.canopy_height_m,
        low_vegetation_fraction: file.layers.low_vegetation_fraction,
        water: file.layers.water,
        ground_gap_m: file.layers.ground_gap_m,
    }
}
