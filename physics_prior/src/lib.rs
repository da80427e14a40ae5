//! The physics prior: what the shape and the cover of the ground say about traction and attitude before anything was
//! learned (PIETRA, section IV-C), as distributions of one pose and as a risk map. A part of
//! [Surefoot](../cli/index.html).
//!
//! A [`PriorMap`] turns a surface into a risk map and answers for any pose with a [`PriorBelief`]; [`PriorConfig`]
//! holds its constants. A skid-steered machine on level ground has a prior of its own, [`SkidSteerPrior`].
//! `examples/judge_a_ramp.rs` judges a map of one's own for a vehicle of one's own.
//!
//! Readings of the paper, and what goes beyond it:
//! - The slope of equation 15 is the absolute gradient along the heading under each wheel of a level vehicle;
//!   "corresponds to 30 degrees" means the tangent. Loose ground counts as dirt.
//! - A slope works against a turn as often as for it, and a yaw rate is a speed times a curvature: angular traction is
//!   the linear one times `1 - s / s_max` or `1 + s / s_max`, each with probability one half. The paper's `1 - s /
//!   s_max` alone says that nobody can turn on ground on which vehicles do turn.
//! - A slope across the heading takes its tangent t of the friction, to keep the vehicle where it is. Friction is
//!   uncertain: with the probability that it is less than t the vehicle slides down and has no traction at all; else
//!   `sqrt(1 - (t / friction)^2)` is left of the circle of friction to drive and steer with: the slope at which
//!   equation 15 ends shrinks to that share, and so does the angular traction. It is the slope of the contacts: whoever leans
//!   on level ones does not slide.
//! - Equation 15 makes an outcome of each wheel. But wheels go where the body goes, and the friction is one for all of
//!   them: with the probability that it is less than the slopes under the worst wheel ask for, together, nothing moves.
//! - By [`SlopeLaw::Friction`], which `navigator` takes for a vehicle, traction does not end in a straight line at 30 degrees:
//!   what is lost is the slip of the tyres and the way up, until the axle that the slope unloads needs more friction than
//!   there is. By [`SlopeLaw::Linear`], the default, it does: what was learned is fused with it.
//! - Springs let the body lean further than the ground, by a factor that the description of the vehicle gives.
//! - Equation 17 takes the absolute angle; roll from the wheel pairs of each axle, pitch from those of each side.
//! - A wheel stands on the first ground that a ball of its radius touches, not on the height under its centre;
//!   contact heights and gradients are taken there.
//! - A value becomes a distribution by splitting it between the two bins whose values enclose it, so that its
//!   mean is the value and the risk map changes continuously with the ground.
//! - The uniform distribution of equation 18 is replaced, for roll and pitch, by a triangle around the estimate;
//!   the variance of the heights widens both.
//! - A wheel over unknown ground has a low traction of its own, and its pairs an angle anywhere from level to a
//!   moderate lean; a footprint that is mostly unknown counts as unknown under every wheel. The frontier can
//!   therefore be approached, but known ground is preferred.
//! - Ground between the axles that rises above the plane of the contacts by more than the ground clearance takes
//!   the weight off the wheels: the traction estimates fall, to nothing at one and a half times the clearance.

#![allow(
    clippy::needless_range_loop,
    reason = "arithmetic in lanes: one index over several arrays of equal length"
)]

mod ball;
mod belief;
mod block_prior;
mod cell_set;
mod config;
mod ground;
mod ground_changes;
mod lane_ground;
mod lattice;
mod lengths;
mod outcomes;
mod planes;
mod pose;
mod poses;
mod prior_field;
mod prior_map;
mod skid_steer;
mod stencil;
mod tails;
mod tally;
mod triangle;

pub use belief::PriorBelief;
pub use block_prior::{BlockPrior, PoseLine};
pub use cell_set::{ASKED, CellSet, CellSpan, stretches};
pub use config::{PriorConfig, SlopeLaw};
pub use lattice::ResolutionRatio;
pub use planes::{Planes, span};
pub use prior_field::PriorField;
pub use prior_map::{Assumption, PriorMap, PriorMapError};
pub use skid_steer::{
    ANGULAR, COMPENSATION, HIDDEN, LINEAR, Quantiles, SkidSteerBelief, SkidSteerGround, SkidSteerPrior,
};
