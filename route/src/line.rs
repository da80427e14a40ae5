//! From cells to a line with speeds: what a short route and a far one have in common.

use crate::FrictionCurve;
use crate::ground::GroundCell;
use crate::planner::RouteError;
use crate::smooth::{Spline, SplinePoint};
use crate::speed::{self, Bend, SpeedError, SpeedLimits, duration_s, fastest_speeds};
use terrain::GridMap;

/// A smooth line over the ground with the fastest speeds along it.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteLine {
    /// Its points, evenly spaced.
    pub points: Vec<RoutePoint>,
    /// Between two points along it [m].
    pub spacing_m: f64,
    /// Expected time [s].
    pub duration_s: f64,
}

impl RouteLine {
    /// Its places [m].
    pub fn places_m(&self) -> Vec<[f64; 2]> {
        self.points.iter().map(|point| point.at_m).collect()
    }

    /// Its length [m].
    pub fn length_m(&self) -> f64 {
        self.spacing_m * self.points.len().saturating_sub(1) as f64
    }
}

/// A point of a route's line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutePoint {
    /// Place in the map frame [m].
    pub at_m: [f64; 2],
    /// Direction of the line, counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Height of the ground [m].
    pub height_m: f64,
    /// What the speed depends on.
    pub bend: Bend,
    /// Speed [m/s].
    pub speed_mps: f64,
}

/// A point that a line passes, to within some metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gate {
    pub at_m: [f64; 2],
    /// How far the line's control point may lie from it along each axis [m].
    pub freedom_m: f64,
}

/// The direction of the search that is nearest to a yaw.
pub(crate) fn heading_of(yaw_rad: f64) -> usize {
    (yaw_rad / std::f64::consts::FRAC_PI_4).round().rem_euclid(8.0) as usize
}

/// Moves the first and the last gate to two points, which the line begins and ends on.
pub(crate) fn fix_ends(corridor: &mut [Gate], start_m: [f64; 2], goal_m: [f64; 2]) {
    if let Some(last) = corridor.last_mut() {
        *last = Gate { at_m: goal_m, freedom_m: 0.0 };
    }
    if let Some(first) = corridor.first_mut() {
        *first = Gate { at_m: start_m, freedom_m: 0.0 };
    }
}

/// A smooth line.
pub(crate) struct Line {
    pub samples: Vec<SplinePoint>,
    /// Between two samples along it [m].
    pub spacing_m: f64,
}

impl Line {
    /// The least bent one through some gates, sampled every `spacing_m` or a little less.
    pub fn through(corridor: &[Gate], spacing_m: f64) -> Result<Self, RouteError> {
        let points_m: Vec<[f64; 2]> = corridor.iter().map(|gate| gate.at_m).collect();
        let freedom_m: Vec<f64> = corridor.iter().map(|gate| gate.freedom_m).collect();
        let spline = Spline::least_bent(&points_m, &freedom_m);
        let spline = spline.ok_or(RouteError::Smooth { n_cells: corridor.len() })?;
        let (samples, spacing_m) = spline.sampled(spacing_m);
        Ok(Self { samples, spacing_m })
    }

    /// The line with the fastest speeds over ground whose bend and height [m] each point has.
    pub fn driven(&self, grounded: Vec<(Bend, f64)>, limits: &SpeedLimits) -> Result<RouteLine, Undrivable> {
        let bends: Vec<Bend> = grounded.iter().map(|(bend, _)| *bend).collect();
        let speeds_mps = fastest_speeds(&bends, self.spacing_m, limits).map_err(|error| {
            let faults = speed::faults(&bends, self.spacing_m, limits);
            Undrivable { error, places_m: faults.map(|(index, _)| self.samples[index].at_m).collect() }
        })?;
        let duration_s = duration_s(&speeds_mps, self.spacing_m);
        let points = self.samples.iter().zip(grounded).zip(speeds_mps);
        let points = points.map(|((sample, (bend, height_m)), speed_mps)| RoutePoint {
            at_m: sample.at_m,
            yaw_rad: sample.yaw_rad,
            height_m,
            bend,
            speed_mps,
        });
        Ok(RouteLine { points: points.collect(), spacing_m: self.spacing_m, duration_s })
    }
}

/// No speed will do on a line.
pub(crate) struct Undrivable {
    /// At the first place, or with these limits.
    pub error: SpeedError,
    /// All the places, along the line [m]; none where it is the limits that will not do.
    pub places_m: Vec<[f64; 2]>,
}

/// The ground under a sample of a line, and its height [m].
pub(crate) fn grounded(ground: &GridMap<GroundCell>, sliding_mps: f32, sample: &SplinePoint) -> (Bend, f64) {
    let geometry = ground.geometry();
    let height_m = |at_m: [f64; 2]| f64::from(terrain::height_at(ground, at_m[0], at_m[1]));
    let (sine, cosine) = libm::sincos(sample.yaw_rad);
    let slope = |direction: [f64; 2]| {
        let reach_m = geometry.resolution_m;
        let beside_m = |sign: f64| [0, 1].map(|axis| sample.at_m[axis] + sign * reach_m * direction[axis]);
        let rise_m = height_m(beside_m(1.0)) - height_m(beside_m(-1.0));
        if rise_m.is_finite() { rise_m / (2.0 * reach_m) } else { 0.0 }
    };
    let cell = ground.at(sample.at_m[0], sample.at_m[1]).filter(|cell| cell.is_known());
    let cell = cell.copied().unwrap_or(GroundCell::level(FrictionCurve::ICE));
    let bend = Bend {
        curvature_per_m: sample.curvature_per_m,
        grade: slope([cosine, sine]),
        cross_slope: slope([-sine, cosine]),
        friction: f64::from(cell.friction.at(sliding_mps)),
        roughness_m: f64::from(cell.roughness_m),
    };
    (bend, height_m(sample.at_m))
}
