//! The models: what they learn from, and what they are told while they drive.

use std::ops::ControlFlow;
use std::sync::Arc;

use kinodynamics::{
    Checkpoint, Epoch, Example, LabelCounts, Latency, Outcome, Recording, Settings, label, train,
    train_without_history,
};
use scenarios::stream;
use serde::Serialize;

use super::lap::{Driver, Told};
use super::machine::TICK_S;
use super::surfaces::Coefficients;
use super::{KinodynamicsError, Request, Row, Stage, Watch};

/// Windows that a shuffled history is drawn from.
const POOL: usize = 2000;

/// A training as it went.
#[derive(Clone, Debug, Serialize)]
pub struct TrainingReport {
    /// Which model.
    pub row: Row,
    /// Root mean square of what the curvature is off by on validation blocks, of the best pass [1/m].
    pub validation_rmse_per_m: f64,
    /// The same of the wish itself [1/m].
    pub identity_rmse_per_m: f64,
    /// Examples to learn from and to choose by.
    pub n_examples: [usize; 2],
    /// What the filters took.
    pub counts: LabelCounts,
    /// All passes.
    pub curves: Vec<Epoch>,
}

/// The random driving, and what is known of it.
pub(super) struct Lessons {
    pub(super) recording: Recording,
    /// The ground under the wheels at every command of every run.
    pub(super) coefficients: Vec<Vec<Coefficients>>,
    pub(super) latency: Latency,
    /// What no filter took anything away of.
    pub(super) examples: Vec<Example>,
}

/// Trains a row's model, if it has one.
pub(super) fn prepare(
    request: &Request,
    row: Row,
    lessons: &Lessons,
    (revision, watch): (&str, &dyn Watch),
) -> Result<(Driver, Option<TrainingReport>), KinodynamicsError> {
    let Some(settings) = row.settings(request) else {
        return Ok((Driver::Baseline, None));
    };
    watch.stage(Stage::Training(row, settings.n_passes() as u64));
    let mut on_epoch = |_: &Epoch| {
        watch.step();
        if watch.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = if row.is_oracle() {
        let (examples, counts) = known_examples(lessons, &settings);
        Outcome { counts, ..train_without_history(&examples, &settings, &mut on_epoch)? }
    } else {
        train(&lessons.recording, &settings, revision, &mut on_epoch)?
    };
    if watch.interrupted() {
        return Err(KinodynamicsError::Interrupted);
    }
    let Outcome { checkpoint, curves, counts, identity_rmse_per_m, n_examples, .. } = outcome;
    let best = curves.iter().map(|epoch| epoch.validation_rmse_per_m).fold(f64::INFINITY, f64::min);
    let told = told(row, &checkpoint, &lessons.examples, request.seed);
    let report =
        TrainingReport { row, validation_rmse_per_m: best, identity_rmse_per_m, n_examples, counts, curves };
    Ok((Driver::Model { checkpoint: Arc::new(checkpoint), told }, Some(report)))
}

/// The examples that other models learn from, with the ground's coefficients instead of histories.
fn known_examples(lessons: &Lessons, settings: &Settings) -> (Vec<Example>, LabelCounts) {
    let (mut examples, counts) = label(&lessons.recording, &settings.labels.after(&lessons.latency));
    for example in &mut examples {
        let tick = (example.time_s / TICK_S).round() as usize;
        example.window = lessons.coefficients[example.run][tick].to_vec();
    }
    (examples, counts)
}

fn told(row: Row, checkpoint: &Checkpoint, examples: &[Example], seed: u64) -> Told {
    match row {
        Row::Shuffled => {
            use rand::RngExt;
            let mut rng = stream(seed, &[0x5F]);
            let draw = |_| examples[rng.random_range(0..examples.len())].window.clone();
            Told::Shuffled(Arc::new((0..POOL).map(draw).collect()))
        }
        Row::Constant => {
            let means = checkpoint.sidecar().standardisation.mean;
            let column = |mean: f32| std::iter::repeat_n(mean, kinodynamics::WINDOW);
            Told::Constant(Arc::new(means.into_iter().flat_map(column).collect()))
        }
        Row::Oracle => Told::Known,
        _ => Told::Measured,
    }
}
