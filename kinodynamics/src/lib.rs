//! Inverse kinodynamics: which command makes the vehicle do what is wanted on the ground that its inertial measurement unit
//! feels. A part of [Surefoot](../cli/index.html).
//!
//! After Xiao, Biswas and Stone, Learning Inverse Kinodynamics for Accurate High-Speed Off-Road Navigation on Unstructured
//! Terrain (RA-L 2021), and its published code where the two differ: half a second of the unit at 200 Hz becomes an
//! embedding, which with the desired speed and curvature becomes the curvature to command ([`Architecture`]).
//!
//! A [`Recording`] is a drive with random commands. [`label`] turns it into examples, [`train`] fits a model and leaves a
//! [`Checkpoint`]. In the control process an [`InverseModel`] answers from flat weights, without Candle and without
//! allocation; a [`Corrector`] stands between planner and vehicle, keeps the [`ImuHistory`], bounds what the model may change
//! and fades it out where the unit is silent or the moment unlike the training. [`Adaptation`] learns inside the controller's
//! own model instead, from odometry alone. `examples/learn_understeer.rs` trains a
//! model and asks it.

mod adaptation;
mod agreement;
mod architecture;
mod checkpoint;
mod correction;
mod dense;
mod familiarity;
mod history;
mod label;
mod latency;
mod model;
mod recording;
mod split;
mod training;

pub use adaptation::Adaptation;
pub use architecture::{AXES, Answer, Architecture, CURVATURE_MAX_PER_M, SPEED_MAX_MPS, Sensing, WINDOW};
pub use checkpoint::{Checkpoint, Sidecar, Standardisation};
pub use correction::{Corrected, CorrectionConfig, CorrectionCounts, Corrector, Effect, Reason, Uncorrected};
pub use evidential::{CheckpointError, Tensor};
pub use familiarity::Fade;
pub use history::{ImuCounts, ImuFault, ImuHistory, ImuRange, PERIOD_NS};
pub use label::{EffectPart, Example, LabelConfig, LabelCounts, SpeedSource, label};
pub use latency::{Latency, LatencyError, estimate_latency};
pub use model::{Commanded, Desired, InverseModel};
pub use recording::{
    ImuCheckError, RecordedRun, Recording, RecordingFileError, Tick, VehicleSummary, check_imu,
};
pub use split::{Split, block_split};
pub use training::{Epoch, History, Outcome, Settings, Teacher, TrainError, train, train_without_history};
