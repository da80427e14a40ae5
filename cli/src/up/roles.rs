//! One process of the machine.

use bench::closed_loop::Method;
use bus::ages::AgeLimits;
use bus::channel::{Bus, ChannelError};
use bus::status::Role;
use navigator::{Assessor, Belief, Route};
use runtime::ages as age_limits;
use runtime::control::{self, ControlSetup};
use runtime::learning::{self, LearningSetup};
use runtime::mapping::{self, MappingSetup};
use runtime::mission::{self, Beginning, MissionSetup};
use runtime::online::Told;
use runtime::realtime;
use runtime::recorder::{self, RecorderSetup};
use runtime::setup::{ClockAnchor, MachineSetup, RecordedSetup};
use rustix::process::{Signal, set_parent_process_death_signal};
use scenarios::{EpisodeConfig, Outcome, Task};
use serde::Serialize;
use simulator::{Ending, PlantReport, PlantSetup};
use std::ffi::OsString;
use std::sync::Arc;
use tracing::{info, warn};
use traversability::CvarLevel;

use super::{learn, robot, ros};
use crate::arguments::UpArguments;
use crate::drive::scene::{self, Machine};
use crate::summary::revision;
use crate::{UsageError, WorkFailed, interrupt};

/// Longest that the vehicle may stand still because it is told to stop, or not yet to drive, before the drive counts as
/// over: processes are started meanwhile [s].
const STANDING_MAX_S: f64 = 30.0;

/// Reads everything that the processes will, so that bad input is refused before they start. Returns the words by which
/// the mission's process knows route and tolerance, without building a world to find them in.
pub(super) fn prepare(arguments: &UpArguments) -> Result<Vec<OsString>, UsageError> {
    let machine = machine(arguments)?;
    learn::school(arguments, &machine)?;
    ages(arguments, &machine)?;
    if arguments.described.is_some() {
        Assessor::new(
            &machine.vehicle,
            &machine.model.limits,
            &machine.config,
            &Belief::Physics,
            level(arguments)?,
        )
        .map_err(UsageError::from_input)?;
        if robot::roles(arguments)?.contains(&Role::Mission) {
            beginning(arguments, &machine)?;
        }
        return Ok(Vec::new());
    }
    simulator::cycles_per_scan(&robot::periods(arguments)).map_err(UsageError::from_input)?;
    Ok(words_of_route(arguments, &scene::task(&arguments.drive, &machine.vehicle)?))
}

fn words_of_route(arguments: &UpArguments, task: &Task) -> Vec<OsString> {
    let [x_m, y_m] = task.goal_m;
    let is_known = arguments.standby || !arguments.drive.goal.is_empty();
    let goal = [format!("--goal={x_m},{y_m}")].into_iter().filter(|_| !is_known);
    let tolerance = [format!("--tolerance={}", task.goal_tolerance_m)];
    let tolerance = tolerance.into_iter().filter(|_| arguments.drive.tolerance.is_none());
    goal.chain(tolerance).map(OsString::from).collect()
}

fn run_mission(arguments: &UpArguments, machine: &Machine, ages: AgeLimits) -> anyhow::Result<()> {
    let (beginning, tolerance_m) = beginning(arguments, machine)?;
    let setup = MissionSetup {
        beginning,
        tolerance_m,
        model: &machine.model,
        guard: machine.config.guard,
        periods: robot::periods(arguments),
        ages,
        areas: machine.config.areas.clone(),
    };
    Ok(mission::run(&join(arguments)?, setup, &interrupt::interrupted)?)
}

/// How the mission begins, and how near to a goal counts as there [m].
fn beginning(arguments: &UpArguments, machine: &Machine) -> Result<(Beginning, f64), UsageError> {
    let drive = &arguments.drive;
    let goals_m = drive.goal.iter().map(|goal| [goal.x_m, goal.y_m]).collect::<Vec<_>>();
    let is_open = goals_m.is_empty() && !arguments.standby;
    let (goals_m, tolerance_m) = match (robot::tolerance_m(arguments, machine), is_open) {
        (Some(tolerance_m), false) => (goals_m, tolerance_m),
        (_, is_open) => {
            let task = scene::task(drive, &machine.vehicle)?;
            (if is_open { vec![task.goal_m] } else { goals_m }, task.goal_tolerance_m)
        }
    };
    let forbidden = goals_m.iter().find(|goal_m| !machine.config.areas.allow(**goal_m));
    if let Some([x_m, y_m]) = forbidden {
        return Err(UsageError(format!(
            "goal: expected a place where the vehicle may be, found ({x_m}, {y_m}) m, out of the geofence or in an area \
             to keep out of"
        )));
    }
    let beginning = match (arguments.again, goals_m.is_empty()) {
        (true, _) => Beginning::Latched,
        (false, true) => Beginning::Idle,
        (false, false) => {
            Beginning::Driving(Route::goals(goals_m, tolerance_m).map_err(UsageError::from_input)?)
        }
    };
    Ok((beginning, tolerance_m))
}

