//! A method's route for a task.

use bicycle::Vehicle;
use route::{
    Bend, GroundCell, Planner, PlannerError, Route, RouteConfig, RouteError, RoutePoint, SpeedLimits,
    duration_s, fastest_speeds,
};
use scenarios::{Landscape, RouteTask};
use terrain::GridMap;

use super::method::Method;

/// Share of the attitude limits that a route may use.
const ATTITUDE_SHARE: f64 = 0.9;
/// Room around the middle of the way, in all [m]: a metre and more of tracking error beside the vehicle.
const CLEAR_WIDTH_M: f64 = 6.0;
/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.806_65;
/// The one speed of those who know no friction, and how it is reached and left [m/s, m/s2].
const ONE_SPEED_MPS: f64 = 6.0;
const ONE_RAMP_MPS2: f64 = 2.0;
/// Of what a slope may take at most, where the ground is steeper than that and is driven on nevertheless [-].
const STEEP_SHARE: f64 = 0.9;

/// What our planner weighs for a vehicle.
pub(super) fn config(vehicle: &Vehicle) -> RouteConfig {
    RouteConfig {
        clear_width_m: CLEAR_WIDTH_M,
        pitch_max_rad: ATTITUDE_SHARE * vehicle.limits.pitch_max_rad,
        roll_max_rad: ATTITUDE_SHARE * vehicle.limits.roll_max_rad,
        ..RouteConfig::default()
    }
}

/// What a vehicle can do: its motor's power at half of its fastest speed is there at every speed.
pub(super) fn limits(vehicle: &Vehicle) -> SpeedLimits {
    let mass_kg = vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg;
    let speed_max_mps = vehicle.limits.speed_max_mps;
    let per_torque = 1.0 / (vehicle.geometry.wheel_radius_m * mass_kg);
    let pulling_mps2 = vehicle.drivetrain.drive_torque_max_nm * per_torque;
    let powered_mps2 = vehicle.drivetrain.power_max_w / (mass_kg * 0.5 * speed_max_mps);
    SpeedLimits {
        speed_max_mps,
        traction_max_mps2: pulling_mps2.min(powered_mps2),
        braking_max_mps2: (vehicle.drivetrain.brake_torque_max_nm * per_torque)
            .min(SpeedLimits::default().braking_max_mps2),
        ..SpeedLimits::default()
    }
}

/// A line with speeds.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub points: Vec<RoutePoint>,
    pub spacing_m: f64,
}

impl Plan {
    /// Time from the start to a place so far before the end [s].
    pub fn duration_s(&self, before_end_m: f64) -> f64 {
        let n_left = (before_end_m / self.spacing_m).round() as usize;
        let n = self.points.len().saturating_sub(n_left);
        let speeds_mps: Vec<f64> = self.points[..n].iter().map(|point| point.speed_mps).collect();
        duration_s(&speeds_mps, self.spacing_m)
    }
}

/// A method in a landscape.
pub(super) struct MethodPlanner {
    method: Method,
    searched: Planner,
    /// What everybody could know, of whoever searches something else.
    known: Option<Planner>,
    limits: SpeedLimits,
}

impl MethodPlanner {
    pub fn new(
        method: Method,
        known: &GridMap<GroundCell>,
        landscape: &Landscape,
        vehicle: &Vehicle,
    ) -> Result<Self, PlannerError> {
        let ours = config(vehicle);
        let searched = Planner::new(method.map(known, landscape), method.config(ours))?;
        let known = match method {
            Method::Binary => Some(Planner::new(known.clone(), ours)?),
            _ => None,
        };
        Ok(Self { method, searched, known, limits: limits(vehicle) })
    }

    /// The way for a task, with speeds.
    pub fn plan(&self, task: &RouteTask) -> Result<Plan, RouteError> {
        let route = self.searched.route((task.start_m, task.yaw_rad), task.goal_m, &self.limits)?;
        match &self.known {
            _ if self.method == Method::Appearance => Ok(at_one_speed(route)),
            Some(known) => self.sped(route, known),
            None => Ok(scaled(route, self.method.speed_factor())),
        }
    }

    /// With the speeds that our planner would drive it at, and where it would not, as slowly as at the steepest
    /// slope that
    /// it would.
    fn sped(&self, route: Route, known: &Planner) -> Result<Plan, RouteError> {
        let drivable = |bend: Bend| self.drivable(bend);
        let bends: Vec<Bend> = known.bends(&route.line.points).into_iter().map(drivable).collect();
        let speeds_mps = fastest_speeds(&bends, route.line.spacing_m, &self.limits)?;
        let points = route.line.points.into_iter().zip(speeds_mps);
        let points = points.map(|(point, speed_mps)| RoutePoint { speed_mps, ..point }).collect();
        Ok(Plan { points, spacing_m: route.line.spacing_m })
    }

    fn drivable(&self, bend: Bend) -> Bend {
        let slope = bend.grade.hypot(bend.cross_slope);
        let held = STEEP_SHARE * self.limits.friction_share * bend.friction;
        let pulled = STEEP_SHARE * self.limits.traction_max_mps2 / GRAVITY_MPS2;
        let share = (held / slope).min(pulled / bend.grade.max(1e-9)).min(1.0);
        Bend { grade: share * bend.grade, cross_slope: share * bend.cross_slope, ..bend }
    }
}

fn scaled(route: Route, factor: f64) -> Plan {
    let points = route.line.points.into_iter();
    let points = points.map(|point| RoutePoint { speed_mps: factor * point.speed_mps, ..point }).collect();
    Plan { points, spacing_m: route.line.spacing_m }
}

fn at_one_speed(route: Route) -> Plan {
    let (spacing_m, last) = (route.line.spacing_m, route.line.points.len().saturating_sub(1));
    let speed_mps = |index: usize| {
        let nearer_m = index.min(last - index) as f64 * spacing_m;
        (2.0 * ONE_RAMP_MPS2 * nearer_m).sqrt().min(ONE_SPEED_MPS)
    };
    let points = route.line.points.into_iter().enumerate();
    let points = points.map(|(index, point)| RoutePoint { speed_mps: speed_mps(index), ..point }).collect();
    Plan { points, spacing_m }
}
