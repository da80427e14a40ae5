//! One cycle of the pipeline.

use bicycle::{Decision, HoldReason, Model, Odometry, StopReason, Vehicle};
use mppi::{Controller, CostToGo, Input, Objective, Terminal};
use terrain::{AssumedGround, CellRegion, ElevationMap, Footprint, GridMap, Pose, Scan, SurfaceCell};
use traversability::{CvarLevel, RiskMapView};

use crate::Config;
use crate::guard::{Guard, Jump};
use crate::risk::{Belief, RiskLayer, StuckPose};

/// Standard deviation of the ground height assumed below a vehicle that has seen nothing yet [m].
const ASSUMED_HEIGHT_STD_M: f64 = 0.05;

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

/// The planner: maps, risk map and controller behind two calls.
pub struct Navigator {
    guard: Guard,
    elevation: ElevationMap,
    given: Option<GridMap<SurfaceCell>>,
    risk: RiskLayer,
    cost_to_go: CostToGo,
    controller: Controller,
    assumed: AssumedGround,
    goal_m: [f64; 2],
    tolerance_m: f64,
    odometry: Option<Odometry>,
    fault: Option<StopReason>,
    decided_at_ns: Option<u64>,
    cycle: u64,
    n_jumps: u64,
}

impl Navigator {
    /// A pipeline that has seen nothing.
    pub fn new(setup: Setup<'_>) -> Result<Self, NavigatorError> {
        let Setup { vehicle, model, config, belief, surface, level, seed, goal_m, tolerance_m } = setup;
        if let Some((field, expected, found)) = config.first_invalid() {
            return Err(NavigatorError::Config { field, expected, found });
        }
        let window = config.risk_map;
        let mut model = model;
        model.limits.roll_max_rad *= config.attitude_share;
        model.limits.pitch_max_rad *= config.attitude_share;
        Ok(Self {
            guard: Guard::new(config.guard),
            elevation: ElevationMap::new(config.elevation)?,
            given: match surface {
                Surface::Sensed => None,
                Surface::Given(surface) => Some(surface),
            },
            risk: RiskLayer::new(&belief, &config.prior, level, &vehicle.geometry, &config)?,
            cost_to_go: CostToGo::new(config.cost_to_go, &model.limits, window.n_rows, window.n_cols)?,
            controller: Controller::new(config.controller, model, seed)?,
            assumed: assumed_ground(vehicle),
            goal_m,
            tolerance_m,
            odometry: None,
            fault: None,
            decided_at_ns: None,
            cycle: 0,
            n_jumps: 0,
        })
    }

    /// Takes in what was measured; returns whether the risk map was renewed.
    ///
    /// Input that cannot be used is remembered as the reason for the next decision and changes no map.
    pub fn observe(&mut self, odometry: &Odometry, scan: Option<&Scan>) -> Result<bool, NavigatorError> {
        self.fault = None;
        match self.guard.admit_odometry(odometry) {
            Err(reason) => {
                self.fault = Some(reason);
                return Ok(false);
            }
            Ok(Some(jump)) => self.follow_jump(odometry, &jump)?,
            Ok(None) => {}
        }
        if self.given.is_some() {
            // What was given whole never gets old.
            self.guard.note_scan(odometry.valid_at_ns);
        }
        self.odometry = Some(*odometry);
        match scan {
            Some(scan) => self.map(odometry, scan),
            None if self.given.is_some() && self.risk.view().is_none() => self.renew(odometry),
            None => Ok(false),
        }
    }

    /// The command for now, or the reason for none. `now_ns` is on the clock of the measurements.
    pub fn decide(&mut self, now_ns: u64) -> Decision {
        let decision = self.consider(now_ns);
        let speed_mps = match decision {
            Decision::Drive(command) => command.speed_mps,
            Decision::Hold(_) | Decision::Stop(_) => 0.0,
        };
        self.guard.note_command(speed_mps);
        self.decided_at_ns = Some(now_ns);
        self.cycle += 1;
        decision
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        self.given.as_ref().unwrap_or(self.elevation.surface())
    }

