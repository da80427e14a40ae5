//! The data of a training: read, checked, and held to ground that counts as familiar.

use evidential::Dataset;

use crate::UsageError;
use crate::arguments::TrainArguments;
use crate::collect::read_dataset;

/// What to learn from and what to choose by.
pub(super) struct Data {
    pub training: Dataset,
    pub validation: Dataset,
    /// More uneven examples were left out of both [m].
    pub unevenness_max_m: f32,
}

impl Data {
    /// Reads both files and keeps the even ground.
    pub(super) fn read(arguments: &TrainArguments) -> Result<Self, UsageError> {
        let mut training = read_dataset(&arguments.train)?;
        training
            .validate_for_training()
            .map_err(|error| UsageError(format!("{}: {error}", arguments.train.display())))?;
        let mut validation = read_dataset(&arguments.validation)?;
        let share = arguments.unevenness_percentile / 100.0;
        let unevenness_max_m =
            arguments.unevenness_max.unwrap_or_else(|| training.unevenness_quantile_m(share));
        for (option, dataset) in [("--train", &mut training), ("--validation", &mut validation)] {
            dataset.examples.retain(|example| share >= 1.0 || example.unevenness_m <= unevenness_max_m);
            if dataset.examples.is_empty() {
                return Err(UsageError(format!(
                    "{option}: expected examples with an unevenness up to {unevenness_max_m} m, found none"
                )));
            }
        }
        Ok(Self { training, validation, unevenness_max_m })
    }
}
