//! Why simulator and robot disagree: where the gap lies, which unmodelled effect causes it, how far it shrinks. A part
//! of [Surefoot](../cli/index.html).
//!
//! 1. [`screen`] says which stretches of drives cannot be right.
//! 2. [`Baseline::calibrate`] fits the kinematic bicycle to drives of the simulator and learns what one of these looks
//!    like to a model of the others.
//! 3. [`diagnose`] weighs every effect of the catalogue, and pairs of them, against the robot's drives; where there is
//!    no simulator, [`diagnose_without_simulator`].
//! 4. [`verify`] opens the drives that were held out and says how far the gap shrinks; an [`Answer`] keeps it all.
//! 5. [`judge_in_simulator`] lets the user's own simulator decide what was screened, and about its own parameters.
//! 6. [`design_manoeuvre`] asks for the drive that would tell apart what is left open.
//! 7. [`judge_ground`] holds a belief about the ground against what drives met there.
//!
//! Drives are `bicycle::DriveLog`s. The crate never sees the plant that made them. `examples/diagnose_a_delay.rs` goes
//! through steps 2 to 4.

mod answer;
mod attitude;
mod baseline;
mod calibration;
mod causes;
mod comparison;
mod conditions;
mod constancy;
mod controller_model;
mod cross_validation;
mod diagnosis;
mod drive;
mod drives;
mod evidence;
mod explanation;
mod familiarity;
mod findings;
mod follow_up;
mod ground;
mod ground_belief;
mod in_simulator;
mod intervals;
mod judgement;
mod learned_bound;
mod least_squares;
mod left_over;
mod limits_shown;
mod machine;
mod manoeuvre;
mod nuisance;
mod parts;
mod periodic;
mod pose_sensor;
mod repair;
mod residual_table;
mod rollout;
mod score_test;
mod screening;
mod signals;
mod signature;
mod smoothing;
mod steering;
mod unseen;
mod verification;
mod whitening;
mod without_simulator;

#[cfg(test)]
mod engine_tests;

pub use answer::{
    Answer, BeforeAfter, Condition, Division, Estimate, NamedEffect, PartEstimate, Place, Ranked,
    SCHEMA_VERSION, Shrink, Support, Verdict,
};
pub use baseline::{Baseline, GapError};
pub use causes::composed;
pub use controller_model::{ControllerModel, controller_model};
pub use diagnosis::{Diagnosis, diagnose};
pub use drive::DriveError;
pub use drives::{Case, Drives, DrivesError};
pub use findings::{
    ConditionBin, ConditionTable, Findings, GroundResidual, Leaning, LeftBin, LeftOver, Prediction,
    PredictionModel, QuantityError, ResidualCell, ResidualState, Spectrum, Swing, SwingOver,
};
pub use follow_up::Diagnosed;
pub use ground_belief::{
    BlockMean, Calibration, GROUND_SCHEMA_VERSION, GroundBeliefError, GroundCause, GroundChange,
    GroundCondition, GroundReport, HeightErrors, LayerErrors, N_PIT, PARAMETERS, Parting, PlaceBin,
    PlaceTable, RankedGroundCause, judge_ground,
};
pub use in_simulator::{
    CauseKind, InSimulator, InSimulatorDiagnosis, InSimulatorError, Knob, KnobError, Motion, RunMemory,
    RunSimulator, SimulatorCandidate, SimulatorCause, SimulatorDescription, SimulatorRun, StartState,
    decide_in_simulator, judge_in_simulator, own_runs,
};
pub use learned_bound::{LearnedBound, LearnedBoundError, learned_bound};
pub use machine::{GroundMap, Machine, SensorNoise};
pub use manoeuvre::{Manoeuvre, design_manoeuvre};
pub use pose_sensor::{PoseSensor, PoseSensorError, PoseUnknown};
pub use repair::{PartUnknown, RepairError, repaired};
pub use screening::{Gravity, Hole, Place as RowPlace, Suspicion, screen, screen_sets, split_at_breaks};
pub use signature::{Signature, signature};
pub use steering::Steering;
pub use unseen::unseen_effects;
pub use verification::{Verification, verify};
pub use without_simulator::{WithoutSimulator, diagnose_without_simulator};
