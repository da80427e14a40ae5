use super::*;
use crate::cloud::GeometryClasses;
use crate::message::{
    Header, PointField, Pose, PoseWithCovariance, Quaternion, Time, Transform, TransformStamped, Twist,
    TwistWithCovariance, Vector3,
};
use crate::stamps::StampSource;

/// Half a second after the message of this stamp [s]: on the bus's clock, stamps lie 100 s back.
fn arrival(sec: i32) -> Arrival {
    let monotonic_ns = (i64::from(sec) - 100) as u64 * 1_000_000_000 + 500_000_000;
    Arrival { monotonic_ns, utc_ns: monotonic_ns + 100_000_000_000 }
}

fn header(sec: i32, frame: &str) -> Header {
    Header { stamp: Time { sec, nanosec: 0 }, frame_id: frame.into() }
}

/// `base` in `odom` in `map`, and a `mast` on the base that looks to the left.
fn told() -> TfMessage {
    let turn = std::f64::consts::FRAC_1_SQRT_2;
    let left = Quaternion { x: 0.0, y: 0.0, z: turn, w: turn };
    let frame = |parent: &str, child: &str, translation: [f64; 3], rotation| {
        let [x, y, z] = translation;
        let transform = Transform { translation: Vector3 { x, y, z }, rotation };
        TransformStamped { header: header(200, parent), child_frame_id: child.into(), transform }
    };
    let none = Quaternion::default();
    TfMessage {
        transforms: vec![
            frame("map", "odom", [10.0, 0.0, 0.0], none),
            frame("base", "mast", [0.5, 0.0, 1.0], left),
        ],
    }
}

fn intake() -> Intake {
    let frames = Frames { map: "map".into(), vehicle: "base".into() };
    let classes = Classes::Geometry(GeometryClasses { column_m: 0.3, step_m: 0.15, plants_max_m: 1.0 });
    let clock = StampClock::new(StampSource::TimeOfDay);
    let mut intake = Intake::new(
        frames,
        classes,
        vec!["front".into(), "rear".into()],
        clock,
        Transforms::new(5_000_000_000),
    );
    intake.moving_frames(&told()).unwrap();
    intake
}

fn odometry(sec: i32) -> Odometry {
    Odometry {
        header: header(sec, "odom"),
        child_frame_id: "base".into(),
        pose: PoseWithCovariance { pose: Pose::default(), ..Default::default() },
        twist: TwistWithCovariance { twist: Twist::default(), ..Default::default() },
    }
}

fn cloud(sec: i32, frame: &str, points: &[[f32; 3]]) -> PointCloud2 {
    let field = |(name, offset): (&str, u32)| PointField { name: name.into(), offset, datatype: 7, count: 1 };
    PointCloud2 {
        header: header(sec, frame),
        height: 1,
        width: points.len() as u32,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).to_vec(),
        point_step: 12,
        row_step: 12 * points.len() as u32,
        data: points.as_flattened().iter().flat_map(|axis_m| axis_m.to_le_bytes()).collect(),
        ..PointCloud2::default()
    }
}

#[test]
fn measurements_keep_their_age_on_the_way_to_the_bus() {
    let mut intake = intake();
    let (at_ns, record) = intake.odometry(&odometry(201), arrival(201)).unwrap();
    assert_eq!((at_ns, record.position_m), (101_000_000_000, [10.0, 0.0, 0.0]));
    let scan = intake.cloud(&cloud(201, "mast", &[[2.0, 0.0, -1.0]]), arrival(201), 10).unwrap();
    assert_eq!((scan.at_ns, scan.sensor, scan.origin_m), (101_000_000_000, 0, [0.5, 0.0, 1.0]));
}

#[test]
fn a_cloud_of_a_sensor_that_the_robot_file_mounts_stays_in_its_frame() {
    let mut intake = intake();
    let scan = intake.cloud(&cloud(201, "rear", &[[2.0, 0.0, -1.0]]), arrival(201), 10).unwrap();
    assert_eq!((scan.sensor, scan.origin_m), (2, [0.0; 3]));
    assert_eq!(scan.sweep.points[0].position_m, [2.0, 0.0, -1.0]);
    let lost = intake.cloud(&cloud(202, "side", &[[2.0, 0.0, -1.0]]), arrival(202), 10).unwrap_err();
    assert!(lost.to_string().starts_with("frame \"side\": expected transforms"), "{lost}");
}

