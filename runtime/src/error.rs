//! Why a process ends before it was told to.

use bus::channel::ChannelError;

/// Why a process cannot begin or go on. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum RuntimeError {
    /// The channels.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The pipeline.
    #[error(transparent)]
    Navigator(#[from] navigator::NavigatorError),
    /// Learning while driving.
    #[error(transparent)]
    Online(#[from] crate::online::OnlineError),
    /// Periods and limits on ages that contradict each other.
    #[error(transparent)]
    Ages(#[from] crate::ages::AgeLimitError),
    /// The live view.
    #[error("live view: expected to serve on {address}, found: {problem}")]
    Live {
        /// Host and port.
        address: String,
        /// What the system said.
        problem: String,
    },
    /// Networks that were learned cannot be kept.
    #[error(transparent)]
    Checkpoint(#[from] evidential::CheckpointError),
    /// The system refuses a thread.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The recordings of a folder are as large as they may be.
    #[error("{folder}: expected recordings of at most {quota_mb:.1} MB together, found {found_mb:.1} MB")]
    Quota {
        /// Path of the folder.
        folder: String,
        /// What they may be together [MB].
        quota_mb: f64,
        /// What they are [MB].
        found_mb: f64,
    },
    /// The recording.
    #[error(transparent)]
    Record(#[from] formats::RecordError),
}