    /// The risk map as the controller reads it, once there is one.
    pub fn risk_map(&self) -> Option<RiskMapView<'_>> {
        self.risk.view()
    }

    /// The controller, for its diagnostics and rollouts.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.n_jumps
    }

    fn consider(&mut self, now_ns: u64) -> Decision {
        let fresh = self.fault.map_or_else(|| self.guard.check(now_ns), Err);
        if let Err(reason) = fresh {
            return Decision::Stop(reason);
        }
        let (Some(map), Some(odometry)) = (self.risk.view(), self.odometry) else {
            return Decision::Hold(HoldReason::NoMap);
        };
        let was_recovering = self.controller.diagnostics().is_recovering;
        let elapsed_s =
            self.decided_at_ns.map_or(0.0, |then_ns| now_ns.saturating_sub(then_ns) as f64 * 1e-9);
        let decision = self.controller.decide(&Input {
            state: odometry.state(),
            elapsed_s,
            map,
            objective: Objective::Goal {
                goal_m: self.goal_m,
                tolerance_m: self.tolerance_m,
                terminal: Terminal::CostToGo(self.cost_to_go.view()),
            },
            cycle: self.cycle,
        });
        if self.controller.diagnostics().is_recovering && !was_recovering {
            let [x_m, y_m, _] = odometry.position_m;
            self.risk.note_stuck(StuckPose { position_m: [x_m, y_m], yaw_rad: odometry.attitude_rad[2] });
        }
        decision
    }

    fn map(&mut self, odometry: &Odometry, scan: &Scan) -> Result<bool, NavigatorError> {
        if self.given.is_none() {
            // A finite pose was admitted; a scan whose origin is no place holds nothing to fuse.
            let Ok(report) = self.elevation.fuse(scan, &pose(odometry)) else { return Ok(false) };
            if report.n_points == report.n_rejected_non_finite {
                return Ok(false);
            }
            self.guard.note_scan(scan.valid_at_ns);
        }
        self.renew(odometry)
    }

    /// Brings risk map and cost-to-go up to date with the surface.
    fn renew(&mut self, odometry: &Odometry) -> Result<bool, NavigatorError> {
        if self.risk.view().is_none() {
            self.elevation.assume_ground(&pose(odometry), &self.assumed)?;
        }
        let position_m = [odometry.position_m[0], odometry.position_m[1]];
        let changed = match &self.given {
            Some(_) => Some(CellRegion { rows: 0..0, cols: 0..0 }),
            None => self.elevation.take_changed(),
        };
        let surface = self.given.as_ref().unwrap_or(self.elevation.surface());
        let changed = changed.unwrap_or(CellRegion { rows: 0..0, cols: 0..0 });
        self.risk.update(position_m, surface, &changed)?;
        if let Some(map) = self.risk.view() {
            self.cost_to_go.update(map, self.goal_m)?;
        }
        Ok(true)
    }

    /// The localisation moved, the vehicle did not: what was mapped moves along.
    fn follow_jump(&mut self, odometry: &Odometry, jump: &Jump) -> Result<(), NavigatorError> {
        self.n_jumps += 1;
        self.risk.shift_stuck([jump.step_m[0], jump.step_m[1]]);
        let after = pose(odometry);
        let [x_m, y_m, z_m] = jump.step_m;
        let before = Pose { x_m: after.x_m - x_m, y_m: after.y_m - y_m, z_m: after.z_m - z_m, ..after };
        Ok(self.elevation.reanchor(&before, &after)?)
    }
}

fn assumed_ground(vehicle: &Vehicle) -> AssumedGround {
    let geometry = &vehicle.geometry;
    // A quarter of the length more on every side: the blind zone of a roof sensor reaches beyond the bumpers.
    let margin_m = 0.25 * geometry.length_m;
    AssumedGround {
        footprint: Footprint {
            front_m: geometry.length_m - geometry.rear_overhang_m + margin_m,
            rear_m: geometry.rear_overhang_m + margin_m,
            half_width_m: 0.5 * geometry.width_m + margin_m,
        },
        axle_height_m: geometry.wheel_radius_m,
        height_std_m: ASSUMED_HEIGHT_STD_M,
    }
}

fn pose(odometry: &Odometry) -> Pose {
    let [x_m, y_m, z_m] = odometry.position_m;
    let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
}
