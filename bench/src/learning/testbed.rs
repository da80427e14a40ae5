//! The drives that everything is trained and judged on.

use bicycle::Vehicle;
use evidential::{Dataset, DatasetError};
use scenarios::{RockFieldConfig, Split};
use serde::Serialize;

use super::LearningError;
use crate::collection::{self, Collection, HeightScale, Place, ScaleRound, collect, find_height_scale};

/// Which testbed to drive.
#[derive(Clone, Debug)]
pub struct Request {
    /// The machine.
    pub vehicle: Vehicle,
    /// What the maps look like; the height scale of the test maps is looked for.
    pub field: RockFieldConfig,
    /// Decides maps, starts, steering and noise.
    pub seed: u64,
    /// Maps for training; as many for validation, for the test, and for the best achievable error.
    pub n_maps: u32,
    /// Trials on each map.
    pub n_trials: u32,
    /// Threads that share the trials; the result does not depend on it.
    pub n_threads: usize,
}

/// What is being driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Drives to learn from.
    Training,
    /// Drives to choose by.
    Validation,
    /// Drives to find the height scale of the test.
    HeightScale,
    /// Drives to report on.
    Test,
    /// Drives over other maps like those of the test.
    Elsewhere,
}

/// Examples for training, choice and test.
#[derive(Clone, Debug)]
pub struct Testbed {
    /// Even ground of the training maps.
    pub training: Dataset,
    /// Even ground of the validation maps.
    pub validation: Dataset,
    /// All ground of the test maps.
    pub test: Dataset,
    /// All ground of other maps of the test's kind, to learn what could be known about the test.
    pub elsewhere: Dataset,
    /// Examples up to this unevenness are in distribution: the median of all training drives [m].
    pub unevenness_max_m: f32,
    /// Height scale of the test maps.
    pub height_scale: HeightScale,
    /// What was asked for.
    pub request: Request,
}

/// A testbed in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TestbedReport {
    /// Name of the machine.
    pub vehicle: String,
    /// Seed of the maps and drives.
    pub seed: u64,
    /// Maps in each part.
    pub n_maps: u32,
    /// Trials on each map.
    pub n_trials: u32,
    /// What all heights of the test maps are multiplied by.
    pub test_height_scale: f64,
    /// Height scales that were driven to find it.
    pub height_scale_rounds: Vec<ScaleRound>,
    /// Share of the test footprints that are out of distribution.
    pub share_out_of_distribution: f64,
    /// Up to here an example is in distribution [m].
    pub unevenness_max_m: f32,
    /// Examples to learn from, even ground alone.
    pub n_training: usize,
    /// Examples to choose by, even ground alone.
    pub n_validation: usize,
    /// Examples of the test.
    pub n_test: usize,
    /// Of these in distribution.
    pub n_test_in_distribution: usize,
    /// Measurements of each parameter in the test.
    pub n_test_measured: [usize; 4],
    /// Examples of the other maps.
    pub n_elsewhere: usize,
}

/// Share of the test footprints that shall be out of distribution, and how exactly: 90 to 92 %.
const SHARE_OUT_OF_DISTRIBUTION: [f64; 2] = [0.91, 0.01];
/// Height scales that are driven for it.
const SCALES_TRIED: usize = 8;
/// Of the drives elsewhere, every so many is set aside to stop the training by.
pub(super) const SET_ASIDE: u32 = 4;

