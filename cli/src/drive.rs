//! `surefoot drive`: world, vehicle, navigator and episode, tied together.
#![allow(clippy::disallowed_methods, reason = "--pace real follows the wall clock")]

mod correction;
mod guided;
pub(crate) mod knowledge;
mod open_loop;
pub(crate) mod record;
pub(crate) mod scene;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use ::route::MapKeeper;
use bench::closed_loop::{self, ClosedLoop, Cycle, Drive, DriveError};
use bicycle::{Decision, StopReason};
use formats::config_hash;
use report::drive::{DrivePicture, RiskLayer};
use scenarios::{Episode, EpisodeConfig, Walker};
use traversability::CvarLevel;

use crate::arguments::{DriveArguments, Goal, MapSource, Pace, StartPose};
use crate::map::keep::{self, LOOK_PERIOD_S, Merged};
use crate::progress::{DriveProgress, ProgressLine};
use crate::route::Guided;
use crate::route::known::class_friction;
use crate::summary::{Milliseconds, Outcome, Summary, revision};
use crate::{UsageError, interrupt};
pub(crate) use correction::read_inverse_model;
pub(crate) use knowledge::read_checkpoint;
use open_loop::Script;
use record::{KnownRisk, Recording, path_samples};
use scene::Scene;

/// The files that a drive leaves.
const SUMMARY: &str = "summary.json";
const RECORDING: &str = "drive.mcap";
const PICTURE: &str = "drive.png";

pub(crate) fn run(arguments: &DriveArguments) -> anyhow::Result<()> {
    arguments.bush_height_m()?;
    let scene = scene::prepare(arguments)?;
    let mut guided = guided::plan(arguments, &scene)?;
    let mut closed = ClosedLoop::new(drive(arguments, &scene)?).map_err(|error| refused(arguments, error))?;
    closed.follow(scene::route(arguments, &scene.task)?)?;
    let results = &arguments.results;
    results.prepare()?;
    let mut keeper = keeper(arguments, &scene)?;
    let config_hash = config_hash(&(&scene.config, &scene.model, &scene.vehicle))?;
    let about = about(arguments, &scene, &config_hash);
    let mut recording = Recording::create(&results.file(RECORDING), about).map_err(UsageError::from_input)?;
    recording.goal(&scene.task.world, scene.task.goal_m)?;
    interrupt::catch_interrupts()?;
    if let Some(why) = &scene.knowledge.why_not_learned {
        println!("  method physics: {why}");
    }
    let driven = follow(arguments, &scene, &mut closed, (guided.as_mut(), keeper.as_mut()), &mut recording);
    // What was seen is kept, however the drive ended.
    let merged = keeper.map(MapKeeper::finish).transpose()?.map(|(_, report)| report);
    let kept = driven?;
    recording.finish()?;
    let summary = Summary {
        route: guided.as_ref().map(|guided| guided.told().clone()),
        kept: arguments
            .keep
            .as_ref()
            .zip(merged)
            .map(|(folder, report)| Merged::of(folder.display().to_string(), report)),
        ..summarise(arguments, &scene, &closed, &kept, config_hash)
    };
    results.write_json(SUMMARY, &summary)?;
    let planned = guided.as_ref().map(|guided| guided.route().line.places_m()).unwrap_or_default();
    results.write(PICTURE, &drawn(&scene, &closed, &kept, &planned, &summary)?)?;
    println!("{summary}");
    let files = [SUMMARY, RECORDING, PICTURE].map(|name| results.file(name));
    for path in files.iter().chain(&results.copy.json) {
        println!("  {}", path.display());
    }
    match scene.script.as_ref().is_some_and(|script| script.is_over(&closed.episode)) {
        true => Ok(()),
        false => Ok(summary.verdict()?),
    }
}

/// What the cycles leave behind.
struct Kept {
    tally: Tally,
    known: KnownRisk,
    /// Where each walker was after every cycle [m].
    walked: Vec<Vec<[f64; 2]>>,
}

