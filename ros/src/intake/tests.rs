mod globe;
mod sensors;

use super::*;
use crate::cloud::{Classes, GeometryClasses};
use crate::message::{
    Header, PointField, Pose, PoseWithCovariance, Quaternion, Time, Transform, TransformStamped, Twist,
    TwistWithCovariance, Vector3,
};
use crate::stamps::StampSource;
use formats::{RosPointEpoch, RosPointTime};
use nalgebra::{Translation3, UnitQuaternion};
use std::f64::consts::PI;

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
    let rear = Isometry3::from_parts(
        Translation3::new(-1.0, 0.0, 0.5),
        UnitQuaternion::from_euler_angles(0.0, 0.0, PI),
    );
    let sensors = vec![("front".into(), Isometry3::identity()), ("rear".into(), rear)];
    let clouds = Clouds { meaning: Meaning { classes, times: None }, sensors };
    let mut intake = Intake::new(frames, clouds, clock, Transforms::new(5_000_000_000));
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

/// Stated once a second, told ten times a second: of the 32nd on, one in ten is taken.
#[test]
fn what_comes_much_more_often_than_stated_is_thinned_and_told() {
    let periods = Periods { odometry_s: 1.0, scan_s: 1.0, ..Periods::default() };
    let mut intake = intake().kept_to(&periods);
    intake.fixed_frames(&told()).unwrap();
    let tenth = |k: i32| Time { sec: 201 + k / 10, nanosec: (k % 10) as u32 * 100_000_000 };
    let (mut n_odometry, mut n_clouds, mut n_others, mut refusal) = (0, 0, 0, String::new());
    for k in 0..132 {
        let (mut odometry, mut seen) = (odometry(201), cloud(201, "mast", &[[2.0, 0.0, -1.0]]));
        (odometry.header.stamp, seen.header.stamp) = (tenth(k), tenth(k));
        n_odometry += usize::from(intake.odometry(&odometry, arrival(202 + k / 10)).is_ok());
        match intake.cloud(&seen, arrival(202 + k / 10), 10) {
            Ok(_) => n_clouds += 1,
            Err(why) => refusal = why.to_string(),
        }
        // Another sensor that keeps to what is stated is heard as before.
        if k % 10 == 0 {
            seen.header.frame_id = "rear".into();
            n_others += usize::from(intake.cloud(&seen, arrival(202 + k / 10), 10).is_ok());
        }
    }
    assert!((40..=42).contains(&n_odometry), "{n_odometry}");
    assert!((40..=42).contains(&n_clouds), "{n_clouds}");
    assert_eq!(n_others, 14);
    let expected = "rate: expected at most 3.0 Hz, 3 times what the robot file states, found 10.0 Hz";
    assert!(refusal.starts_with(expected), "{refusal}");
}

/// A post stands 5 m ahead and 1 m to the left of the vehicle at the stamp, which turns to the left in a circle of
/// 2 m/s / 0.8 rad/s = 2.5 m. Every point of the sweep is measured from where the vehicle is then; all must show one post.
#[test]
fn what_the_vehicle_drives_within_a_sweep_is_taken_out() {
    let turning = Twist { linear: Vector3 { x: 2.0, y: 0.0, z: 0.0 }, ..rate(0.8) };
    let post = nalgebra::Point3::new(5.0, 1.0, 0.4);
    let seen_from = |mounting: Isometry3<f64>, after_s: f64| {
        let (turned_rad, radius_m) = (0.8 * after_s, 2.5);
        let place = Translation3::new(radius_m * turned_rad.sin(), radius_m * (1.0 - turned_rad.cos()), 0.0);
        let vehicle = Isometry3::from_parts(place, UnitQuaternion::from_euler_angles(0.0, 0.0, turned_rad));
        (vehicle * mounting).inverse() * post
    };
    for frame in ["mast", "rear"] {
        let mut intake = intake();
        let times = RosPointTime { field: "t".into(), unit_s: 1.0, counts_from: RosPointEpoch::Stamp };
        intake.clouds.meaning.times = Some(times);
        let mut driven = odometry(201);
        driven.twist.twist = turning;
        intake.odometry(&driven, arrival(201)).unwrap();
        let mounting = match frame {
            "mast" => intake.transforms.between("mast", "base", 201_000_000_000).unwrap(),
            _ => intake.clouds.sensors[1].1,
        };
        let offsets_s = [0.0_f32, 0.04, 0.1, -0.05];
        let points = offsets_s.map(|after_s| {
            let place = seen_from(mounting, f64::from(after_s));
            ([place.x as f32, place.y as f32, place.z as f32], after_s)
        });
        let scan = intake.cloud(&timed_cloud(201, frame, &points), arrival(201), 10).unwrap();
        let told = if frame == "mast" { Isometry3::identity() } else { mounting };
        for point in &scan.sweep.points {
            let place = told * nalgebra::Point3::from(point.position_m.map(f64::from));
            // The chord in place of the arc: 0.2 m x 0.08^2 / 24 = 0.05 mm, and single precision.
            assert!((place - post).norm() < 1e-4, "{frame}: {place}");
        }
        // Without odometry of that time they lie apart by what was driven: 2 m/s x 0.1 s and more, for the turn.
        let lost = intake.cloud(&timed_cloud(205, frame, &points), arrival(205), 10).unwrap();
        let spread_m = lost.sweep.points[2].position_m.map(f64::from);
        let there = told * nalgebra::Point3::from(spread_m);
        assert!((there - post).norm() > 0.2, "{frame}: {there}");
    }
}

fn rate(yaw_radps: f64) -> Twist {
    Twist { angular: Vector3 { x: 0.0, y: 0.0, z: yaw_radps }, ..Twist::default() }
}

/// Points with the times that they were measured at after the stamp [s].
fn timed_cloud(sec: i32, frame: &str, points: &[([f32; 3], f32)]) -> PointCloud2 {
    let places: Vec<[f32; 3]> = points.iter().map(|(place_m, _)| *place_m).collect();
    let mut timed = cloud(sec, frame, &places);
    timed.fields.push(PointField { name: "t".into(), offset: 12, datatype: 7, count: 1 });
    (timed.point_step, timed.row_step) = (16, 16 * points.len() as u32);
    let numbers = points.iter().flat_map(|([x_m, y_m, z_m], after_s)| [*x_m, *y_m, *z_m, *after_s]);
    timed.data = numbers.flat_map(f32::to_le_bytes).collect();
    timed
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
