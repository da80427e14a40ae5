//! Whether range sensors look where they are said to look: what stands still has to stay where it is while the vehicle
//! drives.
//!
//! Points of two sweeps are laid over one another by the odometry. Where a sensor is turned about its upright axis by an
//! angle that nobody has said, they lie apart by that angle times the way between the two, sideways to it. The turn that
//! brings them closest is searched for.

use std::collections::{BTreeMap, HashMap};

use bus::message::{OdometryRecord, PointRecord, ScanHeader};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use terrain::{Mount, Pose};

use super::motion::turned_rad;
use super::{Finding, Verdict};

/// Way between two sweeps that are kept [m].
const STEP_M: f64 = 0.4;
/// Ways between two that are laid over one another [m]: shorter ones show little, after longer ones other sides are seen.
const WAY_M: [f64; 2] = [0.7, 4.0];
/// Time between them up to which odometry is believed [s].
const TIME_MAX_S: f64 = 20.0;
/// Sweeps that are kept of a sensor, and later ones that each is laid over.
const SWEEPS_MAX: usize = 40;
const PARTNERS: usize = 4;
/// Pairs of sweeps that are looked at: more do not tell the angle better.
const PAIRS_MAX: usize = 48;
/// Points of a sweep that are looked at, the least and the most.
const POINTS: [usize; 2] = [30, 600];
/// Distance from which on points are not of the same thing [m].
const APART_M: f64 = 0.5;
/// Steps of the search, first around the whole circle [rad].
const COARSE_RAD: f64 = 0.04;
const FINE_STEP_RAD: f64 = 0.004;
/// Turn by which the points have to lie farther apart [rad], how many times and by how much [m], or the angle is not told
/// by them.
const WIDE_RAD: f64 = 0.1;
const CONTRAST: f64 = 1.25;
const CONTRAST_M: f64 = 0.01;
/// Angle that may be the search's, and one by which things ahead are driven into [rad].
const FINE_RAD: f64 = 0.03;
const BEARABLE_RAD: f64 = 0.08;
/// Odometry that is kept: an hour and more of 50 Hz.
const ODOMETRY_MAX: usize = 1 << 18;
/// Number of the least class that stands out of the ground: plants, then obstacles.
const STANDING: u32 = 2;

/// What stood out in the sweeps of each sensor, and where the vehicle was.
#[derive(Debug, Default)]
pub(super) struct Yaws {
    odometry: Vec<(u64, Pose)>,
    sweeps: BTreeMap<u32, Vec<Sweep>>,
}

#[derive(Debug)]
struct Sweep {
    at_ns: u64,
    /// Where the vehicle was about then, east and north [m].
    near_m: [f64; 2],
    origin_m: [f32; 3],
    points_m: Vec<[f32; 3]>,
}

/// Two sweeps in the frame of the body, the later one with what takes it to the earlier one.
struct Pair {
    earlier: Raster,
    later_m: Vec<Point3<f64>>,
    between: Isometry3<f64>,
    origin_m: Point3<f64>,
}

/// Places seen from above, by cells as wide as points may lie apart.
struct Raster(HashMap<[i32; 2], Vec<[f64; 2]>>);