impl Kept {
    fn note_walkers(&mut self, walkers: &[Walker]) {
        self.walked.resize(walkers.len(), Vec::new());
        for (way_m, walker) in self.walked.iter_mut().zip(walkers) {
            way_m.push(walker.position_m());
        }
    }
}

/// Times and stops over a drive.
#[derive(Default)]
struct Tally {
    control_ms: Vec<f64>,
    map_ms: Vec<f64>,
    deadline_misses: u64,
    stops: BTreeMap<StopReason, u64>,
    is_interrupted: bool,
}

impl Tally {
    fn count(&mut self, cycle: &Cycle, cycle_s: f64) {
        self.control_ms.push(cycle.control_ms);
        self.map_ms.extend(cycle.map_ms);
        if cycle.control_ms + cycle.map_ms.unwrap_or(0.0) > 1e3 * cycle_s {
            self.deadline_misses += 1;
        }
        if let Decision::Stop(reason) = cycle.decision {
            *self.stops.entry(reason).or_default() += 1;
        }
    }
}

fn drive<'a>(arguments: &DriveArguments, scene: &'a Scene) -> Result<Drive<'a>, UsageError> {
    let mut episode = EpisodeConfig::for_vehicle(&scene.vehicle);
    episode.rules.time_limit_s = arguments.time_limit;
    if scene.script.is_some() {
        Script::prepare(&mut episode);
    }
    episode.deviations = arguments.deviation.iter().map(|asked| asked.deviation).collect();
    scene::let_walk(arguments, &scene.vehicle, &scene.task, &mut episode);
    Ok(Drive {
        task: scene.task.clone(),
        vehicle: &scene.vehicle,
        model: scene.model.clone(),
        config: scene.config.clone(),
        episode,
        method: scene.knowledge.method,
        networks: scene.knowledge.networks.clone(),
        corrector: scene.knowledge.corrector.clone(),
        map_source: match arguments.map_source() {
            MapSource::Sensed => closed_loop::MapSource::Sensed,
            MapSource::Oracle => closed_loop::MapSource::Oracle,
        },
        level: CvarLevel::new(arguments.alpha).map_err(UsageError::from_input)?,
        seed: scene.seed,
    })
}

/// Keeps what is seen, where that was asked for.
fn keeper(arguments: &DriveArguments, scene: &Scene) -> Result<Option<MapKeeper>, UsageError> {
    let cell_m = scene.config.elevation.resolution_m;
    let open = |folder: &PathBuf| keep::keeper(folder, cell_m, class_friction(&arguments.ground.kinds)?);
    arguments.keep.as_ref().map(open).transpose()
}

/// Settings that cannot be together are told with the file that they come from.
fn refused(arguments: &DriveArguments, error: DriveError) -> UsageError {
    let from_file = arguments.config.as_ref().filter(|_| matches!(error, DriveError::Navigator(_)));
    let told = UsageError::from_input(error);
    from_file.map_or(told.clone(), |file| UsageError(format!("{}: {told}", file.display())))
}

