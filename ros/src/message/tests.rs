//! Messages against the bytes that rclpy of ROS 2 Jazzy makes of the same; `ros/tests/recorded.py` wrote them.

use super::*;
use byteorder::LittleEndian;
use cdr_encoding::{from_bytes, to_vec};
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// What comes before a message: two bytes that say the order of bytes, two without a meaning.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Reads a recording as the message that is expected, and writes that as the recording.
fn same<M: Serialize + DeserializeOwned + PartialEq + Debug>(recorded: &[u8], expected: M) {
    let payload = recorded.strip_prefix(&ENCAPSULATION).unwrap();
    let (read, n_read) = from_bytes::<M, LittleEndian>(payload).unwrap();
    assert_eq!(read, expected);
    let written = to_vec::<M, LittleEndian>(&expected).unwrap();
    assert_eq!(written.len(), n_read);
    // Bytes that fill up to where the next number may begin are whatever rclpy had there.
    let is_filled = |(own, theirs): (&u8, &u8)| own == theirs || *own == 0;
    assert!(written.iter().zip(payload).all(is_filled), "{written:x?} {payload:x?}");
    assert_eq!(from_bytes::<M, LittleEndian>(&written).unwrap().0, expected);
    assert!(payload.len() - n_read < 4, "what is left fills up the last four bytes");
}

fn header(frame: &str) -> Header {
    Header { stamp: Time { sec: 1_700_000_000, nanosec: 123_456_789 }, frame_id: frame.into() }
}

fn pose(x: f64) -> Pose {
    let orientation = Quaternion { x: 0.5, y: -0.5, z: 0.5, w: 0.5 };
    Pose { position: Point { x, y: 2.0, z: 3.0 }, orientation }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

macro_rules! recorded {
    ($name:literal) => {
        include_bytes!(concat!("recorded/", $name, ".cdr"))
    };
}

#[test]
fn what_the_robot_says_is_read_as_rclpy_writes_it() {
    same(recorded!("bool"), Bool { data: true });
    same(recorded!("clock"), Clock { clock: header("").stamp });
    let mut odometry =
        Odometry { header: header("odom"), child_frame_id: "base_link".into(), ..Odometry::default() };
    odometry.pose.pose = pose(1.0);
    odometry.pose.covariance[1][1] = 0.25;
    odometry.twist.twist = Twist { linear: vector([4.0, 5.0, 6.0]), angular: vector([7.0, 8.0, 9.0]) };
    odometry.twist.covariance[5][5] = 0.125;
    same(recorded!("odometry"), odometry);
    let mut imu = Imu { header: header("imu"), ..Imu::default() };
    imu.orientation_covariance[0] = -1.0;
    imu.angular_velocity = vector([0.1, 0.2, 0.3]);
    imu.linear_acceleration = vector([1.0, 2.0, 9.81]);
    same(recorded!("imu"), imu);
    let mut fix = NavSatFix {
        header: header("antenna"),
        status: NavSatStatus { status: 2, service: 5 },
        latitude: 46.5,
        longitude: -7.25,
        altitude: 512.0,
        position_covariance_type: 2,
        ..NavSatFix::default()
    };
    (fix.position_covariance[0], fix.position_covariance[8]) = (0.25, 4.0);
    same(recorded!("nav_sat_fix"), fix);
    let field =
        |name: &str, offset, datatype, count| PointField { name: name.into(), offset, datatype, count };
    let cloud = PointCloud2 {
        header: header("lidar"),
        height: 1,
        width: 2,
        fields: vec![field("x", 1, 7, 1), field("ring", 2, 4, 0)],
        is_bigendian: true,
        point_step: 3,
        row_step: 6,
        data: (0..6).collect(),
        is_dense: true,
    };
    same(recorded!("point_cloud"), cloud);
    let stamped = PoseStamped { header: header("map"), pose: pose(1.0) };
    same(recorded!("pose_stamped"), stamped.clone());
    same(recorded!("pose_array"), PoseArray { header: header("map"), poses: vec![pose(1.0), pose(-1.0)] });
    same(recorded!("path"), Path { header: header("odom"), poses: vec![stamped] });
}

#[test]
fn what_the_robot_is_told_is_written_as_rclpy_reads_it() {
    let mut grid =
        OccupancyGrid { header: header("map"), data: vec![0, 100, -1], ..OccupancyGrid::default() };
    grid.info =
        MapMetaData { resolution: 0.25, width: 3, height: 1, origin: pose(-1.0), ..MapMetaData::default() };
    same(recorded!("occupancy_grid"), grid);
    let twist = Twist { linear: vector([1.5, 0.0, 0.0]), angular: vector([0.0, 0.0, -0.5]) };
    same(recorded!("twist_stamped"), TwistStamped { header: header("base_link"), twist });
    let status = DiagnosticStatus {
        level: 2,
        name: "input".into(),
        message: "no scan".into(),
        hardware_id: "car".into(),
        values: vec![KeyValue { key: "age".into(), value: "0.1".into() }],
    };
    same(recorded!("diagnostic_array"), DiagnosticArray { header: header(""), status: vec![status] });
}

#[test]
fn an_action_is_told_as_rclpy_tells_it() {
    let stamped = PoseStamped { header: header("map"), pose: pose(1.0) };
    let goal = NavigateToPoseGoal { pose: stamped.clone(), behavior_tree: "tree".into() };
    same(recorded!("navigate_goal"), goal);
    let told = |error_msg| {
        let result = NavigateToPoseResult { error_code: NavigateToPoseResult::UNKNOWN, error_msg };
        to_vec::<_, LittleEndian>(&result).unwrap()
    };
    assert_eq!(told(None), recorded!("navigate_result")[ENCAPSULATION.len()..][..2]);
    assert_eq!(told(Some("why".into())), b"\x28\x23\0\0\x04\0\0\0why\0", "since Kilted");
    let feedback = NavigateToPoseFeedback {
        current_pose: stamped,
        navigation_time: Duration { sec: 3, nanosec: 500_000_000 },
        estimated_time_remaining: Duration::default(),
        number_of_recoveries: -2,
        distance_remaining: 2.5,
    };
    same(recorded!("navigate_feedback"), feedback);
}

#[test]
fn markers_are_written_as_rclpy_reads_them() {
    let color = |[r, g, b, a]: [f32; 4]| ColorRgba { r, g, b, a };
    let line = Marker {
        header: header("map"),
        ns: "plan".into(),
        id: 3,
        r#type: Marker::LINE_STRIP,
        pose: pose(1.0),
        scale: vector([0.5, 0.0, 0.0]),
        color: color([0.25, 0.5, 0.75, 1.0]),
        lifetime: Duration { sec: 1, nanosec: 0 },
        points: vec![Point { x: 1.0, y: 2.0, z: 3.0 }],
        colors: vec![color([1.0, 0.0, 0.0, 0.5])],
        text: "way".into(),
        ..Marker::default()
    };
    let thing =
        Marker { header: header("odom"), ns: "moving".into(), r#type: Marker::CYLINDER, ..Marker::default() };
    same(recorded!("marker_array"), MarkerArray { markers: vec![line, thing] });
}

#[test]
fn times_survive_the_way_before_and_after_the_beginning() {
    for at_ns in [0, 1, -1, 1_500_000_000, -1_500_000_000, 1_700_000_000_123_456_789] {
        assert_eq!(Time::from_nanoseconds(at_ns).nanoseconds(), at_ns);
    }
    assert_eq!(Time::from_nanoseconds(-1), Time { sec: -1, nanosec: 999_999_999 });
    assert_eq!(Time::from_nanoseconds(i64::MAX).sec, i32::MAX);
}
