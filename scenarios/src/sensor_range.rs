//! A simulated spinning range sensor: rays against the triangulated ground, obstacles and plants.

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::Vehicle;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use terrain::{BodyBox, Pose, RangePoint, Scan, SettingError, TerrainClass};

use crate::random::RayNoise;
use crate::skyline::Skyline;
use crate::{Walker, World};

/// Least height of the sensor above the ground [m].
const MAST_MIN_M: f64 = 0.35;
/// Vehicles below this length get finer rays [m].
const SMALL_LENGTH_M: f64 = 1.0;

/// What the sensor can see.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeSensorConfig {
    /// Directions around the body's z axis.
    pub n_azimuths: usize,
    /// Rays above each other in each direction.
    pub n_beams: usize,
    /// Elevation of the lowest and highest beam above the body's x-y plane [rad].
    pub elevation_rad: [f64; 2],
    /// Where the rays start, in the body frame [m].
    pub origin_m: [f64; 3],
    /// Shortest and longest measurable range [m].
    pub range_m: [f64; 2],
    /// Standard deviation of the range close by [m].
    pub noise_m: f64,
    /// Growth of that standard deviation with range [m/m].
    pub noise_per_range: f64,
    /// Share of returns that are lost, whatever the range [-].
    pub dropout: f64,
    /// Share of returns named as another class than theirs [-].
    pub class_confusion: f64,
    /// Plants stop a ray with this rate along its way through them [1/m].
    pub plant_extinction_per_m: f64,
    /// What of the vehicle itself stands in the rays' way, in the body frame; empty = the rays pass through it.
    #[serde(default)]
    pub own_body: BodyBox,
}

impl RangeSensorConfig {
    /// A sensor that fits the machine: above its middle at 0.55 of its length, on a small one on a mast of
    /// 0.35 m, seeing seven lengths far, at least 5 m. What looks far for its height strikes the ground at so flat an
    /// angle that it takes finer rays to see it.
    pub fn for_vehicle(vehicle: &Vehicle) -> Self {
        let geometry = &vehicle.geometry;
        let length_m = geometry.length_m;
        let height_m = (0.55 * length_m).max(MAST_MIN_M) - geometry.wheel_radius_m;
        let is_small = length_m < SMALL_LENGTH_M;
        Self {
            n_azimuths: if is_small { 600 } else { 240 },
            n_beams: if is_small { 96 } else { 40 },
            elevation_rad: [-50.0_f64.to_radians(), 8.0_f64.to_radians()],
            origin_m: [0.5 * geometry.wheelbase_m, 0.0, height_m],
            range_m: [0.1 * length_m, (7.0 * length_m).clamp(5.0, 40.0)],
            noise_m: 0.003 * length_m,
            noise_per_range: 0.002,
            dropout: 0.02,
            class_confusion: 0.01,
            plant_extinction_per_m: 8.0 / length_m,
            own_body: BodyBox::EMPTY,
        }
    }

    /// Refuses settings no sensor can have.
    pub fn validate(&self) -> Result<(), SettingError> {
        let refuse = |field, expected, found| Err(SettingError { field, expected, found });
        let counts = [("n_azimuths", self.n_azimuths), ("n_beams", self.n_beams)];
        if let Some((field, found)) = counts.into_iter().find(|(_, n)| !(1..=4096).contains(n)) {
            return refuse(field, "from 1 to 4096", found as f64);
        }
        let shares = [("dropout", self.dropout), ("class_confusion", self.class_confusion)];
        if let Some((field, found)) = shares.into_iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
            return refuse(field, "from 0 to 1", found);
        }
        let lengths = [
            ("range_m[0]", self.range_m[0]),
            ("noise_m", self.noise_m),
            ("noise_per_range", self.noise_per_range),
            ("plant_extinction_per_m", self.plant_extinction_per_m),
        ];
        if let Some((field, found)) = lengths.into_iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
            return refuse(field, "a finite number >= 0", found);
        }
        if !(self.range_m[1].is_finite() && self.range_m[1] > self.range_m[0]) {
            return refuse("range_m[1]", "a finite number above range_m[0]", self.range_m[1]);
        }
        let [low, high] = self.elevation_rad;
        if !(low.abs() < TAU / 4.0 && high.abs() < TAU / 4.0 && low <= high) {
            return refuse("elevation_rad", "two rising angles within +-pi/2", low);
        }
        match self.origin_m.iter().find(|v| !v.is_finite()) {
            Some(&found) => refuse("origin_m", "finite numbers", found),
            None => Ok(()),
        }
    }
}

/// The sensor in its world. A scan is a function of (world, config, seed, number, pose).
#[derive(Clone, Debug)]
pub struct RangeSensor {
    config: RangeSensorConfig,
    world: Arc<World>,
    skyline: Skyline,
    seed: u64,
}

/// Where a ray ended.
#[derive(Clone, Copy)]
struct Hit {
    range_m: f64,
    class: TerrainClass,
}

