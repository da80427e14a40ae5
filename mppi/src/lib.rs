//! Model predictive path integral control over a risk map: sampled futures of the vehicle's model, priced in seconds,
//! averaged into a plan; and the cost-to-go field that tells the futures what lies beyond their horizon. A part of
//! [Surefoot](../cli/index.html).
//!
//! A [`Controller`] takes an [`Input`] every cycle, state, risk map and [`Objective`], and gives a decision. It
//! allocates nothing after its first cycle, and the decision is a function of the inputs, the [`Config`] and the seed,
//! bit for bit, for any number of threads. The vehicle's model is a type, [`bicycle::Model`] unless another is given;
//! costs of one's own plug in as [`StepCost`] and [`RolloutCost`], [`MovingDiscs`] is one of what moves; settings may change between decisions, see
//! [`Controller::set_config`]. [`CostToGo`] finds the least time to the goal over the same map.
//! `examples/drive_constant_map.rs` drives a whole way, `examples/own_costs.rs` with costs of its own.
//!
//! ```
//! use bicycle::{Decision, Limits, Model, State};
//! use mppi::{Config, Controller, Input, Objective, Terminal};
//! use traversability::{GridGeometry, Risk, RiskMap};
//!
//! let limits = Limits {
//!     speed_max_mps: 2.0,
//!     reverse_speed_max_mps: 1.0,
//!     steering_max_rad: 0.5,
//!     steering_rate_max_radps: 1.0,
//!     acceleration_max_mps2: 2.0,
//!     lateral_acceleration_max_mps2: 4.0,
//!     roll_max_rad: 0.5,
//!     pitch_max_rad: 0.5,
//! };
//! let model = Model { wheelbase_m: 1.0, limits, effects: Vec::new() };
//! let mut controller = Controller::new(Config::default(), model, 1)?;
//! let map = RiskMap::constant(GridGeometry::centred(0.2, 100, 100, 0.0, 0.0), 8, Risk::NONE);
//! let objective =
//!     Objective::Goal { goal_m: [8.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
//! let decision = controller.decide(&Input {
//!     state: State::default(),
//!     elapsed_s: 0.0,
//!     map: map.view(),
//!     objective,
//!     cycle: 0,
//! });
//! assert!(matches!(decision, Decision::Drive(command) if command.speed_mps > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chunk;
mod config;
mod controller;
mod cost;
mod cost_to_go;
mod diagnostics;
mod discs;
mod driven;
mod judgement;
mod kernel;
mod lag;
mod ledger;
mod objective;
mod plan;
mod ranking;
mod recovery;
mod replay;
mod rollout;
mod sampling;
mod summary;
mod trace;
mod weights;

pub use bicycle::lanes::Isa;
pub use config::{Actuation, Config, ConfigError, Costs, Recovery, SampleSpace, Sampling, Temperature};
pub use controller::{Controller, Phase};
pub use cost::{Future, Place, RolloutCost, Step, StepCost};
pub use cost_to_go::{CostToGo, CostToGoConfig, CostToGoError, CostToGoView, N_HEADINGS, Neighbourhood};
pub use diagnostics::{CostTerm, Diagnostics};
pub use discs::{Disc, DiscPrices, MovingDiscs, Outline};
pub use driven::Driven;
pub use objective::{Input, Objective, ReferencePath, Terminal};
pub use replay::Rollout;
pub use trace::{Trace, TracedStep};
