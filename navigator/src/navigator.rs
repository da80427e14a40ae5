//! One cycle of the pipeline.

use std::collections::BTreeMap;

use bicycle::{Decision, Geometry, Model, MotionCommand, Odometry, StopReason};
use mppi::{Controller, Driven};
use terrain::{GridGeometry, GridMap, Scan, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMap, RiskMapView};

use crate::{
    Assessor, Belief, Chart, Config, Mission, Order, OrderRefusal, Pilot, Route, RouteError, Said, ScanTally,
    Surveyor, Whereabouts,
};

/// Where the map of the ground comes from.
#[derive(Clone)]
pub enum Surface {
    /// Fused from scans.
    Sensed,
    /// Given whole, at the resolution of the elevation map; scans are ignored.
    Given(GridMap<SurfaceCell>),
}

/// Everything that stays the same during a drive.
pub struct Setup<'a, M = Model> {
    /// The machine's lengths.
    pub geometry: &'a Geometry,
    /// What the controller believes of how it moves, which decides what a command is.
    pub model: M,
    /// Settings.
    pub config: Config,
    /// What is believed of the ground.
    pub belief: Belief,
    /// Where the map of the ground comes from.
    pub surface: Surface,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// Decides the controller's samples.
    pub seed: u64,
    /// Where to go [m].
    pub goal_m: [f64; 2],
    /// Distance that counts as there [m].
    pub tolerance_m: f64,
}

