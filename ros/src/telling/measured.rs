//! What was measured, as a robot would have said it in ROS.

use bus::message::ImuRecord;
use terrain::{Pose, Scan};

use crate::message::{
    Header, Imu, Odometry, Point, PointCloud2, PointField, Pose as SaidPose, PoseWithCovariance, TfMessage,
    Transform, TransformStamped, Twist, TwistWithCovariance, Vector3,
};
use crate::rigid;

/// What `sensor_msgs` calls an `f32` and a byte.
const FLOAT32: u8 = 7;
const UINT8: u8 = 2;
/// Bytes of a point: x, y, z [m] as `f32`, the class as a byte, and three bytes that keep the next one's numbers even.
const POINT_BYTES: u32 = 16;

/// Where the vehicle is in the frame of the header and how it moves: forward, left [m/s] and yaw rate [rad/s]. How sure
/// that is nobody said.
pub fn odometry(
    header: Header,
    vehicle_frame: &str,
    pose: &Pose,
    velocity_mps: [f64; 2],
    yaw_rate_radps: f64,
) -> Odometry {
    let [x, y] = velocity_mps;
    let linear = Vector3 { x, y, z: 0.0 };
    let angular = Vector3 { z: yaw_rate_radps, ..Vector3::default() };
    let position = Point { x: pose.x_m, y: pose.y_m, z: pose.z_m };
    let orientation = rigid::quaternion_of(&pose.isometry().rotation);
    Odometry {
        header,
        child_frame_id: vehicle_frame.to_owned(),
        pose: PoseWithCovariance { pose: SaidPose { position, orientation }, ..Default::default() },
        twist: TwistWithCovariance { twist: Twist { linear, angular }, ..Default::default() },
    }
}

/// Where odometry has the vehicle, as a transform of its frames.
pub fn transforms(odometry: &Odometry) -> TfMessage {
    let SaidPose { position: Point { x, y, z }, orientation } = odometry.pose.pose;
    let transform = Transform { translation: Vector3 { x, y, z }, rotation: orientation };
    let (header, child_frame_id) = (odometry.header.clone(), odometry.child_frame_id.clone());
    TfMessage { transforms: vec![TransformStamped { header, child_frame_id, transform }] }
}

/// What the inertial unit felt; of its own attitude it says nothing, as ROS has it said.
pub fn imu(header: Header, sample: &ImuRecord) -> Imu {
    let vector = |[x, y, z]: [f32; 3]| Vector3 { x: x.into(), y: y.into(), z: z.into() };
    let mut orientation_covariance = [0.0; 9];
    orientation_covariance[0] = -1.0;
    Imu {
        header,
        orientation_covariance,
        angular_velocity: vector(sample.angular_rate_radps),
        linear_acceleration: vector(sample.acceleration_mps2),
        ..Imu::default()
    }
}

/// A sweep in the frame of the header; the field `class` says 0 open, 1 loose, 2 vegetation, 3 obstacle.
pub fn cloud(header: Header, scan: &Scan) -> PointCloud2 {
    let field =
        |name: &str, offset, datatype| PointField { name: name.to_owned(), offset, datatype, count: 1 };
    let bytes = |point: &terrain::RangePoint| {
        let [x, y, z] = point.position_m.map(f32::to_le_bytes);
        [x, y, z, [point.class as u8, 0, 0, 0]].concat()
    };
    PointCloud2 {
        header,
        height: 1,
        width: scan.points.len() as u32,
        fields: vec![
            field("x", 0, FLOAT32),
            field("y", 4, FLOAT32),
            field("z", 8, FLOAT32),
            field("class", 12, UINT8),
        ],
        is_bigendian: false,
        point_step: POINT_BYTES,
        row_step: POINT_BYTES * scan.points.len() as u32,
        data: scan.points.iter().flat_map(bytes).collect(),
        is_dense: scan.points.iter().all(|point| point.position_m.iter().all(|axis_m| axis_m.is_finite())),
    }
}
