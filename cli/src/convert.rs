//! `surefoot convert`: recordings as a bag of ROS 2.

mod translation;

use std::collections::BTreeMap;
use std::path::Path;

use formats::{open_recording, read_vehicle};
use ros::bag::MessageWriter;
use serde::Serialize;

use crate::arguments::ConvertArguments;
use crate::{UsageError, WorkFailed, interrupt};
use translation::Translation;

/// What came of it.
#[derive(Serialize)]
struct Converted {
    /// The bag as it was named.
    bag: String,
    /// Messages by topic.
    topics: BTreeMap<String, u64>,
    /// Where and why a recording breaks off; null of whole ones.
    ended_early: Option<String>,
}

pub(crate) fn run(arguments: &ConvertArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    interrupt::catch_interrupts()?;
    let vehicle = arguments.vehicle.as_deref().map(read_vehicle).transpose();
    let limits = vehicle.map_err(UsageError::from_input)?.map(|vehicle| vehicle.limits);
    let bag = MessageWriter::create(&arguments.ros2);
    let bag = bag.map_err(|error| UsageError(format!("--ros2: {}", UsageError::from_input(error))))?;
    let mut translation = Translation::new(bag, limits);
    let mut ended_early = None;
    for file in &arguments.files {
        ended_early = ended_early.or(translate(file, &mut translation)?);
    }
    if translation.is_empty() {
        let files = arguments.files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>();
        let found = ended_early.unwrap_or_else(|| "none".to_owned());
        return Err(UsageError(format!(
            "{}: expected a recording with odometry, scans, commands, plans or risks, found {found}",
            files.join(", ")
        ))
        .into());
    }
    let notes = translation.notes();
    let topics = translation.finish()?;
    let converted = Converted { bag: arguments.ros2.display().to_string(), topics, ended_early };
    arguments.copy.write(&converted)?;
    show(&converted, &notes);
    Ok(())
}

/// Takes over a recording; returns where and why it breaks off.
fn translate(file: &Path, translation: &mut Translation) -> anyhow::Result<Option<String>> {
    let name = file.display();
    let refused = |found: &dyn std::fmt::Display| {
        UsageError(format!("{name}: expected a recording in MCAP, found: {found}"))
    };
    let messages = open_recording(file).map_err(|error| refused(&error))?;
    for (n_messages, message) in messages.enumerate() {
        if interrupt::interrupted() {
            return Err(WorkFailed(format!("{name}: interrupted, no bag is left")).into());
        }
        match message {
            Ok(message) => translation.take(&message).map_err(|error| placed(error, file))?,
            Err(error) if n_messages == 0 => return Err(refused(&error).into()),
            Err(error) => return Ok(Some(format!("{name}: after {n_messages} messages: {error}"))),
        }
    }
    Ok(None)
}

/// Says in which file a message is none; what the bag's own place is like has nothing to do with it.
fn placed(error: anyhow::Error, file: &Path) -> anyhow::Error {
    if error.is::<UsageError>() { error.context(file.display().to_string()) } else { error }
}

fn show(converted: &Converted, notes: &[String]) {
    for line in converted.ended_early.iter().chain(notes) {
        eprintln!("surefoot: {line}");
    }
    println!("{}", converted.bag);
    for (topic, n_messages) in &converted.topics {
        println!("  {topic}: {n_messages} messages");
    }
}