/// Joins the processes of the run.
pub(super) fn join(arguments: &UpArguments) -> Result<Bus, ChannelError> {
    Bus::join_with_room(&arguments.run, arguments.third_parties)
}

/// The machine, with a guard that fits the periods of the run.
fn machine(arguments: &UpArguments) -> Result<Machine, UsageError> {
    robot::machine(arguments, age_limits::guard(&robot::periods(arguments)))
}

fn ages(arguments: &UpArguments, machine: &Machine) -> Result<AgeLimits, UsageError> {
    let (periods, asked) = (robot::periods(arguments), robot::ages(arguments));
    age_limits::limits(&periods, &machine.config.guard, &asked).map_err(UsageError::from_input)
}

pub(super) fn run(arguments: &UpArguments, role: Role) -> anyhow::Result<()> {
    if arguments.supervised {
        set_parent_process_death_signal(Some(Signal::TERM))?;
    }
    if arguments.realtime {
        for part in realtime::granted(role) {
            match part {
                Ok(done) => info!("{done}"),
                Err(refused) => warn!("{refused}"),
            }
        }
    }
    let machine = machine(arguments)?;
    let ages = ages(arguments, &machine)?;
    let is_over = &interrupt::interrupted;
    match role {
        Role::Plant => run_plant(arguments, &machine, ages)?,
        Role::Mapping => {
            let setup = MappingSetup {
                vehicle: &machine.vehicle,
                config: machine.config.clone(),
                level: level(arguments)?,
                model: &machine.model,
                ages,
            };
            mapping::run(&join(arguments)?, &setup, is_over)?;
        }
        Role::Learning => run_learning(arguments, &machine)?,
        Role::Control => {
            let Machine { model, mut config, knowledge, .. } = machine;
            if arguments.realtime {
                // It has one core of its own.
                config.controller.n_threads = 1;
            }
            let (seed, period_s) = (arguments.drive.seed, robot::periods(arguments).control_s);
            let corrector = knowledge.corrector;
            let setup = ControlSetup { model, config, corrector, seed, period_s, ages };
            control::run(&join(arguments)?, setup, is_over)?;
        }
        Role::Mission => run_mission(arguments, &machine, ages)?,
        Role::Ros => ros::run(arguments, &machine, ages)?,
        Role::Recorder => {
            let setup = recorder_setup(arguments, machine, ages)?;
            std::fs::create_dir_all(&setup.folder)?;
            recorder::run(&join(arguments)?, setup, is_over, &mut |line| warn!("{line}"))?;
        }
    }
    Ok(())
}

fn run_learning(arguments: &UpArguments, machine: &Machine) -> anyhow::Result<()> {
    let (belief, checkpoint) = belief(machine)?;
    let setup = LearningSetup {
        vehicle: &machine.vehicle,
        config: machine.config.clone(),
        belief,
        checkpoint,
        level: level(arguments)?,
        limits: machine.model.limits,
    };
    let bus = join(arguments)?;
    match learn::school(arguments, machine)? {
        None => learning::run(&bus, &setup, &interrupt::interrupted)?,
        Some(school) => {
            let tell = &mut |told: Told<'_>| learn::tell(told, &arguments.drive.results.out);
            learning::run_and_learn(&bus, &setup, school, &interrupt::interrupted, tell)?;
        }
    }
    Ok(())
}

/// Size and time after which the next file of a recording is begun.
const FILE_BYTES_MAX: u64 = 256 << 20;
const FILE_TIME_MAX_S: f64 = 600.0;