impl Testbed {
    /// Drives everything; `on_stage` hears of each part as it begins and `on_trial` of every drive.
    ///
    /// # Errors
    /// Fewer than four drives, settings that no world or drive can have, a part without even ground.
    pub fn drive(
        request: &Request,
        on_stage: &(dyn Fn(Stage) + Sync),
        on_trial: &(dyn Fn() + Sync),
    ) -> Result<Self, LearningError> {
        let n_drives = request.n_maps.saturating_mul(request.n_trials);
        if n_drives < SET_ASIDE {
            return Err(LearningError::Drives { expected: SET_ASIDE, found: n_drives });
        }
        let part = |stage: Stage, asked: collection::Request| -> Result<Dataset, LearningError> {
            on_stage(stage);
            let collected = collect(&asked, on_trial);
            let collected = collected.map_err(|source| LearningError::Collection {
                which: stage.name(),
                source: Box::new(source),
            });
            collected.map(|Collection { dataset, .. }| dataset)
        };
        let mut training = part(Stage::Training, request.of(Split::Train))?;
        let mut validation = part(Stage::Validation, request.of(Split::Validation))?;
        on_stage(Stage::HeightScale);
        let height_scale =
            find_height_scale(&training, &request.of(Split::Test), SHARE_OUT_OF_DISTRIBUTION, SCALES_TRIED)
                .map_err(|source| LearningError::Collection {
                which: Stage::HeightScale.name(),
                source: Box::new(source),
            })?;
        let mut request = request.clone();
        request.field.test_height_scale = height_scale.scale;
        let test = part(Stage::Test, request.of(Split::Test))?;
        let other = collection::Request { first_map: request.n_maps, ..request.of(Split::Test) };
        let elsewhere = part(Stage::Elsewhere, other)?;
        let unevenness_max_m = training.unevenness_quantile_m(0.5);
        keep_even(&mut training, Stage::Training, unevenness_max_m)?;
        keep_even(&mut validation, Stage::Validation, unevenness_max_m)?;
        Ok(Self { training, validation, test, elsewhere, unevenness_max_m, height_scale, request })
    }

    /// The drives elsewhere to learn from, and those to stop by.
    pub(super) fn elsewhere_split(&self) -> [Dataset; 2] {
        [false, true].map(|is_aside| {
            let mut part = self.elsewhere.clone();
            part.examples.retain(|example| (example.drive % SET_ASIDE == SET_ASIDE - 1) == is_aside);
            part
        })
    }

    /// The testbed in numbers.
    pub fn report(&self) -> TestbedReport {
        let even = self.test.examples.iter().filter(|example| example.unevenness_m <= self.unevenness_max_m);
        let n_test_in_distribution = even.count();
        let n_test = self.test.examples.len();
        TestbedReport {
            vehicle: self.test.origin.vehicle.clone(),
            seed: self.request.seed,
            n_maps: self.request.n_maps,
            n_trials: self.request.n_trials,
            test_height_scale: self.height_scale.scale,
            height_scale_rounds: self.height_scale.rounds.clone(),
            share_out_of_distribution: 1.0 - n_test_in_distribution as f64 / n_test as f64,
            unevenness_max_m: self.unevenness_max_m,
            n_training: self.training.examples.len(),
            n_validation: self.validation.examples.len(),
            n_test,
            n_test_in_distribution,
            n_test_measured: self.test.n_measured(),
            n_elsewhere: self.elsewhere.examples.len(),
        }
    }
}

/// Leaves the ground that is in distribution.
fn keep_even(dataset: &mut Dataset, stage: Stage, unevenness_max_m: f32) -> Result<(), LearningError> {
    dataset.examples.retain(|example| example.unevenness_m <= unevenness_max_m);
    match dataset.examples.is_empty() {
        true => Err(LearningError::Data { which: stage.name(), source: DatasetError::Empty }),
        false => Ok(()),
    }
}

impl Request {
    /// The drives over one split.
    fn of(&self, split: Split) -> collection::Request {
        let place = Place::Rocks { field: self.field.clone(), split };
        collection::Request {
            n_maps: self.n_maps,
            n_trials: self.n_trials,
            n_threads: self.n_threads,
            ..collection::Request::new(self.vehicle.clone(), place, self.seed)
        }
    }

    /// Drives in each part.
    pub fn n_drives(&self) -> u32 {
        self.n_maps.saturating_mul(self.n_trials)
    }
}

impl Stage {
    /// Name of the part for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::Validation => "validation",
            Self::HeightScale => "height scale",
            Self::Test => "test",
            Self::Elsewhere => "other test",
        }
    }
}
