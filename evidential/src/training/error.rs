//! Why a training fails.

use terrain::SettingError;

use super::Phase;
use crate::{CheckpointError, DatasetError};

/// Why nothing was trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// A setting out of range.
    #[error("settings: {0}")]
    Settings(#[from] SettingError),
    /// Data that nothing can be learnt from.
    #[error("{which} data: {problem}")]
    Data {
        /// Training or validation.
        which: &'static str,
        /// What is wrong.
        problem: DatasetError,
    },
    /// Every parameter has one value throughout.
    #[error(
        "training data: expected measurements in at least two bins of some parameter, found one bin each in {n} examples"
    )]
    OneClass {
        /// Number of examples.
        n: usize,
    },
    /// Training and validation data do not belong together.
    #[error("validation data, {what}: expected that of the training data, {expected}, found {found}")]
    Mismatch {
        /// What differs.
        what: &'static str,
        /// Of the training data.
        expected: String,
        /// Of the validation data.
        found: String,
    },
    /// The loss became infinite or no number.
    #[error(
        "{phase}, epoch {epoch}, step {step}: expected a finite loss, found {found}; a smaller learning rate may help"
    )]
    NonFiniteLoss {
        /// What was trained.
        phase: Phase,
        /// From 1.
        epoch: usize,
        /// From 1.
        step: usize,
        /// The loss.
        found: f64,
    },
    /// The arithmetic library refused.
    #[error(transparent)]
    Arithmetic(#[from] candle_core::Error),
    /// The result cannot be kept.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
}
