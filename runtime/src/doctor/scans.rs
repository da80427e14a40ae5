//! Whether the range sensors see the ground where the wheels stand.

use std::collections::BTreeMap;

use bus::message::{PointRecord, ScanHeader};
use nalgebra::{Matrix3, Point3, Vector3};
use terrain::Mount;

use super::regularity::Regularity;
use super::{Finding, Verdict, median};

/// Points farther away than so many lengths of the vehicle say little of the ground that it stands on.
const NEAR_LENGTHS: f64 = 2.0;
/// The same where nobody has said how long it is [m].
const NEAR_M: f64 = 6.0;
/// Points that a plane is laid through at the least.
const LEAST_POINTS: usize = 30;
/// Scans of a sensor that are looked into, the first ones.
const SCANS_MAX: usize = 50;
/// Times that a plane is laid anew, without what stands out of the one before.
const N_FITS: usize = 6;
/// Deviations from a plane beyond which a point stands out, in medians of them.
const OUTLIER_MEDIANS: f64 = 3.0;
/// Deviation up to which no point stands out, however smooth the ground [m].
const SMOOTH_M: f64 = 0.01;
/// Slope of the ground against the vehicle that may be its springs, and what is more than any are [rad].
const FINE_RAD: f64 = 0.05;
const BEARABLE_RAD: f64 = 0.2;
/// Share of the wheels' radius by which the ground may lie higher or lower than where they stand.
const FINE_RADIUS_SHARE: f64 = 0.25;
/// Largest number of the classes of points.
const CLASS_MAX: u32 = 3;
/// Number of the class of obstacles, which are no ground.
const OBSTACLE: u32 = 3;

/// What was seen by each sensor: 0 = in the frame of the body.
#[derive(Debug, Default)]
pub(super) struct Scans(BTreeMap<u32, Seen>);

#[derive(Debug, Default)]
struct Seen {
    times: Regularity,
    n_points: Vec<f64>,
    n_of_class: [u64; CLASS_MAX as usize + 1],
    /// Points that may be ground, of each scan that is looked into, in the sensor's frame [m].
    ground_m: Vec<Vec<[f32; 3]>>,
}

/// The ground that a sensor sees, in the body frame.
#[derive(Clone, Copy, Debug)]
struct Ground {
    /// Height under the rear axle's centre, negative below it [m].
    height_m: f64,
    /// How much it rises to the front and to the left [-].
    rise: [f64; 2],
}

impl Scans {
    pub fn note(&mut self, header: &ScanHeader, points: &[PointRecord]) {
        let seen = self.0.entry(header.sensor).or_default();
        seen.times.note(&header.stamp);
        seen.n_points.push(points.len() as f64);
        points.iter().for_each(|point| seen.n_of_class[point.class_number.min(CLASS_MAX) as usize] += 1);
        if seen.ground_m.len() < SCANS_MAX {
            let ground = points.iter().filter(|point| point.class_number != OBSTACLE);
            seen.ground_m.push(ground.map(|point| point.position_m).collect());
        }
    }

    /// Of every sensor that is described or was seen. The rate is that of all together.
    pub fn findings(
        &self,
        expected_hz: Option<f64>,
        mounts: &[Mount],
        wheel_and_length_m: Option<[f64; 2]>,
        watched_s: f64,
    ) -> Vec<Finding> {
        let described = 1..=mounts.len() as u32;
        let silent = described.filter(|sensor| !self.0.contains_key(sensor)).map(|sensor| {
            let found = format!("0 scans in {watched_s:.1} s, but the robot file describes it");
            Finding::new(name(sensor), Verdict::Wrong, found)
        });
        let mut findings: Vec<Finding> = silent.collect();
        if self.0.is_empty() && findings.is_empty() {
            findings.push(Regularity::default().finding("scans", expected_hz, watched_s));
        }
        let n_seen = self.0.len() as f64;
        for (&sensor, seen) in &self.0 {
            let hz = expected_hz.map(|hz| hz / n_seen);
            findings.push(seen.times.finding(&name(sensor), hz, watched_s));
            findings.push(seen.points(sensor));
            let mount = match sensor {
                0 => Some(Mount::default()),
                n => mounts.get(n as usize - 1).cloned(),
            };
            findings.push(match mount {
                Some(mount) => seen.extrinsics(sensor, &mount, wheel_and_length_m),
                None => Finding::new(
                    format!("{}: mount", name(sensor)),
                    Verdict::Wrong,
                    format!("expected one of the {} sensors of the robot file", mounts.len()),
                ),
            });
        }
        findings
    }
}

fn name(sensor: u32) -> String {
    if sensor == 0 { "scans".to_owned() } else { format!("scans of sensor {sensor}") }
}

