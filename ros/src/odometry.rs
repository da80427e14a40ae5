//! Odometry of any frame as that of the rear axle's centre in the map.

mod agreement;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use bus::message::OdometryRecord;

use crate::message::Odometry;
use crate::rigid::{self, PoseError};
use crate::transforms::{TransformError, Transforms};
pub use agreement::{Agreement, Disagreement};

/// Why odometry tells nothing of the vehicle. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OdometryError {
    /// It does not say whose pose it is.
    #[error("child_frame_id: expected the frame whose pose it is, found none")]
    NoChild,
    /// Pose or twist are no numbers.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// Its frames are not joined to those of the map and the vehicle.
    #[error(transparent)]
    Transform(#[from] TransformError),
}

/// The frames that the vehicle drives in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames {
    /// The map's: x east, y north, z up.
    pub map: String,
    /// The vehicle's: forward, left, up at the rear axle's centre.
    pub vehicle: String,
}

/// Odometry of the rear axle's centre in the map, at the time of its stamp. What the wheels do is told by the velocity,
/// and what was applied is left to whoever knows.
///
/// # Errors
/// See [`OdometryError`].
pub fn odometry_record(
    odometry: &Odometry,
    transforms: &Transforms,
    frames: &Frames,
) -> Result<OdometryRecord, OdometryError> {
    let at_ns = odometry.header.stamp.nanoseconds();
    if odometry.child_frame_id.is_empty() {
        return Err(OdometryError::NoChild);
    }
    let child = rigid::motion_of_pose(&odometry.pose.pose)?;
    let to_map = transforms.between(&odometry.header.frame_id, &frames.map, at_ns)?;
    let vehicle_in_child = transforms.between(&frames.vehicle, &odometry.child_frame_id, at_ns)?;
    let twist = &odometry.twist.twist;
    let velocity = rigid::axes("twist.linear", twist.linear)?;
    let rate = rigid::axes("twist.angular", twist.angular)?;
    let vehicle = to_map * child * vehicle_in_child;
    let (velocity, rate) = carried([velocity, rate], &vehicle_in_child);
    let (roll, pitch, yaw) = vehicle.rotation.euler_angles();
    Ok(OdometryRecord {
        position_m: vehicle.translation.vector.into(),
        attitude_rad: [roll, pitch, yaw],
        velocity_mps: [velocity.x, velocity.y],
        yaw_rate_radps: rate.z,
        wheel_speed_mps: velocity.x,
        ..OdometryRecord::default()
    })
}

/// Takes the vehicle's frame to the map's, as the bus says it.
pub fn motion_of_record(record: &OdometryRecord) -> Isometry3<f64> {
    let [roll_rad, pitch_rad, yaw_rad] = record.attitude_rad;
    let rotation = UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
    Isometry3::from_parts(Translation3::from(record.position_m), rotation)
}