/// A walker as rays meet it.
struct Upright {
    centre_m: [f64; 2],
    foot_m: f64,
}

impl Upright {
    fn of(walker: &Walker, world: &World) -> Self {
        let centre_m = walker.position_m();
        Self { centre_m, foot_m: world.height_m(centre_m[0], centre_m[1]) }
    }

    /// Distance along a ray to its side or its top [m].
    fn distance_along(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let top_m = self.foot_m + Walker::HEIGHT_M;
        let from_m = [origin.x - self.centre_m[0], origin.y - self.centre_m[1]];
        let level = direction.x * direction.x + direction.y * direction.y;
        let half = from_m[0] * direction.x + from_m[1] * direction.y;
        let beyond_m2 = from_m[0] * from_m[0] + from_m[1] * from_m[1] - Walker::RADIUS_M * Walker::RADIUS_M;
        let squared = half * half - level * beyond_m2;
        if squared < 0.0 || level == 0.0 {
            return None;
        }
        let side_m = (-half - squared.sqrt()) / level;
        let leaves_m = (-half + squared.sqrt()) / level;
        let height_m = origin.z + side_m * direction.z;
        if side_m > 0.0 && (self.foot_m..=top_m).contains(&height_m) {
            return Some(side_m);
        }
        let cap_m = (top_m - origin.z) / direction.z;
        (cap_m > 0.0 && height_m > top_m && (side_m..=leaves_m).contains(&cap_m)).then_some(cap_m)
    }
}

