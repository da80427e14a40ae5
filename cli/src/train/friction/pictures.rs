//! Recordings over pictures from above: a network that sees friction.

use std::path::Path;

use friction::{Chassis, Lesson, Losses, Network, Recording, Settings, TrainingError, ViewError, train};
use serde::Serialize;

use crate::arguments::TrainFrictionArguments;
use crate::{UsageError, progress};

/// What is written.
const WEIGHTS: &str = "friction.safetensors";

/// Losses of one batch.
#[derive(Serialize)]
struct Batch {
    motion_loss: f64,
    prior_loss: f64,
}

/// Whether a file holds a recording, by its name.
pub(super) fn is_recording(word: &str) -> bool {
    Path::new(word).extension().is_some_and(|extension| extension == "safetensors")
}

pub(super) fn run(arguments: &TrainFrictionArguments, chassis: &Chassis) -> anyhow::Result<()> {
    let recordings = arguments.train.iter().map(|word| read(word)).collect::<Result<Vec<_>, UsageError>>()?;
    let resolution_m = one_resolution(&recordings, &arguments.train)?;
    arguments.results.prepare()?;
    let losses = match recordings.iter().all(|recording| recording.classes.is_some()) {
        true => Losses::Both,
        false => Losses::Motion,
    };
    let lessons: Vec<Lesson> = recordings
        .into_iter()
        .enumerate()
        .map(|(index, recording)| Lesson::new(chassis.clone(), recording, index))
        .collect();
    let network = Network::new(resolution_m, 1)?;
    let settings = Settings { losses, ..Settings::default() };
    let bar = progress::bar(settings.batches as u64, "{pos}/{len} batches");
    let mut batches = Vec::new();
    let trained = train(&network, &lessons, settings, &mut |_, [motion_loss, prior_loss]| {
        batches.push(Batch { motion_loss, prior_loss });
        bar.inc(1);
    });
    bar.finish_and_clear();
    trained.map_err(told)?;
    arguments.results.write(WEIGHTS, &network.to_bytes()?)?;
    arguments.results.copy.write(&batches)?;
    print!("{}", text(&lessons, losses, &batches));
    println!("\n  {WEIGHTS} in {}", arguments.results.out.display());
    Ok(())
}

fn read(word: &str) -> Result<Recording, UsageError> {
    if !is_recording(word) {
        let told =
            format!("{word}: expected recordings over pictures (.safetensors) alone, or drive logs alone");
        return Err(UsageError(told));
    }
    let bytes = std::fs::read(word).map_err(|error| UsageError(format!("{word}: {error}")))?;
    Recording::from_bytes(&bytes).map_err(|error| UsageError(format!("{word}: {error}")))
}

/// Edge of the pixels of all recordings [m].
fn one_resolution(recordings: &[Recording], names: &[String]) -> Result<f64, UsageError> {
    let expected_m = recordings[0].view.resolution_m;
    let other = recordings.iter().zip(names).find(|(recording, _)| recording.view.resolution_m != expected_m);
    match other {
        None => Ok(expected_m),
        Some((recording, name)) => {
            let found_m = recording.view.resolution_m;
            Err(UsageError(format!("{name}: {}", ViewError::Resolution { expected_m, found_m })))
        }
    }
}

/// What drives do not hold is the user's to add.
fn told(error: TrainingError) -> anyhow::Error {
    match error {
        TrainingError::NoWindow | TrainingError::NoClasses => UsageError::from_input(error).into(),
        other => other.into(),
    }
}

fn text(lessons: &[Lesson], losses: Losses, batches: &[Batch]) -> String {
    let n_windows: usize = lessons.iter().map(|lesson| lesson.windows.len()).sum();
    let from = match losses {
        Losses::Motion => "from the motion alone: not every recording tells its classes",
        Losses::Prior | Losses::Both => "from the motion and from published coefficients",
    };
    let mean = |batches: &[Batch]| {
        batches.iter().map(|batch| batch.motion_loss).sum::<f64>() / batches.len().max(1) as f64
    };
    let tenth = batches.len().div_ceil(10);
    let [first, last] = [mean(&batches[..tenth]), mean(&batches[batches.len() - tenth..])];
    format!(
        "  {n_windows} windows of 2 s in {} recordings, {from}\n  loss of the motion {first:.4} in the first tenth of \
         the batches, {last:.4} in the last\n",
        lessons.len()
    )
}
