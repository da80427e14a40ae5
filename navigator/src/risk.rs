//! The risk map that the controller drives on, from whatever is believed of the ground.

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use evidential::{BeliefMapError, Checkpoint, Learned, Unfamiliar};
use physics_prior::Assumption;
use rayon::prelude::*;
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMapView, SpeedLaw, SpeedLimit};

use crate::Jump;
use crate::friction::KnownFriction;
use crate::risk_estimator::RiskEstimator;

/// Fills a window, shape [row, col, yaw], with the risk of the poses of the body frame that a [`RiskMap`] of this
/// geometry and number of yaws stands for.
pub type RiskOracle = Arc<dyn Fn(&GridGeometry, usize, &mut [Risk]) + Send + Sync>;

/// What is believed of the ground.
#[derive(Clone)]
pub enum Belief {
    /// The physics prior.
    Physics,
    /// What was learned from driving, fused with the prior that it was trained with.
    Learned {
        /// Networks that were trained on this vehicle.
        checkpoint: Arc<Checkpoint>,
        /// What becomes of ground that is unlike the training data.
        unfamiliar: Unfamiliar,
    },
    /// No slip, full traction, level everywhere.
    Nominal,
    /// What somebody who knows says; obstacles still come from the map.
    Given(RiskOracle),
}

/// Where the vehicle got stuck, heading this way: proof that the map promised too much there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckPose {
    /// Where the rear axle's centre was [m].
    pub position_m: [f64; 2],
    /// Where it was heading [rad].
    pub yaw_rad: f64,
}

impl StuckPose {
    /// Where it lies after a jump of the localisation.
    pub fn moved(&self, jump: &Jump) -> Self {
        let [x_m, y_m] = self.position_m;
        let [x_m, y_m, yaw_rad] = jump.pose([x_m, y_m, self.yaw_rad]);
        Self { position_m: [x_m, y_m], yaw_rad }
    }
}

/// Poses around a [`StuckPose`] that count as blocked, over the vehicle's length: how far around a point ahead of it.
const STUCK_AHEAD: f64 = 0.2;
const STUCK_RADIUS: f64 = 0.25;
/// Stuck poses that are remembered.
const STUCK_MAX: usize = 32;
/// Headings within this of the one that got stuck count as blocked [rad].
const STUCK_YAW_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// A risk map and what it is made with.
pub(crate) struct RiskLayer {
    estimator: RiskEstimator,
    /// Who knows, and the answer for the present window.
    oracle: Option<(RiskOracle, Vec<Risk>)>,
    /// With the time of the odometry in whose frame each was told [ns].
    stuck: Vec<(u64, StuckPose)>,
    length_m: f64,
    recentre_cells: i64,
    is_filled: bool,
    /// Memory for the limits of a map.
    speeds_mps: Vec<f32>,
}

impl RiskLayer {
    pub fn new(
        belief: &Belief,
        level: CvarLevel,
        geometry: &Geometry,
        config: &crate::Config,
        instructions: Instructions,
    ) -> Result<Self, BeliefMapError> {
        let prior = &config.prior;
        let window = &config.risk_map;
        let resolution_m = config.risk_resolution_m();
        let grid = GridGeometry::centred(resolution_m, window.n_rows, window.n_cols, 0.0, 0.0);
        let surface_m = config.elevation.resolution_m;
        let by_prior = |assumption: Assumption| {
            RiskEstimator::prior(geometry, &assumption, surface_m, grid, window.n_yaws, instructions)
        };
        let estimator = match belief {
            Belief::Physics => by_prior(Assumption::Physics { prior: *prior, level })?,
            Belief::Learned { checkpoint, unfamiliar } => {
                let learned = Learned {
                    checkpoint: Arc::clone(checkpoint),
                    unfamiliar: *unfamiliar,
                    obstacle_margin_m: prior.obstacle_margin_m,
                    level,
                };
                RiskEstimator::networks(geometry, &learned, surface_m, grid, window.n_yaws, instructions)?
            }
            Belief::Nominal | Belief::Given(_) => {
                by_prior(Assumption::Nominal { obstacle_margin_m: prior.obstacle_margin_m })?
            }
        };
        let oracle = match belief {
            Belief::Given(oracle) => {
                Some((Arc::clone(oracle), vec![Risk::OUTSIDE; grid.n_cells() * window.n_yaws]))
            }
            Belief::Physics | Belief::Learned { .. } | Belief::Nominal => None,
        };
        Ok(Self {
            estimator,
            oracle,
            stuck: Vec::with_capacity(STUCK_MAX),
            length_m: geometry.length_m,
            recentre_cells: (window.recentre_m / resolution_m).ceil() as i64,
            is_filled: false,
            speeds_mps: Vec::new(),
        })
    }

    /// Edge of a cell [m].
    pub fn resolution_m(&self) -> f64 {
        self.estimator.risk_map().geometry().resolution_m
    }