fn recorder_setup(
    arguments: &UpArguments,
    machine: Machine,
    ages: AgeLimits,
) -> anyhow::Result<RecorderSetup> {
    let Machine { vehicle, model, config, knowledge } = machine;
    let checkpoint_sha256 = match &knowledge.networks {
        Some(networks) => networks.digest()?.hexadecimal(),
        None => String::new(),
    };
    let (vehicle_name, mounts) = (vehicle.name.clone(), config.sensors.clone());
    let [vehicle_toml, model_toml, config_toml] = MachineSetup { vehicle, model, config }.texts()?;
    let setup = RecordedSetup {
        format: RecordedSetup::FORMAT,
        clock: ClockAnchor::now(),
        vehicle_name,
        vehicle_toml,
        model_toml,
        config_toml,
        method: knowledge.method.name().to_owned(),
        checkpoint_sha256,
        corrector_sha256: knowledge
            .corrector
            .map(|checkpoint| checkpoint.sidecar().weights_sha256.clone())
            .unwrap_or_default(),
        alpha: arguments.drive.alpha,
        seed: arguments.drive.seed.to_string(),
        ages,
        revision: revision().to_owned(),
    };
    let folder = arguments.drive.results.out.clone();
    Ok(RecorderSetup {
        folder,
        setup,
        file_bytes_max: FILE_BYTES_MAX,
        file_time_max_s: FILE_TIME_MAX_S,
        mounts,
        quota_bytes: (arguments.record_quota * 1e6) as u64,
        sync_interval_s: arguments.record_sync,
    })
}

fn level(arguments: &UpArguments) -> Result<CvarLevel, UsageError> {
    CvarLevel::new(arguments.drive.alpha).map_err(UsageError::from_input)
}

/// What the method believes of the ground, and which networks that takes.
pub(crate) fn belief(machine: &Machine) -> anyhow::Result<(Belief, u64)> {
    let knowledge = &machine.knowledge;
    Ok(match (knowledge.method.learned(), &knowledge.networks) {
        (Some((_, unfamiliar)), Some(networks)) => {
            (Belief::Learned { checkpoint: Arc::clone(networks), unfamiliar }, networks.digest()?.short())
        }
        _ if knowledge.method == Method::Nominal => (Belief::Nominal, 0),
        _ => (Belief::Physics, 0),
    })
}

/// What a drive of the processes came to, as `summary.json`.
#[derive(Serialize)]
struct LiveSummary<'a> {
    outcome: Option<Outcome>,
    duration_s: f64,
    path_length_m: f64,
    distance_to_goal_m: f64,
    cycles_stopped_by_watchdog: u64,
    localisation_jumps: u64,
    seed: u64,
    vehicle: &'a str,
    world: &'a str,
    method: &'static str,
}

fn run_plant(arguments: &UpArguments, machine: &Machine, ages: AgeLimits) -> anyhow::Result<()> {
    let task = scene::task(&arguments.drive, &machine.vehicle)?;
    let world = task.world.name.clone();
    let mut episode = EpisodeConfig::for_vehicle(&machine.vehicle);
    episode.rules.time_limit_s = arguments.drive.time_limit;
    episode.deviations = arguments.drive.deviation.iter().map(|asked| asked.deviation).collect();
    episode.rules.startup_s = STANDING_MAX_S;
    episode.rules.stopped_s = STANDING_MAX_S;
    scene::let_walk(&arguments.drive, &machine.vehicle, &task, &mut episode);
    let setup = PlantSetup {
        task,
        vehicle: &machine.vehicle,
        episode,
        ending: if arguments.standby { Ending::Never } else { Ending::AtGoal },
        seed: arguments.drive.seed,
        periods: robot::periods(arguments),
        ages,
    };
    let report = simulator::run(&join(arguments)?, setup, &interrupt::interrupted)?;
    let PlantReport { outcome, time_s, path_length_m, distance_to_goal_m, .. } = report;
    let summary = LiveSummary {
        outcome,
        duration_s: time_s,
        path_length_m,
        distance_to_goal_m,
        cycles_stopped_by_watchdog: report.n_stopped_by_watchdog,
        localisation_jumps: report.n_jumps,
        seed: arguments.drive.seed,
        vehicle: &machine.vehicle.name,
        world: &world,
        method: machine.knowledge.method.name(),
    };
    std::fs::create_dir_all(&arguments.drive.results.out)?;
    arguments.drive.results.write_json("summary.json", &summary)?;
    match outcome {
        Some(Outcome::Goal) | None => Ok(()),
        Some(outcome) => Err(WorkFailed(format!(
            "goal not reached: {outcome} {distance_to_goal_m:.1} m from it after {time_s:.1} s"
        ))
        .into()),
    }
}