/// Drives to the end, whatever it is.
fn follow(
    arguments: &DriveArguments,
    scene: &Scene,
    closed: &mut ClosedLoop,
    (mut guided, mut keeper): (Option<&mut Guided>, Option<&mut MapKeeper>),
    recording: &mut Recording,
) -> anyhow::Result<Kept> {
    let [x_m, y_m, _] = scene.task.start;
    let progress = ProgressLine::new(scene.task.distance_to_goal_m(x_m, y_m));
    let known =
        KnownRisk::new(scene.task.world.bounds(), scene.config.risk_resolution_m(), &scene.vehicle.limits);
    let mut kept = Kept { tally: Tally::default(), known, walked: Vec::new() };
    let began = Instant::now();
    let cycles_per_look = (LOOK_PERIOD_S / closed.episode.cycle_s()).round() as u64;
    while closed.episode.outcome().is_none() {
        let measured = closed.episode.observe().clone();
        let cycle = match &scene.script {
            Some(script) => script.cycle(&mut closed.episode)?,
            None => closed.cycle()?,
        };
        if let Some(guided) = &mut guided {
            guided::lead(guided, closed, scene.task.goal_tolerance_m, cycle.map_ms.is_some())?;
        }
        if let Some(keeper) = keeper.as_mut().filter(|_| closed.episode.n_cycles() % cycles_per_look == 1) {
            keeper.look(closed.navigator.surface())?;
        }
        kept.tally.count(&cycle, closed.episode.cycle_s());
        if let Some(map) = closed.navigator.risk_map().filter(|_| cycle.map_ms.is_some()) {
            kept.known.update(&map);
        }
        kept.note_walkers(closed.episode.walkers());
        recording.cycle(closed, &cycle, &measured)?;
        progress.update(&told(closed, &cycle));
        kept.tally.is_interrupted = interrupt::interrupted();
        if kept.tally.is_interrupted || scene.script.as_ref().is_some_and(|own| own.is_over(&closed.episode))
        {
            closed.episode.interrupt();
        }
        if arguments.pace == Some(Pace::Real) {
            let due = began + Duration::from_secs_f64(closed.episode.time_s());
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    }
    progress.finish();
    keeper.map_or(Ok(()), |keeper| keeper.look(closed.navigator.surface()))?;
    Ok(kept)
}

fn told(closed: &ClosedLoop, cycle: &Cycle) -> DriveProgress {
    let motion = closed.episode.motion();
    DriveProgress {
        distance_to_goal_m: closed.episode.task().distance_to_goal_m(motion.pose.x_m, motion.pose.y_m),
        simulated_s: closed.episode.time_s(),
        speed_mps: motion.velocity_mps[0],
        control_ms: cycle.control_ms,
    }
}

fn about(arguments: &DriveArguments, scene: &Scene, config_hash: &str) -> BTreeMap<String, String> {
    let pairs = [
        ("vehicle", scene.vehicle.name.clone()),
        ("world", scene.task.world.name.clone()),
        ("seed", arguments.seed.to_string()),
        ("alpha", arguments.alpha.to_string()),
        ("method", scene.knowledge.method.name().to_owned()),
        ("config_hash", config_hash.to_owned()),
        ("revision", revision().to_owned()),
    ];
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn summarise(
    arguments: &DriveArguments,
    scene: &Scene,
    closed: &ClosedLoop,
    kept: &Kept,
    config_hash: String,
) -> Summary {
    let (episode, tally) = (&closed.episode, &kept.tally);
    let networks = scene.knowledge.networks.as_ref();
    let has_density = networks.is_some_and(|networks| networks.sidecar.density.is_some());
    let outcome = episode.outcome().map_or(Outcome::Stopped, Outcome::from);
    let pose = episode.motion().pose;
    let [x_m, y_m, yaw_rad] = scene.task.start;
    let goal_m = scene.task.goal_m;
    Summary {
        outcome,
        reason: reason(episode, outcome, tally, scene.script.is_some()),
        time_to_goal_s: (outcome == Outcome::Goal).then(|| episode.time_s()),
        duration_s: episode.time_s(),
        path_length_m: episode.path_length_m(),
        distance_to_goal_m: scene.task.distance_to_goal_m(pose.x_m, pose.y_m),
        largest_roll_deg: episode.largest_roll_rad().to_degrees(),
        largest_pitch_deg: episode.largest_pitch_rad().to_degrees(),
        cycles: episode.n_cycles(),
        control_ms: Milliseconds::from_samples(&tally.control_ms),
        map_ms: Milliseconds::from_samples(&tally.map_ms),
        deadline_misses: tally.deadline_misses,
        stops: tally.stops.clone(),
        localisation_jumps: closed.navigator.n_jumps(),
        measurements_refused: closed.navigator.refused().clone(),
        scans: *closed.navigator.scans(),
        walkers: arguments.walkers,
        walked_into: episode.n_walked_into(),
        was_avoidable: episode.strike().map(|strike| strike.was_avoidable),
        route: None,
        kept: None,
        correction: closed.navigator.corrector().map(|corrector| corrector.counts().clone()),
        seed: arguments.seed,
        vehicle: scene.vehicle.name.clone(),
        world: scene.task.world.name.clone(),
        start: StartPose { x_m, y_m, yaw_rad },
        goal: Goal { x_m: goal_m[0], y_m: goal_m[1] },
        goals: arguments.goal.clone(),
        method: scene.knowledge.method,
        alpha: arguments.alpha,
        deviations: arguments.deviation.iter().map(|asked| asked.words.clone()).collect(),
        unfamiliar_share: has_density.then(|| kept.known.unfamiliar_share()),
        isa: format!("{:?}", closed.navigator.controller().diagnostics().isa).to_lowercase(),
        threads: arguments.kernels.threads.count(),
        config_hash,
        revision: revision().to_owned(),
    }
}

/// Why it did not end at the goal, for a person.
fn reason(episode: &Episode, outcome: Outcome, tally: &Tally, is_scripted: bool) -> String {
    let pose = episode.motion().pose;
    let place = format!("at ({:.1}, {:.1}) m", pose.x_m, pose.y_m);
    match outcome {
        Outcome::Goal => String::new(),
        Outcome::RolledOver | Outcome::AttitudeLimit => format!(
            "roll {:.0} deg, pitch {:.0} deg {place}",
            pose.roll_rad.to_degrees(),
            pose.pitch_rad.to_degrees()
        ),
        Outcome::Stopped if tally.is_interrupted => format!("interrupted by the user {place}"),
        Outcome::Stopped if is_scripted => format!("all commands were carried out {place}"),
        Outcome::Stopped => match tally.stops.iter().max_by_key(|(_, count)| **count) {
            Some((reason, count)) => format!("{reason:?} in {count} cycles {place}"),
            None => place,
        },
        Outcome::WalkerStruck => match episode.strike() {
            Some(strike) if strike.was_avoidable => format!("{place}, a stop would have avoided it"),
            _ => format!("{place}, no stop would have avoided it"),
        },
        Outcome::Stuck | Outcome::OutOfBounds | Outcome::Timeout | Outcome::Collision | Outcome::InWater => {
            place
        }
    }
}

fn drawn(
    scene: &Scene,
    closed: &ClosedLoop,
    Kept { known, walked, .. }: &Kept,
    planned: &[[f64; 2]],
    summary: &Summary,
) -> Result<Vec<u8>, report::EncodeError> {
    let driven = path_samples(closed);
    let seen = terrain::GridMap::from_values(
        *known.traction.geometry(),
        known.traction.values().iter().map(|value| !value.is_nan()).collect(),
    );
    let title = format!("{}: {}", summary.vehicle, summary.outcome);
    let subtitles = [format!(
        "{}, method {}, alpha {}, seed {}: {:.1} m in {:.1} s, largest roll {:.0} deg, largest pitch {:.0} deg",
        summary.world,
        summary.method.name(),
        summary.alpha,
        summary.seed,
        summary.path_length_m,
        summary.duration_s,
        summary.largest_roll_deg,
        summary.largest_pitch_deg
    )];
    let failure = summary.outcome.to_string();
    let [x_m, y_m, _] = scene.task.start;
    report::drive::picture(&DrivePicture {
        title: &title,
        subtitles: &subtitles,
        world: &scene.task.world,
        risk: Some(RiskLayer {
            values: &known.traction,
            label: "worst traction [-]",
            harmless: 0.9,
            worst: 0.0,
        }),
        known: seen.as_ref(),
        unfamiliar: Some(&known.unfamiliar),
        driven: &driven,
        walked,
        planned,
        areas: Some(&scene.config.areas),
        start_m: [x_m, y_m],
        goal_m: scene.task.goal_m,
        goal_radius_m: scene.task.goal_tolerance_m,
        failure: (summary.outcome != Outcome::Goal).then_some(failure.as_str()),
        vehicle: &scene.vehicle,
    })
}
