//! From arguments to a vehicle, a world and a task in it.

use std::path::{Path, PathBuf};

use bench::closed_loop::layers_of;
use bench::navigation::Place;
use bicycle::lanes::{Instructions, Isa};
use bicycle::{Model, Vehicle};
use formats::{ConfigText, overlay, read_elevation, read_model, read_vehicle};
use navigator::{Config, GuardConfig, Route};
use scenarios::{ArenaConfig, ArenaError, EpisodeConfig, Pair, PairWish, RockFieldConfig, Task, check_pair};

use super::knowledge::Knowledge;
use super::open_loop::Script;
use crate::UsageError;
use crate::arguments::{DriveArguments, WorldSource};
use crate::route::known::known_friction;

/// What is driven, with what.
pub(super) struct Scene {
    pub vehicle: Vehicle,
    pub model: Model,
    pub config: Config,
    pub task: Task,
    /// Of the sensors' noise and the controller's samples.
    pub seed: u64,
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
    let seed = match arguments.world {
        WorldSource::Navigation { map, pair, .. } => {
            Place { seed: arguments.seed, map, pair }.seed_of_drive()
        }
        _ => arguments.seed,
    };
    Ok(Scene { vehicle, model, config, task, seed, knowledge, script })
}

/// The machine alone, with a guard that its configuration may change.
pub(crate) fn machine(arguments: &DriveArguments, guard: GuardConfig) -> Result<Machine, UsageError> {
    let mut vehicle = read_vehicle(arguments.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    vehicle.limits.speed_max_mps = arguments.speed.unwrap_or(vehicle.limits.speed_max_mps);
    machine_of(vehicle, arguments, guard)
}

/// The same of a vehicle that has been read.
pub(crate) fn machine_of(
    vehicle: Vehicle,
    arguments: &DriveArguments,
    guard: GuardConfig,
) -> Result<Machine, UsageError> {
    let model = match &arguments.model {
        Some(path) => read_model(path).map_err(UsageError::from_input)?,
        None => Model::of(&vehicle),
    };
    let mut config = Config { guard, ..Config::for_vehicle(&vehicle) };
    if let Some(path) = &arguments.config {
        let text = ConfigText::read(path).map_err(UsageError::from_input)?;
        config = overlay(&text, &config).map_err(UsageError::from_input)?;
    }
    if config.areas.geofence_m.is_empty() {
        config.areas.geofence_m = end_of_ground_m(arguments, &vehicle)?;
    }
    if arguments.walkers > 0 {
        config.moving.get_or_insert_default();
    }
    if let Some(known) = known_friction(&arguments.ground.kinds)? {
        config.keep_to_friction(known);
    }
    config.controller.n_threads = arguments.kernels.threads.count();
    config.controller.isa = isa(arguments, config.controller.isa)?;
    let knowledge = Knowledge::choose(arguments, &vehicle)?;
    Ok(Machine { vehicle, model, config, knowledge })
}

/// Where the ground ends that a benchmark made or somebody measured, as corners of a fence [m]: no sensor shows it. None
/// elsewhere.
fn end_of_ground_m(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Vec<[f64; 2]>, UsageError> {
    match arguments.world {
        WorldSource::Navigation { ground, .. } => Ok(Place::fence_m(&ground.field(vehicle))),
        WorldSource::File(_) => Ok(task(arguments, vehicle)?.world.bounds().corners_m()),
        WorldSource::Rocks | WorldSource::Arena => Ok(Vec::new()),
    }
}

/// The instruction set as asked, else as configured; by its name, so that whoever records the settings tells what was
/// used.
fn isa(arguments: &DriveArguments, configured: Isa) -> Result<Isa, UsageError> {
    let wished = match Isa::from(arguments.kernels.isa) {
        Isa::Auto => configured,
        asked => asked,
    };
    Ok(Instructions::find(wished).map_err(UsageError::from_input)?.isa())
}

/// Longest that a vehicle waits for people before its drive counts as over [s].
const WAITING_MAX_S: f64 = 30.0;

/// Lets people walk about in an episode, as many as were asked for.
pub(crate) fn let_walk(
    arguments: &DriveArguments,
    vehicle: &Vehicle,
    task: &Task,
    episode: &mut EpisodeConfig,
) {
    if arguments.walkers == 0 {
        return;
    }
    episode.walkers = task.crossing_walkers(arguments.walkers, vehicle.limits.speed_max_mps, arguments.seed);
    let rules = &mut episode.rules;
    (rules.immobile_s, rules.stopped_s) =
        (rules.immobile_s.max(WAITING_MAX_S), rules.stopped_s.max(WAITING_MAX_S));
}

/// Where to drive, from where, where to.
pub(crate) fn task(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Task, UsageError> {
    let task = task_of_world(arguments, vehicle)?;
    Ok(Task { goal_tolerance_m: arguments.tolerance.unwrap_or(task.goal_tolerance_m), ..task })
}

fn task_of_world(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Task, UsageError> {
    let standard = match &arguments.world {
        WorldSource::Rocks => {
            Task::rock_field(&RockFieldConfig::default(), arguments.seed).map_err(UsageError::from_input)?
        }
        &WorldSource::Navigation { ground, map, pair } => {
            let place = Place { seed: arguments.seed, map, pair };
            place.task(&ground.field(vehicle)).map_err(UsageError::from_input)?
        }
        WorldSource::Arena => arena(arguments)?,
        WorldSource::File(path) => return in_file(arguments, vehicle, path),
    };
    if arguments.start.is_none() && arguments.goal.is_empty() {
        return Ok(standard);
    }
    let start = arguments.start.map_or(standard.start, |start| [start.x_m, start.y_m, start.yaw_rad]);
    let task = Task { start, goal_m: last_goal_m(arguments).unwrap_or(standard.goal_m), ..standard };
    check_goals(arguments, vehicle, &task)?;
    Ok(task)
}

fn last_goal_m(arguments: &DriveArguments) -> Option<[f64; 2]> {
    arguments.goal.last().map(|goal| [goal.x_m, goal.y_m])
}

/// Refuses a start or a goal at which the vehicle cannot stand.
fn check_goals(arguments: &DriveArguments, vehicle: &Vehicle, task: &Task) -> Result<(), UsageError> {
    let before = arguments.goal.iter().rev().skip(1).map(|goal| [goal.x_m, goal.y_m]);
    std::iter::once(task.goal_m).chain(before).try_for_each(|goal_m| {
        let pair = Pair { start: task.start, goal_m };
        check_pair(&task.world, vehicle, &pair).map_err(UsageError::from_input)
    })
}

/// Where to go: the goals as asked, one after the other, else that of the task.
pub(crate) fn route(arguments: &DriveArguments, task: &Task) -> Result<Route, UsageError> {
    let asked: Vec<[f64; 2]> = arguments.goal.iter().map(|goal| [goal.x_m, goal.y_m]).collect();
    let goals_m = if asked.is_empty() { vec![task.goal_m] } else { asked };
    Route::goals(goals_m, task.goal_tolerance_m).map_err(UsageError::from_input)
}

fn arena(arguments: &DriveArguments) -> Result<Task, UsageError> {
    let config = ArenaConfig { bush_height_m: arguments.bush_height_m()?, ..ArenaConfig::default() };
    Task::arena(&config).map_err(|error: ArenaError| UsageError::from_input(error))
}

fn in_file(arguments: &DriveArguments, vehicle: &Vehicle, path: &Path) -> Result<Task, UsageError> {
    let layers = layers_of(read_elevation(path).map_err(UsageError::from_input)?);
    let wish = PairWish {
        start: arguments.start.map(|start| [start.x_m, start.y_m, start.yaw_rad]),
        goal_m: last_goal_m(arguments),
        distance_m: layers.drive_distance_m(),
    };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let task =
        Task::in_layers(&name, &layers, vehicle, &wish, arguments.seed).map_err(UsageError::from_input)?;
    if arguments.goal.len() > 1 {
        check_goals(arguments, vehicle, &task)?;
    }
    Ok(task)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;

    fn isa_of(words: &[&str]) -> Isa {
        let words = ["surefoot", "drive", "--method", "physics"].iter().chain(words);
        match Arguments::try_parse_from(words).unwrap().command {
            Command::Drive(arguments) => {
                machine(&arguments, GuardConfig::default()).unwrap().config.controller.isa
            }
            _ => unreachable!("parsed from `drive`"),
        }
    }

    #[test]
    fn settings_name_the_instruction_set_that_is_used() {
        assert_eq!(isa_of(&[]), Instructions::widest().isa());
        assert_eq!(isa_of(&["--isa", "portable"]), Isa::Portable);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        std::fs::write(&file, "[controller]\nisa = \"portable\"\n").unwrap();
        assert_eq!(isa_of(&["--config", file.to_str().unwrap()]), Isa::Portable, "as the file says");
    }

    fn config_of(words: &[&str]) -> Result<Config, UsageError> {
        let words = ["surefoot", "drive", "--method", "physics"].iter().chain(words);
        match Arguments::try_parse_from(words).unwrap().command {
            Command::Drive(arguments) => machine(&arguments, GuardConfig::default()).map(|made| made.config),
            _ => unreachable!("parsed from `drive`"),
        }
    }

    /// Ice, of which a drive showed half of what is published, 0.20 at 1 m/s; of grass and sand nothing was shown.
    #[test]
    fn friction_that_drives_showed_is_told_to_the_controller() {
        let untold = config_of(&[]).unwrap();
        assert_eq!((untold.friction, untold.controller.costs.grip_s), (None, 0.0));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("friction.toml");
        let table = |ground: &str| {
            format!(
                "vehicle = 'sedan'\n[[ground]]\nground = '{ground}'\ndriven_s = 30.0\nat_limit_s = 4.0\n\
                 grip = {{ kind = 'at_least', friction = 0.08 }}\n[ground.curve]\nstatic_friction = 0.2\n\
                 sliding_friction = 0.1\nviscous_friction = 0.0\nstribeck_speed_mps = 0.5\n"
            )
        };
        std::fs::write(&file, table("ice")).unwrap();
        let words = ["--friction", file.to_str().unwrap(), "--bare", "ice"];
        let told = config_of(&words).unwrap();
        let known = told.friction.unwrap();
        let curve = |curve: ::route::FrictionCurve| f64::from(curve.at(1.0));
        assert_eq!(known.open, Some(curve(::route::FrictionCurve::ICE.scaled(0.5))));
        assert_eq!(known.vegetation, Some(curve(::route::FrictionCurve::GRASS)));
        assert_eq!(known.loose, Some(curve(::route::FrictionCurve::SAND)));
        assert!(known.open.unwrap() < 0.12 && told.controller.costs.grip_s > 0.0);
        std::fs::write(&file, table("lava")).unwrap();
        let refused = config_of(&words).unwrap_err().to_string();
        assert!(refused.contains("friction.toml") && refused.contains("found lava"), "{refused}");
    }
}