/// Why no pipeline can be built.
#[derive(Debug, thiserror::Error)]
pub enum NavigatorError {
    /// A setting of the pipeline itself is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The elevation map refused its settings.
    #[error(transparent)]
    Elevation(#[from] terrain::ElevationConfigError),
    /// The window of the risk map cannot be placed there.
    #[error(transparent)]
    Distant(#[from] terrain::DistantPosition),
    /// The elevation map refused a pose.
    #[error(transparent)]
    Fuse(#[from] terrain::FuseError),
    /// The risk map cannot be made.
    #[error(transparent)]
    Risk(#[from] evidential::BeliefMapError),
    /// The cost-to-go field cannot be made.
    #[error(transparent)]
    CostToGo(#[from] mppi::CostToGoError),
    /// The controller refused its settings.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
    /// Where to go is nowhere.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// The first goal may not be driven to.
    #[error("goal: {0}")]
    Order(#[from] OrderRefusal),
}

/// The planner: its three parts, one after the other, behind two calls.
pub struct Navigator<M: Driven = Model> {
    surveyor: Surveyor,
    assessor: Assessor,
    pilot: Pilot<M>,
    /// What is believed, less the poses that proved stuck; `None` before the first scan.
    map: Option<RiskMap>,
    /// Time of the odometry in whose frame the map lies [ns].
    map_at_ns: u64,
    /// Whether the localisation has jumped since.
    is_map_behind: bool,
    mission: Mission,
    /// Orders so far.
    n_orders: u64,
    /// The goal that the times of the assessor lead to [m].
    goal_m: [f64; 2],
}

/// Orders are given in the same process: they are of now.
const ORDER_AGE_MAX_NS: u64 = 0;

impl<M: Driven> Navigator<M> {
    /// A pipeline that has seen nothing.
    pub fn new(setup: Setup<'_, M>) -> Result<Self, NavigatorError> {
        let Setup { geometry, model, config, belief, surface, level, seed, goal_m, tolerance_m } = setup;
        let mut mission = Mission::new(ORDER_AGE_MAX_NS).within(config.areas.clone());
        let route = Route::goals(vec![goal_m], tolerance_m)?;
        mission.order(Order::Drive(route), Said { sequence: 1, ..Said::default() }, 0)?;
        Ok(Self {
            surveyor: Surveyor::new(geometry, config.elevation, config.guard, surface)?
                .with_sensors(model.sensors()),
            assessor: Assessor::new(geometry, model.motion_limits(), &config, &belief, level)?,
            pilot: Pilot::new(model, &config, seed)?,
            map: None,
            map_at_ns: 0,
            is_map_behind: false,
            mission,
            n_orders: 1,
            goal_m,
        })
    }

    /// Directs the vehicle otherwise from now on; the first mission is that of [`Setup`].
    ///
    /// # Errors
    /// The ground cannot be judged for that share of outcomes.
    pub fn order(&mut self, order: Order, now_ns: u64) -> Result<Result<(), OrderRefusal>, NavigatorError> {
        self.n_orders += 1;
        let said = Said { at_ns: now_ns, sender_ns: 0, sequence: self.n_orders };
        let taken = self.mission.order(order, said, now_ns);
        self.assessor.judge_at(self.mission.level().unwrap_or(self.assessor.level()))?;
        Ok(taken)
    }

    /// What the vehicle is told to do.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Takes in what was measured; returns whether the risk map was renewed. A scan is placed by its own time, which
    /// may be a little before or after that of the odometry.
    ///
    /// Input that cannot be used is remembered as the reason for the next decision and changes no map.
    pub fn observe(&mut self, odometry: &Odometry, scan: Option<&Scan>) -> Result<bool, NavigatorError> {
        self.pilot.admit(odometry);
        let Ok(jump) = self.surveyor.admit(odometry) else { return Ok(false) };
        if let Some(odometry) = self.pilot.odometry() {
            self.mission.advance(odometry);
        }
        if let Some(jump) = jump {
            self.assessor.follow_jump(&jump);
            self.surveyor.follow_jump(odometry, &jump)?;
            self.is_map_behind = true;
        }
        if self.surveyor.is_given() {
            // What was given whole never gets old.
            self.pilot.note_scan(odometry.valid_at_ns);
        }
        match scan {
            Some(scan) if self.survey(odometry, scan)? => {
                self.pilot.note_scan(scan.valid_at_ns);
                self.renew(odometry)?;
                Ok(true)
            }
            None if self.surveyor.is_given() && self.map.is_none() => self.renew(odometry).map(|()| true),
            Some(_) | None => Ok(false),
        }
    }

    /// The command for now, or the reason for none. `now_ns` is on the clock of the measurements.
    pub fn decide(&mut self, now_ns: u64) -> Decision<M::Command> {
        let time_to_goal = self.assessor.last_time_to_goal();
        // What was given lies in the frame of the map, whatever the localisation says.
        let odometry_at_ns = if self.surveyor.is_given() { u64::MAX } else { self.map_at_ns };
        let goal_m = self.goal_m;
        let chart =
            self.map.as_ref().map(|map| Chart { map: map.view(), time_to_goal, goal_m, odometry_at_ns });
        let decision = self.pilot.decide(now_ns, chart, &self.mission.instruction());
        self.surveyor.note_command(decision.command(M::Command::default()).speed_mps());
        if let Some(pose) = self.pilot.take_stuck() {
            self.assessor.note_stuck(pose);
            // The pose is of now; a map of before a jump takes it in when it is renewed.
            if let Some(map) = self.map.as_mut().filter(|_| !self.is_map_behind) {
                map.fill(|risks, _| self.assessor.amend(risks));
            }
        }
        decision
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        self.surveyor.surface()
    }

    /// The risk map as the controller reads it, once there is one. After a jump of the localisation it lies where it
    /// lay, until the next scan, and the controller drives on it as if there had been none.
    pub fn risk_map(&self) -> Option<RiskMapView<'_>> {
        self.map.as_ref().map(RiskMap::view)
    }

    /// The controller, for its diagnostics and rollouts.
    pub fn controller(&self) -> &Controller<M> {
        self.pilot.controller()
    }

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.surveyor.n_jumps()
    }

    /// What became of the scans so far.
    pub fn scans(&self) -> &ScanTally {
        self.surveyor.tally()
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.surveyor.refused()
    }

    /// Fuses a scan where the vehicle was at its time; false when nobody knows where, or nothing in it is usable.
    fn survey(&mut self, odometry: &Odometry, scan: &Scan) -> Result<bool, NavigatorError> {
        if self.surveyor.is_given() {
            return self.surveyor.fuse(odometry, scan);
        }
        match self.surveyor.place(scan.valid_at_ns) {
            Ok(Whereabouts::Between(there) | Whereabouts::Ahead(Some(there))) => {
                self.surveyor.fuse(&there, scan)
            }
            Ok(Whereabouts::Ahead(None) | Whereabouts::Unknown) => {
                self.surveyor.note_unplaced();
                Ok(false)
            }
            Err(_) => Ok(false),
        }
    }

    /// Brings risk map and cost-to-go up to date with the surface.
    fn renew(&mut self, odometry: &Odometry) -> Result<(), NavigatorError> {
        self.surveyor.assume_ground(odometry)?;
        (self.map_at_ns, self.is_map_behind) = (odometry.valid_at_ns, false);
        let changed = self.surveyor.take_changed();
        let position_m = [odometry.position_m[0], odometry.position_m[1]];
        self.assessor.update(position_m, self.surveyor.surface(), &changed)?;
        let Some(known) = self.assessor.known() else { return Ok(()) };
        let map =
            self.map.get_or_insert_with(|| RiskMap::constant(known.geometry, known.n_yaws, Risk::OUTSIDE));
        take_over(map, &known);
        map.fill(|risks, _| self.assessor.amend(risks));
        self.goal_m = self.mission.target().map_or(self.goal_m, |target| target.end().goal_m);
        self.assessor.time_to_goal(map.view(), self.goal_m)?;
        Ok(())
    }
}

fn take_over(map: &mut RiskMap, known: &RiskMapView<'_>) {
    let GridGeometry { origin, .. } = known.geometry;
    map.place_at(origin);
    map.fill(|risks, ground| {
        risks.copy_from_slice(known.risks);
        ground.copy_from_slice(known.ground);
    });
}
