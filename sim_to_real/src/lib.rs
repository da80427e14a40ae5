//! Why simulator and robot disagree: where the gap lies, which unmodelled effect causes it, how far it shrinks.

mod answer;
mod findings;
mod machine;
mod screening;

pub use answer::{Answer, BeforeAfter, Condition, Estimate, NamedEffect, Place, Ranked, Shrink, Verdict};
pub use findings::{
    ConditionBin, ConditionTable, Findings, GroundResidual, Prediction, PredictionModel, ResidualCell, ResidualState,
};
pub use machine::{GroundMap, Machine, SensorNoise};
pub use screening::{Gravity, Place as RowPlace, Suspicion, screen, screen_sets, split_at_breaks};