/// The first walker on a ray. A camera names a person an obstacle.
fn nearest(standing: &[Upright], origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<(usize, Hit)> {
    let hits = standing.iter().enumerate().filter_map(|(place, upright)| {
        let range_m = upright.distance_along(origin, direction)?;
        Some((place, Hit { range_m, class: TerrainClass::Obstacle }))
    });
    hits.min_by(|(_, a), (_, b)| a.range_m.total_cmp(&b.range_m))
}

impl RangeSensor {
    /// Puts the sensor into a world.
    pub fn new(config: RangeSensorConfig, world: Arc<World>, seed: u64) -> Result<Self, SettingError> {
        config.validate()?;
        let skyline = Skyline::of(&world);
        Ok(Self { config, world, skyline, seed })
    }

    /// What the sensor is.
    pub fn config(&self) -> &RangeSensorConfig {
        &self.config
    }

    /// The sweep with this number from the true pose of the body, measured in an instant.
    pub fn scan(&self, pose: &Pose, number: u64, valid_at_ns: u64) -> Scan {
        self.scan_among(&[], pose, number, valid_at_ns).0
    }

    /// The same with people about, and how many returns came from each of them.
    pub fn scan_among(
        &self,
        walkers: &[Walker],
        pose: &Pose,
        number: u64,
        valid_at_ns: u64,
    ) -> (Scan, Vec<usize>) {
        let motion = pose.isometry();
        let standing: Vec<Upright> = walkers.iter().map(|walker| Upright::of(walker, &self.world)).collect();
        // The spin is not locked to the scans: consecutive sweeps look between each other's rays.
        let phase = (number as f64 * 0.618_033_988_75).fract();
        let per_azimuth: Vec<(Vec<RangePoint>, Vec<usize>)> = (0..self.config.n_azimuths)
            .into_par_iter()
            .map(|azimuth| {
                let turn = TAU * (azimuth as f64 + phase) / self.config.n_azimuths as f64;
                self.column(&motion, &standing, turn, (number, azimuth as u64))
            })
            .collect();
        let (mut points, mut n_returns) = (Vec::new(), vec![0; walkers.len()]);
        for (column, hit) in per_azimuth {
            points.extend(column);
            hit.into_iter().for_each(|walker| n_returns[walker] += 1);
        }
        (Scan { valid_at_ns, origin_m: self.config.origin_m.map(|v| v as f32), points }, n_returns)
    }

    /// The returns of all beams in one direction, and the walkers that they come from.
    fn column(
        &self,
        motion: &Isometry3<f64>,
        standing: &[Upright],
        turn: f64,
        (number, azimuth): (u64, u64),
    ) -> (Vec<RangePoint>, Vec<usize>) {
        let config = &self.config;
        let [lowest, highest] = config.elevation_rad;
        let origin = motion * Point3::from(config.origin_m);
        let (mut points, mut hit_walkers) = (Vec::with_capacity(config.n_beams), Vec::new());
        for beam in 0..config.n_beams {
            let share = if config.n_beams > 1 { beam as f64 / (config.n_beams - 1) as f64 } else { 0.5 };
            let (up, out) = (lowest + (highest - lowest) * share).sin_cos();
            let ahead = Vector3::new(out * turn.cos(), out * turn.sin(), up);
            let ray_number = azimuth * config.n_beams as u64 + beam as u64;
            let mut noise = RayNoise::new(self.seed, number, ray_number);
            let depth = -noise.uniform().ln();
            let direction = motion.rotation * ahead;
            let hit = self.cast(&origin, &direction, depth);
            let walker = nearest(standing, &origin, &direction);
            let walker =
                walker.filter(|(_, found)| hit.as_ref().is_none_or(|hit| found.range_m < hit.range_m));
            let hit = self.nearer(walker.as_ref().map(|(_, hit)| *hit).or(hit), &ahead);
            let is_walker =
                |hit: &Hit| walker.as_ref().is_some_and(|(_, found)| found.range_m == hit.range_m);
            let is_walker = hit.as_ref().is_some_and(is_walker);
            if let Some(point) = hit.and_then(|hit| self.measured(&hit, &ahead, &mut noise)) {
                points.push(point);
                hit_walkers.extend(walker.filter(|_| is_walker).map(|(place, _)| place));
            }
        }
        (points, hit_walkers)
    }

    /// The vehicle itself where it stands before what a ray would hit. It is as hard as rigid ground, and a camera names
    /// it so.
    fn nearer(&self, hit: Option<Hit>, ahead: &Vector3<f64>) -> Option<Hit> {
        let RangeSensorConfig { own_body, origin_m, .. } = self.config;
        let body = own_body
            .distance_along(origin_m, [ahead.x, ahead.y, ahead.z])
            .map(|range_m| Hit { range_m, class: TerrainClass::Open });
        match (hit, body) {
            (Some(hit), Some(body)) => Some(if body.range_m < hit.range_m { body } else { hit }),
            (hit, body) => hit.or(body),
        }
    }

    /// What the sensor makes of a hit: noise, losses and confusions.
    fn measured(&self, hit: &Hit, ahead: &Vector3<f64>, noise: &mut RayNoise) -> Option<RangePoint> {
        let config = &self.config;
        let range_m = hit.range_m + (config.noise_m + config.noise_per_range * hit.range_m) * noise.normal();
        if noise.uniform() < config.dropout || !(config.range_m[0]..=config.range_m[1]).contains(&range_m) {
            return None;
        }
        let position = Point3::from(config.origin_m) + ahead * range_m;
        let class = if noise.uniform() < config.class_confusion {
            let step = 1 + (noise.uniform() * (TerrainClass::COUNT - 1) as f64) as usize;
            TerrainClass::ALL[(hit.class as usize + step) % TerrainClass::COUNT]
        } else {
            hit.class
        };
        Some(RangePoint { position_m: [position.x as f32, position.y as f32, position.z as f32], class })
    }

    /// Follows a ray to the first thing that stops it. `depth` is the optical depth of plants it gets through.
    fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>, mut depth: f64) -> Option<Hit> {
        let step_m = 0.5 * self.world.geometry().resolution_m;
        let end_m = self.config.range_m[1];
        let at = |t_m: f64| origin + direction * t_m;
        let (mut t_m, mut clear_m) = (0.0, 0.0);
        while t_m < end_m {
            // Steps only where the ray is below the top of what stands around it; elsewhere it flies.
            let free_m = self.skyline.free_flight_m(&at(t_m), direction)?;
            if free_m > 0.0 {
                t_m += free_m;
                clear_m = t_m;
                continue;
            }
            let point = at(t_m);
            let ground_m = self.world.height_m(point.x, point.y);
            let patch = self.world.patch(point.x, point.y);
            if point.z <= ground_m + f64::from(patch.obstacle_height_m) {
                return Some(self.refined(origin, direction, [clear_m, t_m]));
            }
            if point.z < ground_m + f64::from(patch.vegetation_height_m) {
                depth -= self.config.plant_extinction_per_m * step_m;
                if depth < 0.0 {
                    return Some(Hit { range_m: t_m, class: TerrainClass::Vegetation });
                }
            }
            clear_m = t_m;
            t_m += step_m;
        }
        None
    }

    /// Halves the way between the last point in the open and the first inside something solid.
    fn refined(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        [mut clear_m, mut inside_m]: [f64; 2],
    ) -> Hit {
        let mut class = TerrainClass::Obstacle;
        for _ in 0..7 {
            let middle_m = 0.5 * (clear_m + inside_m);
            if self.solid_class(&(origin + direction * middle_m)).is_some() {
                inside_m = middle_m;
            } else {
                clear_m = middle_m;
            }
        }
        if let Some(found) = self.solid_class(&(origin + direction * inside_m)) {
            class = found;
        }
        Hit { range_m: inside_m, class }
    }

    /// What a camera sees at a point inside something solid; nothing in the open. Ground between plants shows its own
    /// colour, not theirs.
    fn solid_class(&self, point: &Point3<f64>) -> Option<TerrainClass> {
        let ground_m = self.world.height_m(point.x, point.y);
        let patch = self.world.patch(point.x, point.y);
        if point.z > ground_m + f64::from(patch.obstacle_height_m) {
            return None;
        }
        Some(match patch.class {
            TerrainClass::Vegetation => TerrainClass::Open,
            class => class,
        })
    }
}
