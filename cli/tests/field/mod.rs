//! A field with posts as a lidar sees it, for bags.

use nalgebra::{Isometry3, Point3, Vector3 as Axes};
use ros::message::{Header, PointCloud2, Time};
use ros::telling;
use terrain::{Pose, RangePoint, Scan, TerrainClass};

pub const BEGAN_NS: u64 = 1_700_000_000_000_000_000;
/// Posts of 4 cm radius and half a metre of height beside the way, east and north [m].
const POSTS_M: [[f64; 2]; 8] =
    [[1.0, 0.8], [1.6, -0.9], [2.4, 1.1], [3.0, -0.7], [3.9, 0.9], [4.4, -1.2], [0.2, -1.1], [5.0, 0.6]];
const POST_RADIUS_M: f64 = 0.04;
const POST_HEIGHT_M: f64 = 0.5;

pub fn header(at_ns: u64, frame: &str) -> Header {
    Header { stamp: Time::from_nanoseconds((BEGAN_NS + at_ns) as i64), frame_id: frame.to_owned() }
}

/// Where a ray ends: on a post, or on the level ground at this height, within 6 m.
fn hit(eye: &Point3<f64>, ray: &Axes<f64>, ground_m: f64) -> Option<f64> {
    let flat2 = ray.x * ray.x + ray.y * ray.y;
    let post = |[x_m, y_m]: [f64; 2]| {
        let [dx, dy] = [x_m - eye.x, y_m - eye.y];
        let along = (ray.x * dx + ray.y * dy) / flat2;
        let aside2_m2 = (dx * dx + dy * dy) - along * along * flat2;
        let inside = (POST_RADIUS_M * POST_RADIUS_M - aside2_m2) / flat2;
        let range_m = along - inside.max(0.0).sqrt();
        let is_on = (ground_m..=POST_HEIGHT_M).contains(&(eye.z + range_m * ray.z));
        (inside > 0.0 && range_m > 0.0 && is_on).then_some(range_m)
    };
    let ground = (ray.z < 0.0).then(|| (ground_m - eye.z) / ray.z);
    let ranges = POSTS_M.iter().filter_map(|place_m| post(*place_m)).chain(ground);
    ranges.min_by(f64::total_cmp).filter(|range_m| *range_m < 6.0)
}

/// What a lidar sees of it, of this mount on a vehicle whose rear axle lies `axle_m` above the ground. Rays go to both
/// sides of the horizon, so that it may hang upside down.
pub fn cloud(at_ns: u64, vehicle: &Pose, mount: &Pose, axle_m: f64) -> PointCloud2 {
    let sensor: Isometry3<f64> = vehicle.isometry() * mount.isometry();
    let rays = (-24..=24).flat_map(|ring| (0..360).map(move |azimuth| (ring, azimuth)));
    let points = rays.filter_map(|(ring, azimuth)| {
        let (up, round) = ((2.5 * f64::from(ring)).to_radians(), f64::from(azimuth).to_radians());
        let ray = Axes::new(up.cos() * round.cos(), up.cos() * round.sin(), up.sin());
        let range_m = hit(&Point3::from(sensor.translation.vector), &(sensor.rotation * ray), -axle_m)?;
        let position_m = (ray * range_m).map(|axis_m| axis_m as f32).into();
        Some(RangePoint { position_m, class: TerrainClass::Open })
    });
    telling::cloud(header(at_ns, "lidar"), &Scan { points: points.collect(), ..Scan::default() })
}
