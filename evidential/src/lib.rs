//! What driving teaches about the ground, and how far that may be trusted; a part of [Surefoot](../cli/index.html).
//!
//! # The flow
//!
//! 1. A drive log becomes measured traversability: what the vehicle did over what was asked of it, and where that means
//!    nothing.
//! 2. [`FeatureLayout`] turns the ground around a pose into numbers; with labels and the physics prior they make a
//!    [`Dataset`].
//! 3. Training fits the networks of a [`Method`] to it (PIETRA, equations 9 to 14) and leaves a [`Checkpoint`].
//! 4. A predictor is the checkpoint made ready for the control computer: the same arithmetic without autograd.
//! 5. A belief map lays it over a whole surface, fuses it with the physics prior by evidence (equation 11) and keeps
//!    the CVaR of the posterior as a risk map.
//!
//! [`shipped`] gives the networks that come with the program, [`train`] makes others, a [`BeliefMap`] judges a surface
//! by them. `examples/learned_weight.rs` shows what they count on ground that they know and on ground that they do not.

mod architecture;
mod belief_map;
mod checkpoint;
mod dataset;
pub mod dirichlet;
mod encounters;
mod features;
mod flow;
mod label;
mod loss;
mod method;
mod network;
mod predictor;
mod random;
mod shipped;
mod standardise;
mod sweep;
mod training;
mod vehicle;
pub mod weights;

pub use architecture::Architecture;
pub use belief_map::{AVOIDED_METRES, BeliefMap, BeliefMapError, Learned, PoseBelief, Unfamiliar};
pub use checkpoint::{Checkpoint, DensityRange, Sidecar};
pub use dataset::{
    Dataset, DatasetError, DatasetFileError, DatasetOrigin, Example, PARAMETER_BINS, PARAMETER_NAMES,
    Surveyor, SurveyorError,
};
pub use encounters::{EncounterError, Foretelling, MapAt, encounters, maps_of_runs};
pub use features::{FeatureLayout, Standardisation};
pub use flow::{FlowScratch, LogDensity, RadialFlow};
pub use label::{Label, LabelConfig, LabelError, Response, Responses, Reversing, estimate_responses, labels};
pub use method::{Method, Prior};
pub use predictor::{Evidence, Prediction, Predictor, PredictorError};
pub use shipped::{ShippedData, ShippedError, shipped, shipped_data};
pub use sweep::{Grid, Selection, SelectionError, Selections, Trial, fingerprint};
pub use terrain::SettingError;
pub use training::{
    Assessment, Epoch, Outcome, Percentiles, Phase, Refined, Refinement, Settings, TrainError, TrainingEnd,
    assess, refine, train,
};
pub use vehicle::VehicleMismatch;
pub use weights::{CheckpointError, Tensor, WeightsDigest};