#[test]
fn what_comes_out_of_order_or_without_a_return_is_refused() {
    let mut intake = intake();
    let one = [[2.0, 0.0, -1.0]];
    intake.cloud(&cloud(203, "mast", &one), arrival(203), 10).unwrap();
    let late = intake.cloud(&cloud(202, "mast", &one), arrival(203), 10).unwrap_err();
    assert_eq!(late, IntakeError::OutOfOrder { by_s: 1.0 });
    let blind = intake.cloud(&cloud(204, "mast", &[[f32::NAN; 3]; 7]), arrival(204), 10).unwrap_err();
    assert_eq!(blind, IntakeError::NoReturn { found: 7 });
    intake.cloud(&cloud(204, "mast", &one), arrival(204), 10).unwrap();
}

#[test]
fn what_an_inertial_unit_feels_is_turned_into_the_vehicles_frame() {
    let mut intake = intake();
    let imu = |sec| Imu {
        header: header(sec, "mast"),
        linear_acceleration: Vector3 { x: 1.0, y: 0.0, z: 9.81 },
        angular_velocity: Vector3 { x: 0.0, y: 0.5, z: 0.25 },
        ..Imu::default()
    };
    let felt = intake.imu(&imu(201), arrival(201)).unwrap();
    let close = |found: [f32; 3], expected: [f32; 3]| {
        assert!(
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6),
            "{found:?}"
        );
    };
    // Ahead of the mast is left of the vehicle, left of the mast behind it.
    close(felt.acceleration_mps2, [0.0, 1.0, 9.81]);
    close(felt.angular_rate_radps, [-0.5, 0.0, 0.25]);
    assert!(
        matches!(intake.imu(&imu(201), arrival(201)), Err(IntakeError::OutOfOrder { .. })),
        "the same again"
    );
    let broken = Imu { linear_acceleration: Vector3 { x: f64::NAN, ..Vector3::default() }, ..imu(202) };
    assert!(matches!(intake.imu(&broken, arrival(202)), Err(IntakeError::Pose(_))));
}

#[test]
fn a_clock_that_jumps_leaves_moving_frames_behind() {
    let mut intake = intake();
    intake.odometry(&odometry(201), arrival(201)).unwrap();
    let set = Arrival { utc_ns: arrival(202).utc_ns + 2_000_000_000, ..arrival(202) };
    let jumped = intake.odometry(&odometry(204), set).unwrap_err();
    assert!(jumped.to_string().contains("jumped by 2.000 s"), "{jumped}");
    assert!(
        matches!(intake.odometry(&odometry(204), set), Err(IntakeError::Odometry(_))),
        "of before the jump"
    );
    intake.moving_frames(&told()).unwrap();
    assert!(intake.odometry(&odometry(204), set).is_ok());
}

#[test]
fn one_frame_that_is_none_keeps_no_other_from_being_known() {
    let mut intake = intake();
    let mut broken = told();
    broken.transforms[0].transform.rotation = Quaternion { w: 0.0, ..Quaternion::default() };
    broken.transforms[1].child_frame_id = "boom".into();
    let why = intake.fixed_frames(&broken).unwrap_err().to_string();
    assert!(why.starts_with("frame \"odom\": orientation: expected a quaternion"), "{why}");
    assert!(intake.cloud(&cloud(201, "boom", &[[2.0, 0.0, -1.0]]), arrival(201), 10).is_ok());
}

#[test]
fn goals_are_told_in_the_map_whatever_their_frame_and_time() {
    let intake = intake();
    let pose = |x, y| Pose { position: crate::message::Point { x, y, z: 0.0 }, ..Pose::default() };
    let goal = PoseStamped { header: header(0, "odom"), pose: pose(3.0, 4.0) };
    assert_eq!(intake.goal(&goal).unwrap(), [[13.0, 4.0]]);
    let goals = PoseArray { header: header(0, "map"), poses: vec![pose(1.0, 2.0), pose(5.0, 6.0)] };
    assert_eq!(intake.goals(&goals).unwrap(), [[1.0, 2.0], [5.0, 6.0]]);
    let told = |error: IntakeError| error.to_string();
    let none = PoseArray { header: header(0, "map"), poses: Vec::new() };
    assert_eq!(told(intake.goals(&none).unwrap_err()), "poses: expected at least 1, found 0");
    let short = Path { header: header(0, "map"), poses: vec![goal.clone()] };
    assert_eq!(told(intake.path(&short).unwrap_err()), "poses: expected at least 2, found 1");
    let path = Path { header: header(0, "odom"), poses: vec![goal.clone(), goal.clone()] };
    assert_eq!(intake.path(&path).unwrap(), [[13.0, 4.0]; 2]);
    let lost = PoseStamped { header: header(0, "mars"), ..goal };
    assert!(told(intake.goal(&lost).unwrap_err()).starts_with("frame \"mars\": expected transforms"));
    let wild = PoseArray { header: header(0, "map"), poses: vec![pose(1.0, 2.0), pose(f64::NAN, 0.0)] };
    assert!(told(intake.goals(&wild).unwrap_err()).starts_with("pose 1: position: expected finite"));
}
