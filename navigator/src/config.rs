//! Settings of the whole pipeline, and the ones that fit a machine.

use bicycle::{Geometry, Limits, Vehicle};
use kinodynamics::CorrectionConfig;
use mppi::CostToGoConfig;
use physics_prior::{PriorConfig, SlopeLaw};
use serde::{Deserialize, Serialize};
use terrain::{BodyBox, ElevationConfig, Mount};

use crate::speed::OVERSPEED_S;
use crate::{Areas, FrictionConfig, GuardConfig, MovingConfig, NavigatorError, SpeedConfig};

/// Of a step that asks twice as much of the ground as it holds [s].
const GRIP_S: f64 = 0.5;

/// Vehicles below this length cannot look over what hides ground from them [m].
const SMALL_LENGTH_M: f64 = 1.0;

/// Poses of a risk map: a gigabyte.
const MOST_RISKS: usize = 1 << 26;
/// Scans between two with which the map of the ground tells what is not urgent.
const PUBLISH_PERIOD_SCANS: u8 = 8;
/// How long that takes a sensor of 5 Hz [s].
const PUBLISH_PERIOD_S: f64 = 0.2 * PUBLISH_PERIOD_SCANS as f64;
/// What a vehicle brakes with at the least [m/s2].
const BRAKING_MPS2: f64 = 2.0;
/// Radius of the tightest turn in wheelbases: that of wheels steered by 30 degrees.
const TURN_WHEELBASES: f64 = 1.75;

/// Settings of the pipeline. A file gives only what differs from [`Config::for_vehicle`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Semantic elevation map.
    pub elevation: ElevationConfig,
    /// Window of the risk map.
    pub risk_map: RiskMapConfig,
    /// Physics prior.
    pub prior: PriorConfig,
    /// Field of least time to the goal.
    pub cost_to_go: CostToGoConfig,
    /// Controller.
    pub controller: mppi::Config,
    /// What may enter.
    pub guard: GuardConfig,
    /// Share of the limits of roll and pitch that a plan may use, in (0, 1]; the rest is for what no map shows:
    /// rocking, sinking springs, the edge of a rock between two cells.
    pub attitude_share: f64,
    /// Where the vehicle may be.
    #[serde(default)]
    pub areas: Areas,
    /// Range sensors whose scans come in their own frames, numbered from 1; scans of number 0 come in the body frame.
    #[serde(default)]
    pub sensors: Vec<Mount>,
    /// What moves: left out, nothing is taken to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving: Option<MovingConfig>,
    /// How much the ground is known to hold: left out, nobody knows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionConfig>,
    /// How fast uneven ground may be driven over.
    #[serde(default)]
    pub speed: SpeedConfig,
    /// How far whoever corrects commands for the ground may go.
    #[serde(default)]
    pub correction: CorrectionConfig,
}

/// Window of the risk map; its cells are whole multiples of the elevation map's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RiskMapConfig {
    /// Elevation cells along the edge of a risk cell.
    pub elevation_cells: usize,
    /// Rows of the window.
    pub n_rows: usize,
    /// Columns of the window.
    pub n_cols: usize,
    /// Yaw bins.
    pub n_yaws: usize,
    /// The window follows the vehicle once it is this far from the centre [m].
    pub recentre_m: f64,
}

impl Config {
    /// Settings that fit a vehicle, see [`Config::for_geometry`], what friction leaves it on a slope, and how far its body
    /// leans.
    pub fn for_vehicle(vehicle: &Vehicle) -> Self {
        let fitting = Self::for_geometry(&vehicle.geometry, vehicle.limits.speed_max_mps);
        let prior = PriorConfig { slope_law: SlopeLaw::of(vehicle), lean: vehicle.lean(), ..fitting.prior };
        let cost_to_go = CostToGoConfig {
            turning_radius_m: vehicle.geometry.wheelbase_m / libm::tan(vehicle.limits.steering_max_rad),
            reverse_speed_share: reverse_speed_share(&vehicle.limits, &fitting.controller),
            ..fitting.cost_to_go
        };
        let speed = SpeedConfig::of(vehicle);
        let mut controller = fitting.controller;
        let is_fast = vehicle.limits.speed_max_mps > speed.least_mps;
        controller.costs.overspeed_s = if is_fast { OVERSPEED_S } else { 0.0 };
        Self { prior, cost_to_go, controller, speed, ..fitting }
    }