/// Velocity and angular rate of a rigid body in another of its frames, which lies in the first as `frame` says.
fn carried([velocity, rate]: [Vector3<f64>; 2], frame: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let arm = frame.translation.vector;
    let there = velocity + rate.cross(&arm);
    (frame.rotation.inverse_transform_vector(&there), frame.rotation.inverse_transform_vector(&rate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{
        Header, Point, Pose, PoseWithCovariance, Quaternion, Time, Twist, TwistWithCovariance,
        Vector3 as Said,
    };

    fn frames() -> Frames {
        Frames { map: "map".into(), vehicle: "rear_axle".into() }
    }

    fn turned(yaw_rad: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad)
    }

    /// Drives in a circle to the left: 2 m/s, 0.5 rad/s, told at a frame of its own.
    fn circling(yaw_rad: f64) -> Odometry {
        let orientation = rigid::quaternion_of(&turned(yaw_rad));
        let position = Point { x: 4.0, y: 1.0, z: 0.2 };
        let linear = Said { x: 2.0, y: 0.0, z: 0.0 };
        let angular = Said { x: 0.0, y: 0.0, z: 0.5 };
        Odometry {
            header: Header { stamp: Time { sec: 5, nanosec: 0 }, frame_id: "odom".into() },
            child_frame_id: "base".into(),
            pose: PoseWithCovariance { pose: Pose { position, orientation }, ..Default::default() },
            twist: TwistWithCovariance { twist: Twist { linear, angular }, ..Default::default() },
        }
    }

    fn tree(vehicle: Isometry3<f64>, map: Isometry3<f64>) -> Transforms {
        let mut tree = Transforms::new(500_000_000);
        tree.fix("base", "rear_axle", vehicle);
        tree.place("map", "odom", 5_000_000_000, map);
        tree
    }

    fn close(one: &[f64], other: &[f64]) {
        assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-12), "{one:?} {other:?}");
    }

    #[test]
    fn a_lever_arm_adds_what_the_turn_moves_it_by() {
        // 1.5 m behind and 0.3 m to the left of where it is told.
        let behind = Isometry3::translation(-1.5, 0.3, -0.1);
        let record =
            odometry_record(&circling(0.0), &tree(behind, Isometry3::identity()), &frames()).unwrap();
        close(&record.position_m, &[2.5, 1.3, 0.1]);
        // v + w x r = (2 - 0.5 * 0.3, 0.5 * -1.5).
        close(&record.velocity_mps, &[1.85, -0.75]);
        close(&[record.yaw_rate_radps, record.wheel_speed_mps], &[0.5, 1.85]);
    }

    #[test]
    fn a_frame_that_looks_backwards_drives_backwards() {
        let backwards = Isometry3::from_parts(Translation3::identity(), turned(std::f64::consts::PI));
        let record =
            odometry_record(&circling(0.0), &tree(backwards, Isometry3::identity()), &frames()).unwrap();
        close(&record.velocity_mps, &[-2.0, 0.0]);
        close(&[record.attitude_rad[2].abs()], &[std::f64::consts::PI]);
    }

    #[test]
    fn the_map_is_reached_by_way_of_the_odometrys_frame() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let map = Isometry3::from_parts(Translation3::new(10.0, 20.0, 0.0), turned(quarter));
        let record = odometry_record(&circling(0.4), &tree(Isometry3::identity(), map), &frames()).unwrap();
        // A quarter turn takes (4, 1) to (-1, 4).
        close(&record.position_m, &[9.0, 24.0, 0.2]);
        close(&record.attitude_rad, &[0.0, 0.0, quarter + 0.4]);
        close(&record.velocity_mps, &[2.0, 0.0]);
    }

    #[test]
    fn frames_that_nobody_has_told_of_are_named() {
        let told = |odometry: &Odometry, tree: &Transforms| {
            odometry_record(odometry, tree, &frames()).unwrap_err().to_string()
        };
        let whole = tree(Isometry3::identity(), Isometry3::identity());
        let empty = Transforms::new(0);
        assert!(told(&circling(0.0), &empty).starts_with("frame \"odom\": expected transforms on /tf"));
        let lost = Odometry { child_frame_id: String::new(), ..circling(0.0) };
        assert!(told(&lost, &whole).starts_with("child_frame_id: expected"));
        let mut late = circling(0.0);
        late.header.stamp.sec = 6;
        let text = told(&late, &whole);
        assert!(text.contains("at most 0.50 s away from the message, found one 1.00 s away"), "{text}");
        let mut wild = circling(0.0);
        wild.twist.twist.linear.y = f64::INFINITY;
        assert!(told(&wild, &whole).starts_with("twist.linear: expected finite numbers"));
        let mut flat = circling(0.0);
        flat.pose.pose.orientation = Quaternion { w: 0.0, ..Quaternion::default() };
        assert!(told(&flat, &whole).starts_with("orientation: expected a quaternion of norm 1"));
    }
}