impl Seen {
    fn points(&self, sensor: u32) -> Finding {
        let n = median(self.n_points.iter().copied()).unwrap_or(0.0);
        let all = self.n_of_class.iter().sum::<u64>().max(1) as f64;
        let share = |class: usize| 100.0 * self.n_of_class[class] as f64 / all;
        let found = format!(
            "{n:.0} a scan, {:.0} % open ground, {:.0} % loose, {:.0} % plants, {:.0} % obstacles",
            share(0),
            share(1),
            share(2),
            share(3)
        );
        let what = format!("{}: points", name(sensor));
        if n < LEAST_POINTS as f64 {
            return Finding::new(what, Verdict::Wrong, format!("{found}; nothing can be mapped with so few"));
        }
        Finding::new(what, Verdict::Fine, found)
    }

    /// Whether the plane through what is near lies under the wheels, as it should on even ground.
    fn extrinsics(&self, sensor: u32, mount: &Mount, wheel_and_length_m: Option<[f64; 2]>) -> Finding {
        let what = format!("{}: mount", name(sensor));
        let near_m = wheel_and_length_m.map_or(NEAR_M, |[_, length_m]| NEAR_LENGTHS * length_m);
        let grounds: Vec<Ground> =
            self.ground_m.iter().filter_map(|points_m| Ground::under(points_m, mount, near_m)).collect();
        let middle = |of: fn(&Ground) -> f64| median(grounds.iter().map(of));
        let (Some(height_m), Some(ahead), Some(left)) = (
            middle(|ground| ground.height_m),
            middle(|ground| ground.rise[0]),
            middle(|ground| ground.rise[1]),
        ) else {
            let found =
                format!("fewer than {LEAST_POINTS} points of ground within {near_m:.1} m in every scan");
            return Finding::new(what, Verdict::Unknown, found);
        };
        let [ahead_rad, left_rad] = [ahead, left].map(libm::atan);
        let mut found = format!(
            "ground {:.2} m below the rear axle, rising {:.1} degrees ahead and {:.1} to the left (median of {} scans)",
            -height_m,
            ahead_rad.to_degrees(),
            left_rad.to_degrees(),
            grounds.len()
        );
        let steepest_rad = ahead_rad.abs().max(left_rad.abs());
        let off_share =
            wheel_and_length_m.map_or(0.0, |[radius_m, _]| (height_m + radius_m).abs() / radius_m);
        if let Some([radius_m, _]) = wheel_and_length_m {
            found += &format!(", wheels {radius_m:.2} m");
        }
        let verdict = match (steepest_rad, off_share) {
            (steepest, share) if steepest > BEARABLE_RAD || share > 1.0 => Verdict::Wrong,
            (steepest, share) if steepest > FINE_RAD || share > FINE_RADIUS_SHARE => Verdict::Doubtful,
            _ => return Finding::new(what, Verdict::Fine, found),
        };
        found += "; on level ground that is what the mount's attitude and height are off by, elsewhere look again there";
        Finding::new(what, verdict, found)
    }
}

impl Ground {
    /// The plane through points that are near, by least squares, laid anew without what stands out: plants, stones and
    /// people.
    fn under(points_m: &[[f32; 3]], mount: &Mount, near_m: f64) -> Option<Self> {
        let isometry = mount.isometry();
        let in_body = points_m.iter().map(|place_m| isometry * Point3::from(place_m.map(f64::from)));
        let is_own = |place_m: &Point3<f64>| mount.own_body.iter().any(|own| own.contains((*place_m).into()));
        let is_near = |place_m: &Point3<f64>| libm::hypot(place_m.x, place_m.y) < near_m && !is_own(place_m);
        let near: Vec<Point3<f64>> = in_body.filter(is_near).collect();
        let mut ground = Self { height_m: 0.0, rise: [0.0; 2] };
        let mut within_m = f64::INFINITY;
        for _ in 0..N_FITS {
            let kept = near.iter().filter(|place_m| ground.above_m(place_m).abs() <= within_m);
            ground = Self::through(kept)?;
            let deviation_m = median(near.iter().map(|place_m| ground.above_m(place_m).abs()))?;
            within_m = (OUTLIER_MEDIANS * deviation_m).max(SMOOTH_M);
        }
        Some(ground)
    }