    /// Settings that fit a vehicle's lengths and its fastest speed: a window of at most 128 cells a side that holds twice
    /// the controller's horizon if cells between a ninth and a quarter of the vehicle's width can do that, and a
    /// horizon that ends within it.
    pub fn for_geometry(geometry: &Geometry, speed_max_mps: f64) -> Self {
        let length_m = geometry.length_m;
        let mut controller = controller(length_m);
        let horizon_s = controller.n_steps as f64 * controller.step_s;
        let horizon_m = speed_max_mps * horizon_s;
        // Twice the horizon to either side sees around an obstacle at its end.
        let window_m = (4.0 * horizon_m).max(6.0 * length_m);
        let (finest_m, coarsest_m) = (geometry.width_m / 9.0, geometry.width_m / 4.0);
        let risk_m = round_to_two_digits((window_m / 128.0).clamp(finest_m, coarsest_m));
        let n = ((window_m / risk_m).ceil() as usize).min(128);
        let seen_s = 0.5 * n as f64 * risk_m / speed_max_mps;
        controller.n_steps = ((seen_s / controller.step_s) as usize).clamp(FEWEST_STEPS, controller.n_steps);
        // The ground under a footprint at the border must be inside the elevation window, and so must its drift.
        let margin_m = length_m + 2.0 * risk_m;
        // A body beyond all measure asks for more cells than there are numbers; such a window is refused on validation.
        let elevation_n = ((margin_m / risk_m).ceil() as usize).saturating_mul(2).saturating_add(n);
        let fitting = ElevationConfig::scaled_to(length_m);
        Self {
            elevation: ElevationConfig {
                own_body: own_body(geometry),
                resolution_m: risk_m,
                n_rows: elevation_n,
                n_cols: elevation_n,
                recentre_m: 4.0 * risk_m,
                gap_radius_m: fitting.gap_radius_m.max(gap_cells(length_m) * risk_m),
                publish_period_scans: PUBLISH_PERIOD_SCANS,
                // What waits is told while the vehicle can still stop or turn away a third of its length before it.
                publish_near_m: fitting.publish_near_m
                    + speed_max_mps * PUBLISH_PERIOD_S
                    + (speed_max_mps * speed_max_mps / (2.0 * BRAKING_MPS2))
                        .max(TURN_WHEELBASES * geometry.wheelbase_m),
                ..fitting
            },
            risk_map: RiskMapConfig {
                elevation_cells: 1,
                n_rows: n,
                n_cols: n,
                n_yaws: 16,
                recentre_m: 4.0 * risk_m,
            },
            prior: PriorConfig::for_vehicle(geometry),
            cost_to_go: cost_to_go(length_m),
            controller,
            guard: GuardConfig::default(),
            attitude_share: 0.9,
            areas: Areas::default(),
            sensors: Vec::new(),
            moving: None,
            friction: None,
            speed: SpeedConfig::default(),
            correction: CorrectionConfig::default(),
        }
    }

    /// Keeps plans to what the ground is known to hold, by its class, or by a map that the assessor is told of.
    pub fn keep_to_friction(&mut self, known: FrictionConfig) {
        self.friction = Some(known);
        let price_s = &mut self.controller.costs.grip_s;
        *price_s = if *price_s > 0.0 { *price_s } else { GRIP_S };
    }

    /// Edge of a risk cell [m].
    pub fn risk_resolution_m(&self) -> f64 {
        self.elevation.resolution_m * self.risk_map.elevation_cells as f64
    }

    /// Refuses the first field of this crate's own that is out of range; the parts are checked by whoever is made of them.
    ///
    /// # Errors
    /// The field, with what would do and what was found.
    pub fn validate(&self) -> Result<(), NavigatorError> {
        match self.first_invalid() {
            Some((field, expected, found)) => Err(NavigatorError::Config { field, expected, found }),
            None => {
                self.correction.validate().map_err(NavigatorError::Correction)?;
                self.areas.validate()
            }
        }
    }

    /// Name of the field, what would do, value.
    fn first_invalid(&self) -> Option<(&'static str, &'static str, f64)> {
        let RiskMapConfig { elevation_cells, n_rows, n_cols, n_yaws, recentre_m } = self.risk_map;
        let share = self.attitude_share;
        let cells = "a whole number from 1 to 100";
        let side = "a whole number from 3 to 4096";
        let yaws = "a whole number from 1 to 360";
        let n_risks = n_rows.saturating_mul(n_cols).saturating_mul(n_yaws);
        let checks = [
            ((1..=100).contains(&elevation_cells), "risk_map.elevation_cells", cells, elevation_cells as f64),
            ((3..=4096).contains(&n_rows), "risk_map.n_rows", side, n_rows as f64),
            ((3..=4096).contains(&n_cols), "risk_map.n_cols", side, n_cols as f64),
            ((1..=360).contains(&n_yaws), "risk_map.n_yaws", yaws, n_yaws as f64),
            (n_risks <= MOST_RISKS, "risk_map.n_rows x n_cols x n_yaws", "at most 67108864", n_risks as f64),
            (share > 0.0 && share <= 1.0, "attitude_share", "a number in (0, 1]", share),
            (
                recentre_m > 0.0 && recentre_m <= 1e3,
                "risk_map.recentre_m",
                "a number > 0 and at most 1000",
                recentre_m,
            ),
        ];
        let own = checks.into_iter().find(|(allowed, ..)| !allowed);
        own.map(|(_, field, expected, found)| (field, expected, found))
            .or(self.guard.first_invalid().map(|(field, found)| (field, "a finite number > 0", found)))
            .or(self
                .sensors
                .iter()
                .find_map(Mount::first_invalid)
                .map(|(field, found)| (field, "a finite number", found)))
            .or(self.moving.as_ref().and_then(MovingConfig::first_invalid))
            .or(self.friction.as_ref().and_then(FrictionConfig::first_invalid))
            .or(self.speed.first_invalid().map(|(field, found)| (field, "a finite number > 0", found)))
    }
}

