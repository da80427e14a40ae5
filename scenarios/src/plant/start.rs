//! Where a vehicle stands before it sinks into its springs.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::PlantError;
use super::ground::Ground;
use super::rest::Stance;

/// Refuses a start at which a wheel would stand outside the world.
pub(super) fn check_start(stance: &Stance, ground: &Ground, start: [f64; 3]) -> Result<(), PlantError> {
    let level = Isometry3::rotation(Vector3::z() * start[2]);
    for hub_m in stance.hub_m {
        let off_m = level * hub_m;
        let found_m = [start[0] + off_m.x, start[1] + off_m.y];
        if !ground.contains(found_m[0], found_m[1]) {
            return Err(PlantError::StartOutside { extent_m: ground.extent_m(), found_m });
        }
    }
    Ok(())
}

/// A pose in which the deepest wheel stands as deep as at rest and the body follows the ground under the wheels.
/// `depths_m` tells of a wheel by its number, hub and axle how far the ground reaches above its unloaded tread, and how
/// far it does at rest [m].
pub(super) fn standing(
    stance: &Stance,
    ground: &Ground,
    start: [f64; 3],
    depths_m: impl Fn(usize, Vector3<f64>, Vector3<f64>) -> [f64; 2],
) -> Isometry3<f64> {
    let [x_m, y_m, yaw_rad] = start;
    let level = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
    let heights_m = stance.hub_m.map(|hub_m| {
        let off_m = level * hub_m;
        ground.height_m(x_m + off_m.x, y_m + off_m.y)
    });
    let [front_left, front_right, rear_left, rear_right] = heights_m;
    let wheelbase_m = stance.hub_m[0].x;
    let track_m = stance.hub_m[0].y - stance.hub_m[1].y;
    let pitch_rad = ((rear_left + rear_right - front_left - front_right) / (2.0 * wheelbase_m)).atan();
    let roll_rad = ((front_left + rear_left - front_right - rear_right) / (2.0 * track_m)).atan();
    let rotation = UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
    let left = rotation * Vector3::y();
    let lowest_m = 0.5 * (rear_left + rear_right);
    let height_m = stance.hub_m.iter().enumerate().map(|(i, hub_m)| {
        let hub_m = Vector3::new(x_m, y_m, lowest_m) + rotation * hub_m;
        let [depth_m, at_rest_m] = depths_m(i, hub_m, left);
        lowest_m + depth_m - at_rest_m
    });
    let z_m = height_m.fold(f64::NEG_INFINITY, f64::max);
    Isometry3::from_parts(Translation3::new(x_m, y_m, z_m), rotation)
}
