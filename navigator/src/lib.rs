//! The pipeline as one pure object: observation to map to risk map to decision. No clock, no file, no process.
//! A part of [Surefoot](../cli/index.html).
//!
//! It has parts, which a robot may run in processes of their own and which take and return stamped messages: [`Leader`]
//! makes orders into what is to be done, [`Surveyor`] maps the ground, [`Assessor`] turns the map into risk and time to the
//! goal, [`Pilot`] decides. Every rule is one of theirs; whoever carries the messages has none. [`Navigator`] carries them
//! in queues, for a closed loop: [`Navigator::observe`] takes in what was measured and keeps the maps,
//! [`Navigator::decide`] asks the controller.
//!
//! [`Config::for_vehicle`] fits all settings to a machine, a [`Belief`] says how the ground is judged, a [`Guard`] what
//! may enter. `examples/own_surface.rs` drives the three on a map of one's own.

mod areas;
mod assessor;
mod choice;
mod config;
mod correction;
mod frame;
mod friction;
mod guard;
mod input_ledger;
mod jump;
mod leader;
mod message;
mod mission;
mod moving;
mod navigator;
mod pilot;
mod risk;
mod risk_estimator;
mod route;
mod speed;
mod surveyor;
mod track;

pub use areas::Areas;
pub use assessor::Assessor;
pub use choice::{StandIn, is_learned};
pub use config::{Config, RiskMapConfig};
pub use friction::FrictionConfig;
pub use guard::{Admitted, Guard, GuardConfig};
pub use jump::Jump;
pub use leader::Leader;
pub use message::{
    Activity, Correction, DecisionMessage, MessageId, MissionMessage, OdometryMessage, PathWindow,
    RiskHeader, RiskMapSource, RiskMessage, RiskMessages, ScanMessage, StuckMessage, SurfaceHeader,
    TIMELESS_NS, TracksMessage,
};
pub use mission::{Instruction, Mission, Order, OrderRefusal, Said, Stage, Target};
pub use moving::MovingConfig;
pub use navigator::{Navigator, NavigatorError, Setup, Surface};
pub use pilot::{Destination, Pilot, PilotAges};
pub use risk::{Belief, RiskOracle, StuckPose};
pub use risk_estimator::RiskEstimator;
pub use route::{CORNERS_MAX, Route, RouteError};
pub use speed::SpeedConfig;
pub use surveyor::{ScanTally, Surveyor, assumed_ground};
pub use track::Whereabouts;
