//! PIETRA's learning benchmark (section V, tables I and II, figure 6): what six ways of training make of the same
//! drives over even ground, judged on ground that is mostly more uneven.
//!
//! The flow: a [`Testbed`] is driven, a [`Plan`] of trainings is worked off, [`judge`] turns what was trained into a
//! [`Report`] with its verdicts.

mod absurd;
mod evidence;
mod judge;
mod metric;
mod plan;
mod report;
mod row;
mod tally;
mod testbed;
mod verdict;

pub use absurd::Absurd;
pub use evidence::{EvidenceReport, Ground, GroundEvidence, WeightPercentiles};
pub use judge::judge;
pub use plan::{Chosen, Plan, Planned, Subject, Trained};
pub use report::{
    CalibrationReport, CurvePoint, DomainReport, HeadCalibration, MeanDeviation, Report, RowReport,
    UnevennessBin,
};
pub use row::Row;
pub use tally::Domain;
pub use testbed::{Request, Stage, Testbed, TestbedReport};

use evidential::{DatasetError, PredictorError, SettingError, TrainError};

use crate::collection::CollectionError;

/// Why there are no tables.
#[derive(Debug, thiserror::Error)]
pub enum LearningError {
    /// Too little to set drives aside.
    #[error("maps times trials: expected at least {expected} drives, found {found}")]
    Drives {
        /// Least number that can be split.
        expected: u32,
        /// What was asked for.
        found: u32,
    },
    /// The drives went wrong.
    #[error("{which} drives: {source}")]
    Collection {
        /// Which part of the testbed.
        which: &'static str,
        /// Why.
        source: Box<CollectionError>,
    },
    /// A part of the testbed without ground that teaches.
    #[error("{which} drives: {source}")]
    Data {
        /// Which part of the testbed.
        which: &'static str,
        /// What is missing.
        source: DatasetError,
    },
    /// Settings out of range.
    #[error("settings of {method}: {source}")]
    Settings {
        /// Name of the method.
        method: &'static str,
        /// Which setting.
        source: SettingError,
    },
    /// A training failed.
    #[error("{training}: {source}")]
    Training {
        /// Method and seed.
        training: String,
        /// Why.
        source: Box<TrainError>,
    },
    /// Trained networks cannot be used.
    #[error("{training}: {source}")]
    Prediction {
        /// Method and seed.
        training: String,
        /// Why.
        source: Box<PredictorError>,
    },
    /// The caller broke it off.
    #[error("interrupted before all trainings were done")]
    Interrupted,
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
