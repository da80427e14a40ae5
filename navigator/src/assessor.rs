//! The second part of the pipeline: the map of the ground becomes risk and time to the goal.

use bicycle::lanes::Instructions;
use bicycle::{Geometry, MotionLimits};
use mppi::{CostToGo, CostToGoView};
use terrain::{CellRegion, DistantPosition, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMapView};

use crate::areas::Barrier;
use crate::risk::{Belief, RiskLayer, StuckPose};
use crate::{Config, Jump, NavigatorError};

/// Judges the ground and finds the least time over it to the goal.
pub struct Assessor {
    layer: RiskLayer,
    barrier: Barrier,
    recipe: Recipe,
    cost_to_go: CostToGo,
}

/// What the ground is judged with.
struct Recipe {
    geometry: Geometry,
    config: Config,
    belief: Belief,
    level: CvarLevel,
    instructions: Instructions,
}

impl Recipe {
    fn layer(&self) -> Result<RiskLayer, NavigatorError> {
        let Self { geometry, config, belief, level, instructions } = self;
        Ok(RiskLayer::new(belief, *level, geometry, config, *instructions)?)
    }
}

impl Assessor {
    /// An assessor of a surface for a vehicle of such lengths with the settings of `config`, on the instruction set of its
    /// controller; the cost to go keeps to `limits`.
    pub fn new(
        vehicle: &impl AsRef<Geometry>,
        limits: impl Into<MotionLimits>,
        config: &Config,
        belief: &Belief,
        level: CvarLevel,
    ) -> Result<Self, NavigatorError> {
        config.validate()?;
        let window = config.risk_map;
        let instructions = Instructions::find(config.controller.isa).map_err(mppi::ConfigError::from)?;
        let recipe = Recipe {
            geometry: *vehicle.as_ref(),
            config: config.clone(),
            belief: belief.clone(),
            level,
            instructions,
        };
        Ok(Self {
            layer: recipe.layer()?,
            barrier: Barrier::new(config.areas.clone()),
            recipe,
            cost_to_go: CostToGo::new(
                config.cost_to_go,
                limits.into().with_attitude_share(config.attitude_share),
                window.n_rows,
                window.n_cols,
            )?,
        })
    }

    /// Share of the worst outcomes that is planned for.
    pub fn level(&self) -> CvarLevel {
        self.recipe.level
    }

    /// Judges for another share of the worst outcomes from the next update on, which judges the whole window. What driving
    /// has proved stays.
    pub fn judge_at(&mut self, level: CvarLevel) -> Result<(), NavigatorError> {
        if level == self.recipe.level {
            return Ok(());
        }
        self.recipe.level = level;
        let mut layer = self.recipe.layer()?;
        self.layer.stuck().iter().for_each(|pose| layer.note_stuck(*pose));
        self.layer = layer;
        Ok(())
    }

    /// Follows the vehicle and judges anew what changed of the surface. Where the vehicle may not be counts as obstacles.
    pub fn update(
        &mut self,
        position_m: [f64; 2],
        surface: &GridMap<SurfaceCell>,
        changed: &CellRegion,
    ) -> Result<(), NavigatorError> {
        DistantPosition::check(position_m, self.layer.resolution_m())?;
        Ok(self.layer.update(position_m, self.barrier.bar(surface), changed)?)
    }

    /// What the ground is judged to be, before [`Assessor::amend`]; `None` until the first update.
    pub fn known(&self) -> Option<RiskMapView<'_>> {
        self.layer.known()
    }

    /// Brings what driving has proved, and who knows better, into risks that were taken from
    /// [`Assessor::known`].
    pub fn amend(&self, risks: &mut [Risk]) {
        self.layer.amend(risks);
    }

    /// The least time over an amended map to the goal.
    pub fn time_to_goal(
        &mut self,
        map: RiskMapView<'_>,
        goal_m: [f64; 2],
    ) -> Result<CostToGoView<'_>, NavigatorError> {
        self.cost_to_go.update(map, goal_m)?;
        Ok(self.cost_to_go.view())
    }

    /// The times of the last [`Assessor::time_to_goal`].
    pub fn last_time_to_goal(&self) -> CostToGoView<'_> {
        self.cost_to_go.view()
    }

    /// Remembers a pose that proved impassable; of very many, the oldest is forgotten.
    pub fn note_stuck(&mut self, pose: StuckPose) {
        self.layer.note_stuck(pose);
    }

    /// The poses that are remembered, the oldest first.
    pub fn stuck(&self) -> &[StuckPose] {
        self.layer.stuck()
    }

    /// The localisation jumped, and what is remembered in its frame moves along.
    pub fn follow_jump(&mut self, jump: &Jump) {
        self.layer.follow_jump(jump);
    }
}