impl Yaws {
    pub fn note_odometry(&mut self, valid_at_ns: u64, record: &OdometryRecord) {
        let is_onward = self.odometry.last().is_none_or(|(last_ns, _)| *last_ns < valid_at_ns);
        if is_onward && self.odometry.len() < ODOMETRY_MAX {
            let [x_m, y_m, z_m] = record.position_m;
            let [roll_rad, pitch_rad, yaw_rad] = record.attitude_rad;
            self.odometry.push((valid_at_ns, Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }));
        }
    }

    /// Keeps what stands out in a sweep, where the vehicle has driven on since the last that was kept.
    pub fn note_scan(&mut self, header: &ScanHeader, points: &[PointRecord]) {
        let Some((_, Pose { x_m, y_m, .. })) = self.odometry.last() else { return };
        let near_m = [*x_m, *y_m];
        let sweeps = self.sweeps.entry(header.sensor).or_default();
        let is_onward = sweeps.last().is_none_or(|last| distance_m(last.near_m, near_m) >= STEP_M);
        // Of several sensors that are told in the body's frame, the first one is looked at.
        let is_same = sweeps.first().is_none_or(|first| first.origin_m == header.origin_m);
        if sweeps.len() == SWEEPS_MAX || !is_onward || !is_same {
            return;
        }
        let standing = points.iter().filter(|point| point.class_number >= STANDING);
        let points_m: Vec<[f32; 3]> = standing.map(|point| point.position_m).collect();
        let [least, most] = POINTS;
        if points_m.len() >= least {
            let every = points_m.len().div_ceil(most);
            let points_m = points_m.into_iter().step_by(every).collect();
            sweeps.push(Sweep {
                at_ns: header.stamp.valid_at_ns,
                near_m,
                origin_m: header.origin_m,
                points_m,
            });
        }
    }

    /// Of every sensor that was seen and that somebody has described.
    pub fn findings(&self, mounts: &[Mount]) -> Vec<Finding> {
        let of_sensor = |(&sensor, sweeps): (&u32, &Vec<Sweep>)| {
            let mount = match sensor {
                0 => Mount::default(),
                n => mounts.get(n as usize - 1)?.clone(),
            };
            let what =
                if sensor == 0 { "scans: yaw".to_owned() } else { format!("scans of sensor {sensor}: yaw") };
            Some(self.finding(what, sweeps, &mount))
        };
        self.sweeps.iter().filter_map(of_sensor).collect()
    }

    fn finding(&self, what: String, sweeps: &[Sweep], mount: &Mount) -> Finding {
        let unknown = |found: &str| Finding::new(what.clone(), Verdict::Unknown, found.to_owned());
        let pairs = self.pairs(sweeps, mount);
        if pairs.is_empty() {
            return unknown(match sweeps.len() {
                0 => {
                    "nothing stood out of the ground: drive past trees, posts or rocks, and it is held against the odometry"
                }
                _ => {
                    "it stood, or nothing stood out for long: drive some metres, and it is held against the odometry"
                }
            });
        }
        let Some(yaw_rad) = closest_rad(&pairs) else {
            return unknown(
                "what stood out looks the same however it is turned: drive past trees, posts or rocks",
            );
        };
        let side = if yaw_rad > 0.0 { "left" } else { "right" };
        let found = format!(
            "looks {:.1} degrees to the {side} of where it is said to (by {} pairs of scans and the odometry)",
            yaw_rad.abs().to_degrees(),
            pairs.len()
        );
        let verdict = match yaw_rad.abs() {
            angle_rad if angle_rad <= FINE_RAD => return Finding::new(what, Verdict::Fine, found),
            angle_rad if angle_rad <= BEARABLE_RAD => Verdict::Doubtful,
            _ => Verdict::Wrong,
        };
        let aside_m = 10.0 * libm::sin(yaw_rad.abs().min(std::f64::consts::FRAC_PI_2));
        let found = format!("{found}; what is 10 m ahead is taken to be {aside_m:.1} m beside its place");
        Finding::new(what, verdict, found)
    }

    fn pairs(&self, sweeps: &[Sweep], mount: &Mount) -> Vec<Pair> {
        let placed: Vec<(&Sweep, Pose)> =
            sweeps.iter().filter_map(|sweep| Some((sweep, self.pose(sweep.at_ns)?))).collect();
        let mut pairs = Vec::new();
        for (place, (earlier, from)) in placed.iter().enumerate() {
            for (later, to) in placed[place + 1..].iter().take(PARTNERS) {
                let way_m = distance_m([from.x_m, from.y_m], [to.x_m, to.y_m]);
                let is_soon = later.at_ns.saturating_sub(earlier.at_ns) as f64 * 1e-9 <= TIME_MAX_S;
                if is_soon && (WAY_M[0]..=WAY_M[1]).contains(&way_m) {
                    pairs.push((*earlier, *later, [from, to]));
                }
            }
        }
        let every = pairs.len().div_ceil(PAIRS_MAX).max(1);
        let kept = pairs.into_iter().step_by(every);
        kept.map(|(earlier, later, poses)| Pair::new(earlier, later, poses, mount)).collect()
    }

    /// Where the vehicle was, between the two odometries around that time.
    fn pose(&self, at_ns: u64) -> Option<Pose> {
        let place = self.odometry.partition_point(|(told_ns, _)| *told_ns < at_ns);
        let (after_ns, after) = self.odometry.get(place)?;
        let (before_ns, before) = self.odometry.get(place.saturating_sub(1))?;
        if *before_ns >= at_ns {
            return (*after_ns == at_ns).then_some(*after);
        }
        let share = (at_ns - before_ns) as f64 / (after_ns - before_ns) as f64;
        let between = |of: fn(&Pose) -> f64| of(before) + share * (of(after) - of(before));
        Some(Pose {
            x_m: between(|pose| pose.x_m),
            y_m: between(|pose| pose.y_m),
            z_m: between(|pose| pose.z_m),
            roll_rad: between(|pose| pose.roll_rad),
            pitch_rad: between(|pose| pose.pitch_rad),
            yaw_rad: before.yaw_rad + share * turned_rad(after.yaw_rad - before.yaw_rad),
        })
    }
}

