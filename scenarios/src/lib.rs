//! The truth that the planner never sees: worlds, the physical plant, simulated sensors, tasks and the episode loop.
//! A part of [Surefoot](../cli/index.html).
//!
//! Of `bicycle` this crate uses descriptions and the drive log, never the dynamics: the model never grades itself.
//!
//! A [`World`] is ground with heights and materials, made by [`rock_field`], [`arena`], [`world_from_layers`],
//! [`Landscape::new`], [`painted_world`] (with its picture from above) or [`World::from_fn`]; a [`Plant`] is a machine
//! on it, a [`Deviation`] what is wrong with that machine; an [`Episode`]
//! puts both together with sensors and rules and asks for a decision every cycle; [`Walker`]s are people who cross its
//! way. `examples/own_world.rs` drives in a
//! world of one's own.

mod arena;
mod deviation;
mod episode;
mod friction;
mod landscape;
mod layers;
mod motion;
mod painted;
mod pair;
mod plant;
pub mod published_tyre;
mod random;
mod rock_field;
mod sealed;
mod sensor_imu;
mod sensor_odometry;
mod sensor_range;
mod skyline;
mod task;
mod truth;
mod walker;
mod waves;
mod world;

pub use arena::{
    ARENA_GOAL_M, ARENA_SIZE_M, ARENA_START, ArenaConfig, ArenaError, ArenaPart, ArenaWay, arena,
    arena_floor, arena_parts, arena_way,
};
pub use deviation::{Deviation, DeviationError};
pub use episode::{
    Episode, EpisodeConfig, EpisodeError, Fault, Observation, Outcome, Rules, SensorFault, Strike, TraceRow,
    drive_log,
};
pub use friction::Stribeck;
pub use landscape::{GroundKind, Landscape, LandscapeError, LandscapeKind, RouteTask};
pub use layers::{LayerConfig, LayersError, WorldLayers, world_from_layers};
pub use motion::Motion;
pub use painted::{Looks, PAINTED_GROUNDS, PaintedConfig, PaintedWorld, painted_world};
pub use pair::{End, Pair, PairError, PairWish, check_pair, feasible_pair};
pub use plant::{Collision, CommandError, Engine, Plant, PlantError, WheelState, steady_friction};
pub use random::{seed_of, stream};
pub use rock_field::{
    MAPS_PER_SPLIT, RockFieldConfig, RockFieldError, RockMap, RockPopulation, Split, rock_field,
};
pub use sealed::{
    Amount, DrawnCase, EFFECTS, LOG_HZ, LOG_S, Magnitude, Style, TestDriveError, TestMachine, UNKNOWNS,
    test_drive,
};
pub use sensor_imu::{IMU_PERIOD_NS, Imu, ImuConfig};
pub use sensor_odometry::{OdometryConfig, OdometrySensor};
pub use sensor_range::{RangeSensor, RangeSensorConfig};
pub use task::{BORDER_M, LayersTaskError, ROCK_FIELD_DISTANCE_M, Task};
pub use truth::{Traversability, Truth, TruthField};
pub use walker::{Stride, Walker};
pub use world::{Bounds, Patch, World, WorldError};
