//! `surefoot play`: a bag of ROS 2 through the pipeline, and what would have been decided.
#![allow(clippy::disallowed_methods, reason = "--pace real follows the wall clock")]

mod kept;
mod player;

use std::time::{Duration, Instant};

use bicycle::{Column, DriveLog};
use formats::Bag;
use navigator::{Areas, Route};
use report::drive::{DrivePicture, RiskLayer};
use ros::bag::{BagDrive, LogTopics, Robot, drive_log};
use scenarios::Bounds;

use crate::arguments::{Pace, PlayArguments, UpArguments};
use crate::drive::scene::Machine;
use crate::up::robot;
use crate::{UsageError, interrupt};
use kept::{Ending, Kept, PlaySummary};
use player::{Player, PlayerSetup};

/// The files that are left.
const SUMMARY: &str = "play.json";
const RECORDING: &str = "play.mcap";
const PICTURE: &str = "play.png";
/// How far around the way the ground is drawn [m].
const MARGIN_M: f64 = 20.0;

pub(crate) fn run(arguments: &PlayArguments) -> anyhow::Result<()> {
    let up = &robot::described(&UpArguments::of_robot(&arguments.robot, &arguments.goal)?)?;
    let ros = robot::ros(up, &arguments.robot)?;
    let machine = robot::machine(up, runtime::ages::guard(&robot::periods(up)))?;
    let bag = Bag::open(&arguments.bag).map_err(UsageError::from_input)?;
    let driven = drive_log(&bag, &LogTopics::of_robot(ros), Some(Robot { ros, vehicle: &machine.vehicle }))
        .map_err(|error| UsageError(format!("{}: {error}", arguments.bag.display())))?;
    let route = route(up, &machine, &driven.log)?;
    let results = &arguments.results;
    results.prepare()?;
    interrupt::catch_interrupts()?;
    let recording = results.file(RECORDING);
    let setup =
        PlayerSetup { up, ros, machine: &machine, route, recording: &recording, ground: extent(&driven.log) };
    let mut player = Player::new(setup)?;
    let ended_early = play(arguments.pace, &bag, &mut player)?;
    let (mut kept, goal_m) = player.finish();
    kept.finish_recording()?;
    let is_interrupted = interrupt::interrupted();
    let ended_early = ended_early.filter(|_| !is_interrupted);
    let summary = kept.summary(arguments, goal_m, Ending { ended_early, is_interrupted });
    results.write_json(SUMMARY, &summary)?;
    results.write(PICTURE, &drawn(&machine, &kept, &summary)?)?;
    show(arguments, &driven, &summary);
    Ok(())
}

/// The goals that were asked for, else where the bag's odometry ends.
fn route(up: &UpArguments, machine: &Machine, driven: &DriveLog) -> Result<Route, UsageError> {
    let asked = up.drive.goal.iter().map(|goal| [goal.x_m, goal.y_m]).collect::<Vec<_>>();
    let last = || driven.runs().flat_map(|run| run.drive_rows()).last();
    let end = || last().map(|row| [row.value(Column::X), row.value(Column::Y)]);
    let goals_m = if asked.is_empty() { end().into_iter().collect() } else { asked };
    let tolerance_m = robot::tolerance_m(up, machine).unwrap_or_default();
    Route::goals(goals_m, tolerance_m).map_err(UsageError::from_input)
}

/// The part of the map that is drawn.
fn extent(driven: &DriveLog) -> Bounds {
    let mut bounds = Bounds { south_west_m: [f64::INFINITY; 2], north_east_m: [f64::NEG_INFINITY; 2] };
    for row in driven.runs().flat_map(|run| run.drive_rows()) {
        for (axis, column) in [Column::X, Column::Y].into_iter().enumerate() {
            let at_m = row.value(column);
            bounds.south_west_m[axis] = bounds.south_west_m[axis].min(at_m - MARGIN_M);
            bounds.north_east_m[axis] = bounds.north_east_m[axis].max(at_m + MARGIN_M);
        }
    }
    bounds
}

/// Plays the bag to where it ends; returns why it ended early.
fn play(pace: Pace, bag: &Bag, player: &mut Player<'_>) -> anyhow::Result<Option<String>> {
    let began = Instant::now();
    let (mut first_ns, mut failure) = (None, None);
    let ended_early = bag.take_all(|message| {
        if interrupt::interrupted() {
            return Err("interrupted by the user".to_owned());
        }
        if pace == Pace::Real {
            let since_ns = message.log_time_ns.saturating_sub(*first_ns.get_or_insert(message.log_time_ns));
            wait_until(began, Duration::from_nanos(since_ns));
        }
        player.take(&message).map_err(|error| {
            let told = error.to_string();
            failure = Some(error);
            told
        })
    });
    failure.map_or(Ok(ended_early), Err)
}

/// Waits in short stretches, so that an interruption is met.
fn wait_until(began: Instant, since: Duration) {
    while !interrupt::interrupted() {
        let left = since.saturating_sub(began.elapsed());
        if left.is_zero() {
            break;
        }
        std::thread::sleep(left.min(Duration::from_millis(100)));
    }
}

fn drawn(machine: &Machine, kept: &Kept, summary: &PlaySummary) -> anyhow::Result<Vec<u8>> {
    let world = kept.world()?;
    let known = kept.known();
    let subtitles = [
        summary.to_string().replace("\n  ", ", "),
        "the way: driven, as the bag says; the ground: what the pipeline believed of it".to_owned(),
    ];
    let driven = kept.driven();
    let start_m = driven.first().map_or(summary.goal_m, |first| [first.x_m, first.y_m]);
    let areas: &Areas = &machine.config.areas;
    Ok(report::drive::picture(&DrivePicture {
        title: &format!("{}: {} played", machine.vehicle.name, summary.bag),
        subtitles: &subtitles,
        world: &world,
        risk: Some(RiskLayer {
            values: kept.traction(),
            label: "worst traction [-]",
            harmless: 0.9,
            worst: 0.0,
        }),
        known: known.as_ref(),
        unfamiliar: Some(kept.unfamiliar()),
        driven,
        walked: &[],
        planned: &[],
        areas: Some(areas),
        start_m,
        goal_m: summary.goal_m,
        goal_radius_m: summary.tolerance_m,
        failure: None,
        vehicle: &machine.vehicle,
    })?)
}

/// Whether a topic is a word of a note.
fn speaks_of(note: &str, topic: &str) -> bool {
    note.split_whitespace().any(|word| word == topic)
}

fn show(arguments: &PlayArguments, driven: &BagDrive, summary: &PlaySummary) {
    let bag = arguments.bag.display();
    let Ending { ended_early, is_interrupted } = &summary.ending;
    let early = ended_early.iter().map(|problem| format!("the bag ends early, {problem}"));
    let early = early.chain(is_interrupted.then(|| "interrupted before its end".to_owned()));
    let notes = summary.left_out.iter().map(|(topic, note)| format!("{topic}: {note}"));
    let of_commands =
        driven.notes.iter().filter(|note| !summary.left_out.keys().any(|topic| speaks_of(note, topic)));
    for line in early.chain(notes).chain(of_commands.cloned()) {
        eprintln!("surefoot: {bag}: {line}");
    }
    println!("{summary}");
    for name in [SUMMARY, RECORDING, PICTURE] {
        println!("  {}", arguments.results.file(name).display());
    }
}
