//! What the robot is told, as ROS says it.

mod layers;
mod markers;
mod measured;

use bicycle::{Command, Limits};
use nalgebra::UnitQuaternion;
use terrain::GridGeometry;
use traversability::{GroundFlags, RiskMapView};

use crate::message::{
    AckermannDrive, AckermannDriveStamped, DiagnosticStatus, Header, KeyValue, MapMetaData, OccupancyGrid,
    Path, Point, Pose, PoseStamped, Twist, TwistStamped, Vector3,
};
use crate::rigid;
pub use layers::grid_map;
pub use markers::{futures, moving, plan as plan_markers};
pub use measured::{cloud, imu, odometry, transforms};

/// Occupancy of a cell that must not be touched.
const OBSTACLE: i8 = 100;
/// Greatest occupancy of one that may be driven on.
const WORST: f64 = 99.0;
/// Occupancy of one that nothing is known of.
const UNKNOWN: i8 = -1;

/// A command for a vehicle that takes speed and steering angle. To stand is no speed, with the wheels as they are.
pub fn ackermann(header: Header, command: Command) -> AckermannDriveStamped {
    let Command { speed_mps: speed, steering_rad: steering_angle } = command;
    AckermannDriveStamped {
        header,
        drive: AckermannDrive { steering_angle, speed, ..AckermannDrive::default() },
    }
}

/// A command for a vehicle that takes velocity and yaw rate of its rear axle's centre: those that the steering angle
/// makes of the speed without slip.
pub fn twist(header: Header, command: Command, wheelbase_m: f64) -> TwistStamped {
    let [speed_mps, steering_rad] = [command.speed_mps, command.steering_rad].map(f64::from);
    let linear = Vector3 { x: speed_mps, ..Vector3::default() };
    let angular = Vector3 { z: speed_mps * steering_rad.tan() / wheelbase_m, ..Vector3::default() };
    TwistStamped { header, twist: Twist { linear, angular } }
}

/// A way through the map: east, north [m] and yaw [rad] of each pose.
pub fn path(header: Header, poses: impl IntoIterator<Item = [f64; 3]>) -> Path {
    let stamped = |[x, y, yaw_rad]: [f64; 3]| {
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
        let orientation = rigid::quaternion_of(&rotation);
        PoseStamped { header: header.clone(), pose: Pose { position: Point { x, y, z: 0.0 }, orientation } }
    };
    let poses = poses.into_iter().map(stamped).collect();
    Path { header, poses }
}

/// A risk map as an occupancy grid. Obstacles are 100, what was never seen is -1. Other cells are as risky as in their
/// worst heading: 99 where roll or pitch reaches the vehicle's limit or nothing of the forward speed is left.
pub fn occupancy(header: Header, map: &RiskMapView<'_>, limits: &Limits) -> OccupancyGrid {
    let GridGeometry { resolution_m, origin, n_rows, n_cols } = map.geometry;
    let data = map.ground.iter().zip(map.risks.chunks(map.n_yaws)).map(|(ground, risks)| {
        if ground.flags.contains(GroundFlags::OBSTACLE) {
            return OBSTACLE;
        }
        if ground.flags.contains(GroundFlags::UNKNOWN) {
            return UNKNOWN;
        }
        let shares = risks.iter().flat_map(|risk| {
            [
                f64::from(risk.roll_rad.abs()) / limits.roll_max_rad,
                f64::from(risk.pitch_rad.abs()) / limits.pitch_max_rad,
                1.0 - f64::from(risk.linear_traction),
            ]
        });
        // What is no number is as bad as can be.
        let worse = |worst: f64, share: f64| if share.is_nan() { 1.0 } else { worst.max(share) };
        (WORST * shares.fold(0.0, worse).clamp(0.0, 1.0)).round() as i8
    });
    let [x, y] = origin.map(|index| index as f64 * resolution_m);
    OccupancyGrid {
        info: MapMetaData {
            map_load_time: header.stamp,
            resolution: resolution_m as f32,
            width: n_cols as u32,
            height: n_rows as u32,
            origin: Pose { position: Point { x, y, z: 0.0 }, ..Pose::default() },
        },
        header,
        data: data.collect(),
    }
}

/// The state of one part: `level` 0 well, 1 warning, 2 error.
pub fn status(level: u8, name: &str, message: String, values: &[(&str, String)]) -> DiagnosticStatus {
    let value = |(key, value): &(&str, String)| KeyValue { key: (*key).to_owned(), value: value.clone() };
    DiagnosticStatus {
        level,
        name: name.to_owned(),
        message,
        hardware_id: "surefoot".to_owned(),
        values: values.iter().map(value).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use traversability::{Ground, Risk};

    #[test]
    fn a_twist_turns_as_the_bicycle_does() {
        let told = twist(Header::default(), Command { speed_mps: 2.0, steering_rad: 0.5 }, 2.5);
        // v tan(delta) / L.
        assert!((told.twist.angular.z - 2.0 * 0.546_302_489_843_790_5 / 2.5).abs() < 1e-7);
        assert!((told.twist.linear.x - 2.0).abs() < 1e-12);
        let back = twist(Header::default(), Command { speed_mps: -1.0, steering_rad: 0.5 }, 2.5);
        assert!(back.twist.angular.z < 0.0, "backwards with the wheels to the left it turns right");
        let stands = twist(Header::default(), Command { speed_mps: 0.0, steering_rad: 0.5 }, 2.5);
        assert_eq!(stands.twist, Twist::default());
        let drive = ackermann(Header::default(), Command { speed_mps: -1.0, steering_rad: 0.5 }).drive;
        assert_eq!((drive.speed, drive.steering_angle, drive.acceleration), (-1.0, 0.5, 0.0));
    }

    #[test]
    fn cells_are_as_occupied_as_in_their_worst_heading() {
        let limits = Limits {
            speed_max_mps: 2.0,
            reverse_speed_max_mps: 0.5,
            steering_max_rad: 0.4,
            steering_rate_max_radps: 1.0,
            acceleration_max_mps2: 2.0,
            lateral_acceleration_max_mps2: 3.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.25,
        };
        let geometry = GridGeometry { resolution_m: 0.5, origin: [-4, 6], n_rows: 2, n_cols: 3 };
        let (mut risks, mut ground) = ([Risk::NONE; 12], [Ground::default(); 6]);
        let nan = f32::NAN;
        let set = [
            (0, 1, Risk { roll_rad: -0.25, ..Risk::NONE }, 0),
            (1, 0, Risk { pitch_rad: 0.25, ..Risk::NONE }, 0),
            (2, 1, Risk { linear_traction: 0.2, ..Risk::NONE }, 0),
            (3, 0, Risk { roll_rad: nan, ..Risk::NONE }, 0),
            (4, 0, Risk::NONE, GroundFlags::OBSTACLE.0),
            (5, 0, Risk::NONE, GroundFlags::UNKNOWN.0),
        ];
        for (cell, yaw, risk, flags) in set {
            risks[2 * cell + yaw] = risk;
            ground[cell].flags = GroundFlags(flags);
        }
        let map = RiskMapView::new(geometry, 2, &risks, &ground).unwrap();
        let grid = occupancy(Header::default(), &map, &limits);
        assert_eq!(grid.data, [50, 99, 79, 99, 100, -1]);
        assert_eq!((grid.info.width, grid.info.height), (3, 2));
        let Point { x, y, .. } = grid.info.origin.position;
        assert_eq!((x, y), (-2.0, 3.0));
    }
}
