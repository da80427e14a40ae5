//! From arguments to a vehicle, a world and a task in it.

use std::path::Path;
use std::sync::Arc;

use bicycle::{Model, Vehicle};
use formats::{ConfigText, ElevationFile, overlay, read_elevation, read_model, read_vehicle};
use navigator::Config;
use scenarios::{
    ArenaConfig, ArenaError, LayerConfig, Pair, PairWish, ROCK_FIELD_DISTANCE_M, RockFieldConfig, Task,
    World, WorldLayers, check_pair, feasible_pair, world_from_layers,
};

use crate::UsageError;
use crate::arguments::{DriveArguments, WorldSource};

/// What is driven, with what.
pub(super) struct Scene {
    pub vehicle: Vehicle,
    pub model: Model,
    pub config: Config,
    pub task: Task,
}

/// Reads and builds everything; whatever cannot be is refused here, before anything drives.
pub(super) fn prepare(arguments: &DriveArguments) -> Result<Scene, UsageError> {
    let vehicle = read_vehicle(arguments.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    let model = match &arguments.model {
        Some(path) => read_model(path).map_err(UsageError::from_input)?,
        None => Model::of(&vehicle),
    };
    let mut config = Config::for_vehicle(&vehicle);
    if let Some(path) = &arguments.config {
        let text = ConfigText::read(path).map_err(UsageError::from_input)?;
        config = overlay(&text, &config).map_err(UsageError::from_input)?;
    }
    config.controller.n_threads = arguments.n_threads();
    config.controller.isa = arguments.isa.into();
    let task = task(arguments, &vehicle)?;
    Ok(Scene { vehicle, model, config, task })
}

fn task(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Task, UsageError> {
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
    let file = read_elevation(path).map_err(UsageError::from_input)?;
    let world = Arc::new(world(file, vehicle, path, arguments.seed)?);
    let wish = PairWish {
        start: arguments.start.map(|start| [start.x_m, start.y_m, start.yaw_rad]),
        goal_m: arguments.goal.map(|goal| [goal.x_m, goal.y_m]),
        distance_m: ROCK_FIELD_DISTANCE_M,
    };
    let pair = feasible_pair(&world, vehicle, &wish, arguments.seed).map_err(UsageError::from_input)?;
    Ok(Task::in_world(world, pair.start, pair.goal_m, Task::tolerance_m(vehicle)))
}

fn world(file: ElevationFile, vehicle: &Vehicle, path: &Path, seed: u64) -> Result<World, UsageError> {
    let layers = WorldLayers {
        elevation_m: file.elevation,
        canopy_height_m: file.layers.canopy_height_m,
        low_vegetation_fraction: file.layers.low_vegetation_fraction,
        water: file.layers.water,
        ground_gap_m: file.layers.ground_gap_m,
    };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    world_from_layers(name, &layers, &LayerConfig::for_vehicle(vehicle), seed).map_err(UsageError::from_input)
}
