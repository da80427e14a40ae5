//! Why a benchmark did not run.

/// Why a benchmark did not run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Nothing to measure.
    #[error("updates: expected at least 1, found 0")]
    NoUpdates,
    /// The vehicle that the benchmark drives cannot be read.
    #[error(transparent)]
    Vehicle(#[from] formats::ConfigError),
    /// The risk of the map cannot be judged.
    #[error(transparent)]
    Level(#[from] traversability::CvarLevelError),
    /// The risk map cannot be made.
    #[error(transparent)]
    Prior(#[from] physics_prior::PriorMapError),
    /// The networks make no sense.
    #[error(transparent)]
    Checkpoint(#[from] evidential::CheckpointError),
    /// The map of what was learned cannot be made.
    #[error(transparent)]
    Belief(#[from] evidential::BeliefMapError),
    /// The elevation map cannot be made.
    #[error("elevation map: {0}")]
    Elevation(#[from] terrain::SettingError),
    /// The elevation map refused a pose.
    #[error(transparent)]
    Fuse(#[from] terrain::FuseError),
    /// The cost-to-go field cannot be made.
    #[error(transparent)]
    CostToGo(#[from] mppi::CostToGoError),
    /// The controller refused its settings.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
