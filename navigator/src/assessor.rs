//! The second part of the pipeline: the map of the ground becomes risk and time to the goal.

use std::sync::Arc;

use bicycle::lanes::Instructions;
use bicycle::{Geometry, MotionLimits};
use mppi::{CostToGo, CostToGoView};
use terrain::{DistantPosition, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMapView, SpeedLaw};

use crate::areas::Barrier;
use crate::frame::Frame;
use crate::friction::KnownFriction;
use crate::risk::{Belief, RiskLayer};
use crate::{
    Config, Destination, Jump, MessageId, MissionMessage, NavigatorError, RiskHeader, StuckMessage,
    SurfaceHeader,
};

/// Judges the ground and finds the least time over it to the goal. Only what has changed since the map of the ground
/// before is judged anew.
pub struct Assessor {
    layer: RiskLayer,
    barrier: Barrier,
    friction: KnownFriction,
    speed_law: Option<SpeedLaw>,
    recipe: Recipe,
    cost_to_go: CostToGo,
    /// What the map of the ground that was judged last said of itself.
    judged: Option<SurfaceHeader>,
    /// Life of the surveyor and all jumps that it has told of.
    shift: (u64, Jump),
    frame: Frame,
    /// When the odometry was measured in whose frame the newest map lies that was told of [ns].
    frame_at_ns: u64,
    stuck: MessageId,
    destination: Option<Destination>,
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
        let limits = limits.into().with_attitude_share(config.attitude_share);
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
            friction: KnownFriction { by_class: config.friction.unwrap_or_default(), by_place: None },
            speed_law: config.speed.law(&limits, config.controller.step_s),
            recipe,
            cost_to_go: CostToGo::new(config.cost_to_go, limits, window.n_rows, window.n_cols)?,
            judged: None,
            shift: (0, Jump::NONE),
            frame: Frame::default(),
            frame_at_ns: 0,
            stuck: MessageId::default(),
            destination: None,
        })
    }

    /// What is known of the ground's friction by place counts from now on before what is known by class: values in the map
    /// frame, not finite where nobody knows [-].
    pub fn know_friction(&mut self, map: Arc<GridMap<f32>>) {
        self.friction.by_place = Some(map);
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
        self.layer.stuck().iter().for_each(|(at_ns, pose)| layer.note_stuck(*pose, *at_ns));
        self.layer = layer;
        Ok(())
    }

    /// Judges as `other` does from now on, the next map as a whole. What driving has proved stays, and so does the share of
    /// outcomes.
    pub fn judge_like(&mut self, mut other: Self) -> Result<(), NavigatorError> {
        other.judge_at(self.level())?;
        self.layer.stuck().iter().for_each(|(at_ns, pose)| other.layer.note_stuck(*pose, *at_ns));
        other.friction.by_place = self.friction.by_place.take();
        (self.layer, self.barrier, self.recipe) = (other.layer, other.barrier, other.recipe);
        (self.friction, self.speed_law) = (other.friction, other.speed_law);
        Ok(())
    }

    /// Follows what was said of where to go, and for which share of outcomes to plan.
    pub fn hear_mission(&mut self, mission: &MissionMessage) -> Result<(), NavigatorError> {
        self.destination = mission.destination.or(self.destination);
        mission.level.map_or(Ok(()), |level| self.judge_at(level))
    }

    /// Where the times to the goal shall lead from now on.
    pub fn set_destination(&mut self, destination: Destination) {
        self.destination = Some(destination);
    }

    /// Whether it has been said where to: before, no map of the ground is worth judging.
    pub fn has_goal(&self) -> bool {
        self.destination.is_some()
    }

    /// Remembers a pose that proved impassable, where it lies in the frame of the newest map that was told of; of very
    /// many, the oldest is forgotten. One from a later frame moves with the jumps that come after it.
    pub fn hear_stuck(&mut self, stuck: &StuckMessage) {
        self.stuck = stuck.id;
        let StuckMessage { valid_at_ns, pose, .. } = *stuck;
        let late = Some(valid_at_ns).filter(|at_ns| *at_ns < self.frame_at_ns);
        let moved = late.and_then(|at_ns| self.frame.shift(at_ns, self.frame_at_ns));
        self.layer.note_stuck(moved.map_or(pose, |jump| pose.moved(&jump)), valid_at_ns);
    }

    /// Looks at what a map of the ground says of itself, in the order in which they were sent, whether or not it is judged:
    /// poses that proved stuck move with the localisation. A surveyor that began anew has forgotten the frame of before.
    pub fn hear_surface(&mut self, header: &SurfaceHeader) {
        let (epoch_ns, last) = self.shift;
        if epoch_ns != header.id.epoch_ns {
            self.frame.forget();
        } else if header.shift != last {
            let jump = last.inverse().then(&header.shift);
            self.frame.note(header.frame_at_ns, &jump);
            self.layer.follow_jump(&jump, header.frame_at_ns);
        }
        self.shift = (header.id.epoch_ns, header.shift);
        self.frame_at_ns = header.frame_at_ns;
    }

    /// Judges a map of the ground, of which what has changed since the last one is judged anew. Where the vehicle may not be
    /// counts as obstacles.
    pub fn judge(
        &mut self,
        header: &SurfaceHeader,
        surface: &GridMap<SurfaceCell>,
    ) -> Result<(), NavigatorError> {
        self.hear_surface(header);
        let [x_m, y_m, _] = header.odometry.position_m;
        DistantPosition::check([x_m, y_m], self.layer.resolution_m())?;
        self.layer.update([x_m, y_m], self.barrier.bar(surface))?;
        if !self.friction.is_empty() {
            self.layer.fill_friction(&self.friction);
        }
        if let Some(law) = &self.speed_law {
            self.layer.fill_speeds(law);
        }
        self.judged = Some(*header);
        Ok(())
    }

    /// What the ground is judged to be, before [`Assessor::correct`]; `None` until it was judged.
    pub fn known(&self) -> Option<RiskMapView<'_>> {
        self.layer.known()
    }

    /// Brings what driving has proved, and who knows better, into risks that were taken from
    /// [`Assessor::known`].
    pub fn correct(&self, risks: &mut [Risk]) {
        self.layer.correct(risks);
    }

    /// Finds the least time over the corrected map to the goal, and says what that map is, but for its name; `None` before
    /// the ground was judged or without a goal.
    pub fn finish(&mut self, corrected: RiskMapView<'_>) -> Result<Option<RiskHeader>, NavigatorError> {
        let Some((judged, destination)) = self.judged.zip(self.destination) else { return Ok(None) };
        self.cost_to_go.update(corrected, destination.goal_m, destination.tolerance_m)?;
        Ok(Some(RiskHeader {
            id: MessageId::default(),
            valid_at_ns: judged.valid_at_ns,
            surface: judged.id,
            frame_at_ns: judged.frame_at_ns,
            stuck: self.stuck,
            destination,
        }))
    }

    /// Headings for which its times tell what turning adds.
    pub fn n_headings(&self) -> usize {
        self.cost_to_go.n_headings()
    }

    /// The times of the last [`Assessor::finish`].
    pub fn time_to_goal(&self) -> CostToGoView<'_> {
        self.cost_to_go.view()
    }
}

#[cfg(test)]
mod tests;