/// Steps of the shortest horizon. A longer one than to the border of what is seen would spread the futures over ground
/// that nobody has judged, and leave few for what is near.
const FEWEST_STEPS: usize = 10;
/// Margin around the vehicle, over its length: for the sensor's noise and for what is mounted on the body.
const BODY_MARGIN: f64 = 0.03;
/// Height of the vehicle over its length, which no description gives: about that of a car.
const BODY_HEIGHT: f64 = 0.5;

/// The room that a vehicle takes up, from half its clearance above the ground to the roof. What lies lower is the
/// ground itself as far as it can be driven over.
fn own_body(geometry: &Geometry) -> BodyBox {
    let (length_m, radius_m) = (geometry.length_m, geometry.wheel_radius_m);
    let (half_width_m, margin_m) = (0.5 * geometry.width_m, BODY_MARGIN * length_m);
    let bounds = BodyBox {
        min_m: [-geometry.rear_overhang_m, -half_width_m, 0.0],
        max_m: [length_m - geometry.rear_overhang_m, half_width_m, BODY_HEIGHT * length_m - radius_m],
    };
    let mut body = bounds.grown(margin_m);
    body.min_m[2] = 0.5 * geometry.ground_clearance_m - radius_m;
    body
}

/// Cells over which gaps of the elevation map are filled at the least: some lie between the rays whatever the size of
/// the machine. A small one sees only the tops of plants as tall as itself, and the ground below them far before them.
fn gap_cells(length_m: f64) -> f64 {
    if length_m < SMALL_LENGTH_M { 5.0 } else { 2.0 }
}

/// The defaults; a small machine cannot look over what is as tall as itself, so that unseen ground is likelier more of
/// what hides it: it counts as slow as the prior's rollouts find it.
fn cost_to_go(length_m: f64) -> CostToGoConfig {
    let default = CostToGoConfig::default();
    let is_small = length_m < SMALL_LENGTH_M;
    CostToGoConfig {
        unknown_speed_share: if is_small { 0.25 } else { default.unknown_speed_share },
        ..default
    }
}

/// Speed in reverse over the speed limit, so that a metre costs what plans pay for it: a step in reverse has a price, and
/// covers less.
fn reverse_speed_share(limits: &Limits, controller: &mppi::Config) -> f64 {
    let price = 1.0 + controller.costs.reverse_s / controller.step_s;
    let share = limits.reverse_speed_max_mps / (limits.speed_max_mps * price);
    if share < 0.01 { 0.0 } else { share.min(1.0) }
}

/// The controller's defaults with the lengths of the recovery scaled from a vehicle of 3.4 m. Small machines spin
/// their wheels and measure their place no better than large ones: below a third of that length it ends.
fn controller(length_m: f64) -> mppi::Config {
    let default = mppi::Config::default();
    let scale = (length_m / 3.4).max(1.0 / 3.0);
    let recovery = mppi::Recovery {
        progress_m: scale * default.recovery.progress_m,
        distance_m: scale * default.recovery.distance_m,
        ..default.recovery
    };
    mppi::Config { recovery, ..default }
}

/// Limits that keep a cell size readable: 0.1944 becomes 0.19.
fn round_to_two_digits(length_m: f64) -> f64 {
    let scale = libm::pow(10.0, 1.0 - libm::log10(length_m).floor());
    (length_m * scale).round() / scale
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    /// The buggy is 0.48 m wide. 128 cells of a quarter of that reach 7.68 m to either side: 1.54 s at 5 m/s, 2.56 s at 3, and
    /// more than the five seconds of a plan at 1 m/s.
    #[test]
    fn plans_of_the_fast_end_where_the_map_does() {
        let mut vehicle = formats::read_vehicle("buggy_fifth").unwrap();
        for (speed_mps, n_steps) in [(1.0, 50), (3.0, 25), (5.0, 15), (100.0, FEWEST_STEPS)] {
            vehicle.limits.speed_max_mps = speed_mps;
            assert_eq!(Config::for_vehicle(&vehicle).controller.n_steps, n_steps, "{speed_mps} m/s");
        }
    }
}