    /// What the estimator says, once there was an update.
    pub fn known(&self) -> Option<RiskMapView<'_>> {
        self.is_filled.then(|| self.estimator.risk_map().view())
    }

    /// Takes who knows better, and the poses that proved stuck, into risks that were taken from the estimator.
    pub fn correct(&self, risks: &mut [Risk]) {
        if let Some((_, answer)) = &self.oracle {
            take_over_answer(answer, risks);
        }
        let known = self.estimator.risk_map().view();
        for (_, pose) in &self.stuck {
            block(risks, &known, pose, self.length_m);
        }
    }

    /// Remembers a pose that proved impassable, in the frame of this time; of very many, the oldest is forgotten.
    pub fn note_stuck(&mut self, pose: StuckPose, at_ns: u64) {
        if self.stuck.len() == STUCK_MAX {
            self.stuck.remove(0);
        }
        self.stuck.push((at_ns, pose));
    }

    /// The poses that are remembered, the oldest first.
    pub fn stuck(&self) -> &[(u64, StuckPose)] {
        &self.stuck
    }

    /// The localisation jumped, as odometry of this time showed: what is remembered of before moves along.
    pub fn follow_jump(&mut self, jump: &Jump, jumped_at_ns: u64) {
        for (at_ns, pose) in self.stuck.iter_mut().filter(|(at_ns, _)| *at_ns < jumped_at_ns) {
            (*at_ns, *pose) = (jumped_at_ns, pose.moved(jump));
        }
    }

    /// Follows the vehicle and takes over what changed of the surface.
    pub fn update(
        &mut self,
        position_m: [f64; 2],
        surface: &GridMap<SurfaceCell>,
    ) -> Result<(), BeliefMapError> {
        let is_moved = self.follow(position_m);
        self.estimator.update(surface)?;
        if let Some((oracle, answer)) = self.oracle.as_mut().filter(|_| is_moved) {
            let known = self.estimator.risk_map().view();
            oracle(&known.geometry, known.n_yaws, answer);
        }
        self.is_filled = true;
        Ok(())
    }

    /// Says of every cell how much it is known to hold.
    pub fn fill_friction(&mut self, known: &KnownFriction) {
        let geometry = *self.estimator.risk_map().geometry();
        for (index, ground) in self.estimator.ground_mut().iter_mut().enumerate() {
            ground.friction = known.limit(geometry.centre_m(geometry.cell(index)), ground);
        }
    }

    /// Says of every cell how fast it may be driven over, by whoever knows best.
    pub fn fill_speeds(&mut self, law: &SpeedLaw) {
        let known = self.estimator.risk_map().view();
        let risks = self.oracle.as_ref().map_or(known.risks, |(_, answer)| answer);
        law.limits(&known, risks, &mut self.speeds_mps);
        for (ground, limit_mps) in self.estimator.ground_mut().iter_mut().zip(&self.speeds_mps) {
            ground.speed = SpeedLimit::new(*limit_mps);
        }
    }

    /// Returns whether the window moved.
    fn follow(&mut self, position_m: [f64; 2]) -> bool {
        let now = *self.estimator.risk_map().geometry();
        let [x_m, y_m] = position_m;
        let wanted = GridGeometry::centred(now.resolution_m, now.n_rows, now.n_cols, x_m, y_m);
        let is_far = |axis: usize| (wanted.origin[axis] - now.origin[axis]).abs() >= self.recentre_cells;
        let moves = !self.is_filled || is_far(0) || is_far(1);
        if moves {
            self.estimator.place_at(wanted.origin);
        }
        moves
    }
}

/// Blocks the poses in and just ahead of one that proved stuck, in headings close to its own: another way past the
/// same place stays open, and so does the way back.
fn block(risks: &mut [Risk], view: &RiskMapView<'_>, stuck: &StuckPose, length_m: f64) {
    let (geometry, n_yaws) = (view.geometry, view.n_yaws);
    let turned = |bin: usize| {
        let turn = (view.yaw_rad(bin) - stuck.yaw_rad).rem_euclid(TAU);
        turn.min(TAU - turn)
    };
    let bins: Vec<usize> = (0..n_yaws).filter(|&bin| turned(bin) <= STUCK_YAW_RAD).collect();
    let ahead_m = STUCK_AHEAD * length_m;
    let (sine, cosine) = libm::sincos(stuck.yaw_rad);
    let centre_m = [stuck.position_m[0] + ahead_m * cosine, stuck.position_m[1] + ahead_m * sine];
    let radius_m = STUCK_RADIUS * length_m;
    for index in 0..geometry.n_cells() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let (dx_m, dy_m) = (x_m - centre_m[0], y_m - centre_m[1]);
        if dx_m * dx_m + dy_m * dy_m <= radius_m * radius_m {
            for bin in &bins {
                let risk = &mut risks[index * n_yaws + bin];
                // The border stays what it is.
                if *risk != Risk::OUTSIDE {
                    *risk = risk.blocked();
                }
            }
        }
    }
}

/// Takes over the answer wherever the map knows of neither obstacle nor border.
fn take_over_answer(answer: &[Risk], risks: &mut [Risk]) {
    risks.par_chunks_mut(4096).zip(answer.par_chunks(4096)).for_each(|(risks, answer)| {
        for (risk, answer) in risks.iter_mut().zip(answer).filter(|(risk, _)| **risk == Risk::NONE) {
            *risk = *answer;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use traversability::RiskMap;

    #[test]
    fn a_stuck_pose_blocks_what_lies_ahead_in_its_heading_and_leaves_the_way_back() {
        let grid = GridGeometry::centred(0.25, 41, 41, 0.0, 0.0);
        let mut map = RiskMap::constant(grid, 16, Risk::NONE);
        let known = map.clone();
        let pose = StuckPose { position_m: [0.0, 0.0], yaw_rad: 0.2 };
        map.fill(|risks, _| block(risks, &known.view(), &pose, 3.4));
        let view = map.view();
        assert!(view.risk_at(0.0, 0.0, 0.2).is_blocked() && view.risk_at(1.2, 0.2, 0.2).is_blocked());
        assert!(!view.risk_at(0.0, 0.0, 0.2 + std::f64::consts::PI).is_blocked(), "turned around");
        assert!(!view.risk_at(-1.5, -0.3, 0.2).is_blocked(), "backed up");
        assert!(!view.risk_at(0.0, 2.0, 0.2).is_blocked(), "passing beside it");
    }
}
