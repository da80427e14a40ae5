//! One cycle of the pipeline.

use bicycle::{Command, Decision, Model, Odometry, SensorModel, Vehicle};
use mppi::Controller;
use terrain::{GridGeometry, GridMap, Scan, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMap, RiskMapView};

use crate::{Assessor, Belief, Chart, Config, Destination, Pilot, Surveyor};

/// Where the map of the ground comes from.
#[derive(Clone)]
pub enum Surface {
    /// Fused from scans.
    Sensed,
    /// Given whole, at the resolution of the elevation map; scans are ignored.
    Given(GridMap<SurfaceCell>),
}

/// Everything that stays the same during a drive.
pub struct Setup<'a> {
    /// The machine; the pipeline reads its geometry.
    pub vehicle: &'a Vehicle,
    /// What the controller believes of how it moves.
    pub model: Model,
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
}

/// The planner: its three parts, one after the other, behind two calls.
pub struct Navigator {
    surveyor: Surveyor,
    assessor: Assessor,
    pilot: Pilot,
    /// What is believed, less the poses that proved stuck; `None` before the first scan.
    map: Option<RiskMap>,
    destination: Destination,
}

impl Navigator {
    /// A pipeline that has seen nothing.
    pub fn new(setup: Setup<'_>) -> Result<Self, NavigatorError> {
        let Setup { vehicle, model, config, belief, surface, level, seed, goal_m, tolerance_m } = setup;
        Ok(Self {
            surveyor: Surveyor::new(vehicle, config.elevation, config.guard, surface)?
                .with_sensors(SensorModel::of(&model.effects)),
            assessor: Assessor::new(vehicle, &model.limits, &config, &belief, level)?,
            pilot: Pilot::new(model, &config, seed)?,
            map: None,
            destination: Destination { goal_m, tolerance_m },
        })
    }

    /// Takes in what was measured; returns whether the risk map was renewed.
    ///
    /// Input that cannot be used is remembered as the reason for the next decision and changes no map.
    pub fn observe(&mut self, odometry: &Odometry, scan: Option<&Scan>) -> Result<bool, NavigatorError> {
        self.pilot.admit(odometry);
        match self.surveyor.admit(odometry) {
            Err(_) => return Ok(false),
            Ok(Some(jump)) => {
                self.assessor.shift_stuck([jump.step_m[0], jump.step_m[1]]);
                self.surveyor.follow_jump(odometry, &jump)?;
            }
            Ok(None) => {}
        }
        if self.surveyor.is_given() {
            // What was given whole never gets old.
            self.pilot.note_scan(odometry.valid_at_ns);
        }
        match scan {
            Some(scan) if self.surveyor.fuse(odometry, scan)? => {
                self.pilot.note_scan(scan.valid_at_ns);
                self.renew(odometry)?;
                Ok(true)
            }
            None if self.surveyor.is_given() && self.map.is_none() => self.renew(odometry).map(|()| true),
            Some(_) | None => Ok(false),
        }
    }

    /// The command for now, or the reason for none. `now_ns` is on the clock of the measurements.
    pub fn decide(&mut self, now_ns: u64) -> Decision {
        let time_to_goal = self.assessor.last_time_to_goal();
        let chart = self.map.as_ref().map(|map| Chart { map: map.view(), time_to_goal });
        let decision = self.pilot.decide(now_ns, chart, &self.destination);
        self.surveyor.note_command(decision.command(Command::default()).speed_mps);
        if let Some(pose) = self.pilot.take_stuck() {
            self.assessor.note_stuck(pose);
            if let Some(map) = &mut self.map {
                self.assessor.amend(map.arrays_mut().0);
            }
        }
        decision
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        self.surveyor.surface()
    }

    /// The risk map as the controller reads it, once there is one.
    pub fn risk_map(&self) -> Option<RiskMapView<'_>> {
        self.map.as_ref().map(RiskMap::view)
    }

    /// The controller, for its diagnostics and rollouts.
    pub fn controller(&self) -> &Controller {
        self.pilot.controller()
    }

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.surveyor.n_jumps()
    }

    /// Brings risk map and cost-to-go up to date with the surface.
    fn renew(&mut self, odometry: &Odometry) -> Result<(), NavigatorError> {
        self.surveyor.assume_ground(odometry)?;
        let changed = self.surveyor.take_changed();
        let position_m = [odometry.position_m[0], odometry.position_m[1]];
        self.assessor.update(position_m, self.surveyor.surface(), &changed)?;
        let Some(known) = self.assessor.known() else { return Ok(()) };
        let map =
            self.map.get_or_insert_with(|| RiskMap::constant(known.geometry, known.n_yaws, Risk::OUTSIDE));
        take_over(map, &known);
        self.assessor.amend(map.arrays_mut().0);
        self.assessor.time_to_goal(map.view(), self.destination.goal_m)?;
        Ok(())
    }
}

fn take_over(map: &mut RiskMap, known: &RiskMapView<'_>) {
    let GridGeometry { origin, .. } = known.geometry;
    map.place_at(origin);
    let (risks, ground) = map.arrays_mut();
    risks.copy_from_slice(known.risks);
    ground.copy_from_slice(known.ground);
}
