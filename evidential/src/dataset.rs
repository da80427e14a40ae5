//! Footprints and what was measured on them.

mod builder;
mod file;

use serde::{Deserialize, Serialize};
use traversability::{Bins, N_BINS, Pmf};

use crate::FeatureLayout;
pub use builder::{Surveyor, SurveyorError};
pub use file::DatasetFileError;

/// Names of the four parameters, in their order everywhere.
pub const PARAMETER_NAMES: [&str; 4] = ["linear traction", "angular traction", "roll", "pitch"];

/// The bins of the four parameters, in the order of [`PARAMETER_NAMES`].
pub const PARAMETER_BINS: [Bins; 4] = [Bins::TRACTION, Bins::TRACTION, Bins::ATTITUDE, Bins::ATTITUDE];

/// One footprint and what was measured there.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// [`FeatureLayout::features`] of the footprint.
    pub features: Vec<f32>,
    /// Linear traction, angular traction, |roll| [rad], |pitch| [rad]; NaN where the measurement means nothing.
    pub measured: [f32; 4],
    /// The physics prior's distributions of the four parameters, bins ascending.
    pub prior: [[f32; N_BINS]; 4],
    /// Standard deviation of elevation under the footprint [m], PIETRA's measure of how uneven the ground is.
    pub unevenness_m: f32,
    /// Which drive it belongs to: neighbours in time must not be split between training and validation.
    pub drive: u32,
    /// Pose: x [m], y [m], yaw [rad].
    pub pose: [f64; 3],
}

/// What every example of a dataset has in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetOrigin {
    /// Name of the vehicle that drove.
    pub vehicle: String,
    /// How footprints became features.
    pub layout: FeatureLayout,
    /// Parameters of the physics prior that the examples hold.
    pub prior: physics_prior::PriorConfig,
    /// Name of each drive, by [`Example::drive`].
    pub drives: Vec<String>,
    /// How the data came to be, for people.
    pub provenance: String,
}

/// Examples of one vehicle, all alike in layout and finite but for measurements that mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// What all have in common.
    pub origin: DatasetOrigin,
    /// The examples, drive by drive in time order.
    pub examples: Vec<Example>,
}

/// Examples that nothing can be learnt from, or that are no examples.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DatasetError {
    /// Nothing there.
    #[error("dataset: expected at least one example, found none")]
    Empty,
    /// An example of another layout.
    #[error("example {example}, features: expected {expected} numbers, found {found}")]
    Features {
        /// Which example, from 0.
        example: usize,
        /// What the layout says.
        expected: usize,
        /// What the example holds.
        found: usize,
    },
    /// A number that is none.
    #[error("example {example}, {what}: expected a finite number, found {found}")]
    NonFinite {
        /// Which example, from 0.
        example: usize,
        /// What the number is.
        what: &'static str,
        /// The number.
        found: f64,
    },
    /// The prior is no distribution.
    #[error("example {example}, prior of {parameter}: {problem}")]
    Prior {
        /// Which example, from 0.
        example: usize,
        /// Of which parameter.
        parameter: &'static str,
        /// What is wrong.
        problem: traversability::PmfError,
    },
    /// A drive that the origin does not name.
    #[error("example {example}, drive: expected a number below {n_drives}, the drives named, found {found}")]
    Drive {
        /// Which example, from 0.
        example: usize,
        /// Drives that are named.
        n_drives: usize,
        /// The drive.
        found: u32,
    },
    /// Nothing was measured of a parameter.
    #[error("{parameter}: expected measurements in at least two bins, found none that means anything")]
    NothingMeasured {
        /// Of which parameter.
        parameter: &'static str,
    },
    /// Everything that was measured of a parameter is the same.
    #[error("{parameter}: expected measurements in at least two bins, found all {n} in the bin of {value}")]
    OneClass {
        /// Of which parameter.
        parameter: &'static str,
        /// Measurements.
        n: usize,
        /// The bin's value: traction, or an angle [rad].
        value: f32,
    },
    /// Examples of two kinds do not go together.
    #[error("{what}: expected {expected}, as in the first dataset, found {found}")]
    Mismatch {
        /// What differs.
        what: &'static str,
        /// Of the first.
        expected: String,
        /// Of the other.
        found: String,
    },
}

