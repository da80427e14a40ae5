//! What the car learned before it came into the hall: level concrete and turf.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use bicycle::Vehicle;
use evidential::{Checkpoint, Dataset, Settings, train};
use scenarios::Split;
use serde::Serialize;

use super::{ArenaTableError, Request};
use crate::closed_loop::{MapSource, Method};
use crate::collection::{self, CollectionError, Place, collect};

/// Trials on every floor, and how long they last at most [s].
const N_TRIALS: u32 = 20;
const TRIAL_S: f64 = 6.0;
/// Floors to learn on: ten minutes of driving (section VI). Others to stop the training by.
const N_FLOORS: u32 = 5;
const N_OTHER_FLOORS: u32 = 2;
/// Of initial weights and of the order of examples.
const TRAINING_SEED: u64 = 1;

/// What was learned from, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Training {
    /// What was driven to learn from.
    pub provenance: String,
    /// Labelled footprints to learn from.
    pub n_training: usize,
    /// Labelled footprints to stop by.
    pub n_validation: usize,
}

/// The networks, by how they were trained.
#[derive(Default)]
pub(super) struct Networks {
    /// `None` where no method learns.
    pub training: Option<Training>,
    checkpoints: BTreeMap<&'static str, Arc<Checkpoint>>,
}

impl Networks {
    /// Drives and trains for all methods of a request that learn.
    pub(super) fn learn(
        vehicle: &Vehicle,
        request: &Request,
        revision: &str,
    ) -> Result<Self, ArenaTableError> {
        let learned = request.methods.iter().filter_map(|method| method.learned());
        let trainings: BTreeMap<&str, evidential::Method> =
            learned.map(|(training, _)| (training.name(), training)).collect();
        if trainings.is_empty() {
            return Ok(Self::default());
        }
        let training = driven(vehicle, (Split::Train, N_FLOORS), request)?;
        let validation = driven(vehicle, (Split::Validation, N_OTHER_FLOORS), request)?;
        let train = |(method, training_of)| {
            let settings = Settings::new(training_of, TRAINING_SEED);
            let trained =
                train(&training, &validation, &settings, revision, &mut |_| ControlFlow::Continue(()));
            let checkpoint =
                trained.map_err(|source| ArenaTableError::Training { method, source })?.checkpoint;
            Ok((method, Arc::new(checkpoint)))
        };
        Ok(Self {
            checkpoints: trainings.into_iter().map(train).collect::<Result<_, ArenaTableError>>()?,
            training: Some(Training {
                provenance: training.origin.provenance.clone(),
                n_training: training.examples.len(),
                n_validation: validation.examples.len(),
            }),
        })
    }

    /// Those that a method drives on, if any.
    pub(super) fn of(&self, method: Method) -> Option<Arc<Checkpoint>> {
        let (training, _) = method.learned()?;
        self.checkpoints.get(training.name()).cloned()
    }
}

/// Drives as the car sees them itself.
fn driven(
    vehicle: &Vehicle,
    (split, n_maps): (Split, u32),
    request: &Request,
) -> Result<Dataset, CollectionError> {
    let asked = collection::Request {
        n_maps,
        n_trials: N_TRIALS,
        time_limit_s: TRIAL_S,
        map_source: MapSource::Sensed,
        n_threads: request.n_threads,
        ..collection::Request::new(vehicle.clone(), Place::Floor { split }, request.seed)
    };
    Ok(collect(&asked, || ())?.dataset)
}