impl Pair {
    fn new(earlier: &Sweep, later: &Sweep, [from, to]: [&Pose; 2], mount: &Mount) -> Self {
        let mounting = mount.isometry();
        let in_body = |place_m: &[f32; 3]| mounting * Point3::from(place_m.map(f64::from));
        let earlier_m: Vec<Point3<f64>> = earlier.points_m.iter().map(in_body).collect();
        Self {
            earlier: Raster::new(&earlier_m),
            later_m: later.points_m.iter().map(in_body).collect(),
            between: from.isometry().inverse() * to.isometry(),
            origin_m: in_body(&earlier.origin_m),
        }
    }

    /// How far the points of the later sweep lie from those of the earlier one, where the sensor is turned so.
    fn apart_m(&self, yaw_rad: f64) -> f64 {
        let (sine, cosine) = libm::sincos(0.5 * yaw_rad);
        let quaternion = nalgebra::Quaternion::new(cosine, 0.0, 0.0, sine);
        let turn = UnitQuaternion::new_unchecked(quaternion);
        let to_origin = Translation3::from(self.origin_m.coords);
        let turned = to_origin * turn * to_origin.inverse();
        // Both are turned; turned back, the earlier one lies as it did.
        let motion = turned.inverse() * self.between * turned;
        let places = self.later_m.iter().map(|place_m| motion * place_m);
        let sum_m: f64 = places.map(|place_m| self.earlier.nearest_m([place_m.x, place_m.y])).sum();
        sum_m / self.later_m.len() as f64
    }
}

impl Raster {
    fn new(places_m: &[Point3<f64>]) -> Self {
        let mut cells: HashMap<[i32; 2], Vec<[f64; 2]>> = HashMap::new();
        for place_m in places_m {
            let place_m = [place_m.x, place_m.y];
            cells.entry(place_m.map(cell)).or_default().push(place_m);
        }
        Self(cells)
    }

    /// Distance to the nearest place [m], as far as any counts.
    fn nearest_m(&self, place_m: [f64; 2]) -> f64 {
        let [col, row] = place_m.map(cell);
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [col + dx, row + dy]));
        let places = around.filter_map(|cell| self.0.get(&cell)).flatten();
        places.map(|other_m| distance_m(*other_m, place_m)).fold(APART_M, f64::min)
    }
}

/// The turn that brings the points of all pairs closest; `None` where others do as well.
fn closest_rad(pairs: &[Pair]) -> Option<f64> {
    let apart_m =
        |yaw_rad: f64| pairs.iter().map(|pair| pair.apart_m(yaw_rad)).sum::<f64>() / pairs.len() as f64;
    let least = |centre_rad: f64, step_rad: f64, n_steps: i32| {
        let tried = (-n_steps..=n_steps).map(|k| centre_rad + step_rad * f64::from(k));
        let judged = tried.map(|yaw_rad| (apart_m(yaw_rad), yaw_rad));
        judged.min_by(|one, other| one.0.total_cmp(&other.0)).map_or(centre_rad, |(_, yaw_rad)| yaw_rad)
    };
    let n_coarse = (std::f64::consts::PI / COARSE_RAD) as i32;
    let coarse_rad = least(0.0, COARSE_RAD, n_coarse);
    let best_rad = least(coarse_rad, FINE_STEP_RAD, (COARSE_RAD / FINE_STEP_RAD) as i32);
    let best_m = apart_m(best_rad);
    let is_told = [-WIDE_RAD, WIDE_RAD]
        .iter()
        .all(|turn_rad| apart_m(best_rad + turn_rad) > CONTRAST * best_m + CONTRAST_M);
    is_told.then_some(best_rad)
}

fn cell(along_m: f64) -> i32 {
    libm::floor(along_m / APART_M) as i32
}

fn distance_m([x_m, y_m]: [f64; 2], [other_x_m, other_y_m]: [f64; 2]) -> f64 {
    libm::hypot(x_m - other_x_m, y_m - other_y_m)
}

#[cfg(test)]
mod tests;