impl Dataset {
    /// Refuses what is no dataset: nothing in it, other lengths than the layout's, numbers that are not finite,
    /// priors that are no distributions, drives without a name.
    pub fn validate(&self) -> Result<(), DatasetError> {
        if self.examples.is_empty() {
            return Err(DatasetError::Empty);
        }
        let n_features = self.origin.layout.n_features();
        let n_drives = self.origin.drives.len();
        for (index, example) in self.examples.iter().enumerate() {
            example.validate(index, n_features, n_drives)?;
        }
        Ok(())
    }

    /// Refuses what cannot be learnt from: beyond [`Dataset::validate`], a parameter of which nothing was measured or
    /// all measurements fall into one bin.
    pub fn validate_for_training(&self) -> Result<(), DatasetError> {
        self.validate()?;
        for (parameter, bins) in PARAMETER_BINS.iter().enumerate() {
            let name = PARAMETER_NAMES[parameter];
            let mut seen =
                self.examples.iter().filter_map(|example| bins.bin_of(example.measured[parameter]));
            let Some(first) = seen.next() else {
                return Err(DatasetError::NothingMeasured { parameter: name });
            };
            if seen.all(|bin| bin == first) {
                let (n, value) = (self.n_measured()[parameter], bins.values()[first]);
                return Err(DatasetError::OneClass { parameter: name, n, value });
            }
        }
        Ok(())
    }

    /// The examples of both, whose drives stay apart.
    ///
    /// # Errors
    /// Another vehicle, layout or prior.
    pub fn joined(mut self, other: Self) -> Result<Self, DatasetError> {
        let refused = |what, expected, found| Err(DatasetError::Mismatch { what, expected, found });
        let (origin, another) = (&mut self.origin, other.origin);
        if origin.vehicle != another.vehicle {
            return refused("vehicle", origin.vehicle.clone(), another.vehicle);
        }
        if origin.layout != another.layout {
            return refused("layout", format!("{:?}", origin.layout), format!("{:?}", another.layout));
        }
        if origin.prior != another.prior {
            return refused("prior", format!("{:?}", origin.prior), format!("{:?}", another.prior));
        }
        let n_drives = origin.drives.len() as u32;
        origin.drives.extend(another.drives);
        origin.provenance = format!("{}; {}", origin.provenance, another.provenance);
        let moved = |example: Example| Example { drive: example.drive + n_drives, ..example };
        self.examples.extend(other.examples.into_iter().map(moved));
        Ok(self)
    }

    /// Examples in which each parameter was measured.
    pub fn n_measured(&self) -> [usize; 4] {
        std::array::from_fn(|parameter| {
            self.examples.iter().filter(|example| !example.measured[parameter].is_nan()).count()
        })
    }

    /// Unevenness below which this share of the examples lies [m]; NaN for an empty dataset.
    pub fn unevenness_quantile_m(&self, share: f64) -> f32 {
        let mut unevenness_m: Vec<f32> = self.examples.iter().map(|example| example.unevenness_m).collect();
        unevenness_m.sort_by(f32::total_cmp);
        let rank = (share.clamp(0.0, 1.0) * unevenness_m.len().saturating_sub(1) as f64).round();
        unevenness_m.get(rank as usize).copied().unwrap_or(f32::NAN)
    }
}

impl Example {
    fn validate(&self, example: usize, n_features: usize, n_drives: usize) -> Result<(), DatasetError> {
        if self.features.len() != n_features {
            let found = self.features.len();
            return Err(DatasetError::Features { example, expected: n_features, found });
        }
        if self.drive as usize >= n_drives {
            return Err(DatasetError::Drive { example, n_drives, found: self.drive });
        }
        let numbers = self.features.iter().map(|value| ("features", f64::from(*value)));
        let numbers = numbers.chain(self.pose.iter().map(|value| ("pose", *value)));
        let mut numbers = numbers.chain([("unevenness", f64::from(self.unevenness_m))]);
        // A measurement may be missing, but not infinite.
        let infinite = self.measured.iter().find(|value| value.is_infinite());
        let infinite = infinite.map(|value| ("measured", f64::from(*value)));
        if let Some((what, found)) = numbers.find(|(_, value)| !value.is_finite()).or(infinite) {
            return Err(DatasetError::NonFinite { example, what, found });
        }
        for (parameter, prior) in PARAMETER_NAMES.into_iter().zip(self.prior) {
            Pmf::new(prior).map_err(|problem| DatasetError::Prior { example, parameter, problem })?;
        }
        Ok(())
    }
}
