//! Model predictive path integral control over a risk map: sampled futures of the vehicle's model, priced in seconds,
//! averaged into a plan; and the cost-to-go field that tells the futures what lies beyond their horizon.

mod chunk;
mod config;
mod controller;
mod cost_to_go;
mod diagnostics;
mod history;
mod judgement;
mod kernel;
mod lag;
mod objective;
mod plan;
mod recovery;
mod replay;
mod rollout;
mod sampling;
mod summary;
mod weights;

pub use bicycle::lanes::Isa;
pub use config::{Actuation, Config, ConfigError, Costs, Recovery, SampleSpace, Sampling, Temperature};
pub use controller::{Controller, Phase};
pub use cost_to_go::{CostToGo, CostToGoConfig, CostToGoError, CostToGoView, Neighbourhood};
pub use diagnostics::{CostTerm, Diagnostics};
pub use objective::{Input, Objective, ReferencePath, Terminal};
pub use replay::Rollout;