    fn through<'a>(points_m: impl Iterator<Item = &'a Point3<f64>>) -> Option<Self> {
        let (mut normal, mut right, mut n) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for place_m in points_m {
            let row = Vector3::new(place_m.x, place_m.y, 1.0);
            normal += row * row.transpose();
            right += row * place_m.z;
            n += 1;
        }
        let solved = normal.cholesky().filter(|_| n >= LEAST_POINTS)?.solve(&right);
        Some(Self { height_m: solved.z, rise: [solved.x, solved.y] })
    }

    fn above_m(&self, place_m: &Point3<f64>) -> f64 {
        place_m.z - self.height_m - self.rise[0] * place_m.x - self.rise[1] * place_m.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_M: f64 = 0.45;

    /// Level ground below the axle, seen by a sensor that sits so: a lattice of half a metre, every seventh place
    /// covered by a box of a metre.
    fn seen_from(truth: &Mount) -> Scans {
        let to_sensor = truth.isometry().inverse();
        let place = |k: i32| {
            let (x_m, y_m) = (0.5 * f64::from(k % 25) - 6.0, 0.5 * f64::from(k / 25) - 6.0);
            let z_m = if k % 7 == 0 { 1.0 - RADIUS_M } else { -RADIUS_M };
            let seen_m = to_sensor * Point3::new(x_m, y_m, z_m);
            PointRecord { position_m: [seen_m.x, seen_m.y, seen_m.z].map(|v| v as f32), class_number: 0 }
        };
        let points: Vec<PointRecord> = (0..625).map(place).collect();
        let mut scans = Scans::default();
        for k in 1..=10 {
            let mut header = ScanHeader { sensor: 1, ..ScanHeader::default() };
            header.stamp.valid_at_ns = k * 200_000_000;
            header.stamp.published_at_ns = header.stamp.valid_at_ns;
            scans.note(&header, &points);
        }
        scans
    }

    fn mount(pitch_rad: f64, height_m: f64) -> Mount {
        Mount { position_m: [1.0, 0.0, height_m], attitude_rad: [0.0, pitch_rad, 0.0], ..Mount::default() }
    }

    fn of_mount(stated: &Mount, truth: &Mount) -> Finding {
        let stated = std::slice::from_ref(stated);
        let findings = seen_from(truth).findings(Some(5.0), stated, Some([RADIUS_M, 3.4]), 2.0);
        assert_eq!(findings[0].verdict, Verdict::Fine, "{findings:?}");
        findings.into_iter().find(|finding| finding.what.ends_with("mount")).unwrap()
    }

    #[test]
    fn a_sensor_that_sits_where_it_is_said_to_sees_the_ground_under_the_wheels() {
        let found = of_mount(&mount(0.3, 1.8), &mount(0.3, 1.8));
        assert_eq!(found.verdict, Verdict::Fine, "{found:?}");
        assert!(found.found.starts_with("ground 0.45 m below the rear axle, rising"), "{found:?}");
    }

    /// Said to look down by 0.1 rad less than it does, the ground ahead seems to rise by 0.1 rad, 5.7 degrees.
    #[test]
    fn a_sensor_that_leans_is_found_out_with_its_angle() {
        let found = of_mount(&mount(0.2, 1.8), &mount(0.3, 1.8));
        assert_eq!(found.verdict, Verdict::Doubtful, "{found:?}");
        assert!(found.found.contains("rising 5.7 degrees ahead and"), "{found:?}");
        assert_eq!(of_mount(&mount(0.0, 1.8), &mount(0.3, 1.8)).verdict, Verdict::Wrong);
    }

    #[test]
    fn a_sensor_that_hangs_lower_is_found_out_with_its_height() {
        let found = of_mount(&mount(0.3, 2.0), &mount(0.3, 1.8));
        assert_eq!(found.verdict, Verdict::Doubtful);
        assert!(found.found.contains("ground 0.25 m below"), "{found:?}");
    }

    #[test]
    fn a_sensor_that_is_silent_or_that_nobody_describes_is_wrong() {
        let two = [mount(0.3, 1.8), mount(0.0, 1.0)];
        let findings = seen_from(&two[0]).findings(None, &two, None, 2.0);
        assert_eq!((findings[0].what.as_str(), findings[0].verdict), ("scans of sensor 2", Verdict::Wrong));
        let unknown = seen_from(&two[0]).findings(None, &[], None, 2.0);
        assert!(
            unknown
                .iter()
                .any(|finding| finding.what.ends_with("mount") && finding.verdict == Verdict::Wrong)
        );
        let nothing = Scans::default().findings(Some(5.0), &[], None, 2.0);
        assert_eq!(nothing[0].verdict, Verdict::Wrong);
    }

    #[test]
    fn too_few_points_are_no_plane() {
        assert!(Ground::under(&[[1.0, 0.0, -0.4]; 10], &Mount::default(), 6.0).is_none());
        let line: Vec<[f32; 3]> = (0..100).map(|k| [0.05 * k as f32, 0.0, -0.4]).collect();
        assert!(Ground::under(&line, &Mount::default(), 6.0).is_none(), "a line lies in many planes");
    }
}
