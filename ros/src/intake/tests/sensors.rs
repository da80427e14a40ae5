//! Several sensors, however they are mounted, and cameras.

use std::fs::File;

use nalgebra::Point3;
use ndarray::Array2;
use ndarray_npy::NpzReader;
use terrain::TerrainClass;

use super::*;

const OPEN: u32 = TerrainClass::Open as u32;
const OBSTACLE: u32 = TerrainClass::Obstacle as u32;

fn mount(position_m: [f64; 3], [roll_rad, pitch_rad, yaw_rad]: [f64; 3]) -> Isometry3<f64> {
    let [x, y, z] = position_m;
    let rotation = UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

/// One that stands, turned to the left and nodding, and one that hangs upside down and looks back.
fn mounts() -> [(&'static str, Isometry3<f64>); 2] {
    let standing = mount([1.0, 0.3, 0.8], [0.0, 0.2, 0.7]);
    let hanging = mount([-0.8, -0.2, 1.1], [PI, 0.1, PI - 0.4]);
    [("standing", standing), ("hanging", hanging)]
}

/// Level ground half a metre below the rear axle, and a block of a metre on it, in the vehicle's frame.
fn scene() -> Vec<Point3<f64>> {
    let side = || (-30..=30).map(|k| 0.1 * f64::from(k));
    let ground = side().flat_map(|x_m| side().map(move |y_m| Point3::new(x_m, y_m, -0.5)));
    let block = (0..=10).flat_map(|k| (0..=4).map(move |j| (k, j)));
    let block = block.map(|(k, j)| Point3::new(2.05, 0.45 + 0.1 * f64::from(j), -0.5 + 0.1 * f64::from(k)));
    ground.chain(block).collect()
}

/// What a sensor sees of it.
fn seen_from(frame: &str, mount: &Isometry3<f64>) -> PointCloud2 {
    let seen = scene().iter().map(|place_m| mount.inverse() * place_m).collect::<Vec<_>>();
    let places: Vec<[f32; 3]> =
        seen.iter().map(|place_m| place_m.coords.map(|axis_m| axis_m as f32).into()).collect();
    cloud(201, frame, &places)
}

/// Every point lies where it is in the scene, and what stands more than a step above the ground is an obstacle.
fn check(scan: &TakenScan, told: &Isometry3<f64>) {
    let scene = scene();
    assert_eq!(scan.sweep.points.len(), scene.len());
    for (point, place_m) in scan.sweep.points.iter().zip(scene) {
        let found_m = told * Point3::from(point.position_m.map(f64::from));
        assert!((found_m - place_m).norm() < 1e-5, "{found_m} {place_m}");
        let expected = if place_m.z > -0.1 { OBSTACLE } else { OPEN };
        // Columns of 0.3 m that are next to the block may count its foot as ground or not.
        if place_m.z > -0.1 || place_m.z < -0.49 {
            assert_eq!(point.class_number, expected, "{place_m}");
        }
    }
}

#[test]
fn two_lidars_of_the_robot_file_are_two_sensors_however_they_hang() {
    let mut intake = intake();
    intake.clouds.sensors = mounts().map(|(frame, mount)| (frame.to_owned(), mount)).to_vec();
    for (place, (frame, mount)) in mounts().into_iter().enumerate() {
        let scan = intake.cloud(&seen_from(frame, &mount), arrival(201), 1 << 16).unwrap();
        assert_eq!((scan.sensor, scan.origin_m), (place as u32 + 1, [0.0; 3]));
        check(&scan, &mount);
    }
}

#[test]
fn two_lidars_of_tf_static_are_told_in_the_vehicles_frame() {
    let mut intake = intake();
    let transforms = mounts().map(|(frame, mount)| {
        let [x, y, z] = mount.translation.vector.into();
        let transform =
            Transform { translation: Vector3 { x, y, z }, rotation: rigid::quaternion_of(&mount.rotation) };
        TransformStamped { header: header(200, "base"), child_frame_id: frame.into(), transform }
    });
    intake.fixed_frames(&TfMessage { transforms: transforms.to_vec() }).unwrap();
    for (frame, mount) in mounts() {
        let scan = intake.cloud(&seen_from(frame, &mount), arrival(201), 1 << 16).unwrap();
        assert_eq!(scan.sensor, 0);
        let origin_m = mount.translation.vector.map(|axis_m| axis_m as f32);
        assert_eq!(scan.origin_m, <[f32; 3]>::from(origin_m));
        check(&scan, &Isometry3::identity());
    }
}

/// A post 5 m ahead while the vehicle turns: the rear lidar's cloud is 0.1 s older than the front one's, and comes after it.
#[test]
fn a_cloud_that_comes_after_a_newer_one_of_another_sensor_is_told_at_the_time_of_that() {
    let mut intake = intake();
    let mut driven = odometry(201);
    driven.twist.twist = Twist { linear: Vector3 { x: 2.0, y: 0.0, z: 0.0 }, ..rate(0.8) };
    driven.header.stamp.nanosec = 100_000_000;
    intake.odometry(&driven, arrival(201)).unwrap();
    let post = Point3::new(5.0, 1.0, 0.4);
    let mut newer = cloud(201, "front", &[[5.0, 1.0, 0.4]]);
    newer.header.stamp.nanosec = 100_000_000;
    intake.cloud(&newer, arrival(201), 10).unwrap();
    // Where the vehicle was 0.1 s before, by the arc of 2.5 m radius that it drives on.
    let before = mount([2.5 * (-0.08_f64).sin(), 2.5 * (1.0 - 0.08_f64.cos()), 0.0], [0.0, 0.0, -0.08]);
    let rear = intake.clouds.sensors[1].1;
    let seen = (before * rear).inverse() * post;
    let older = cloud(201, "rear", &[seen.coords.map(|axis_m| axis_m as f32).into()]);
    let scan = intake.cloud(&older, arrival(201), 10).unwrap();
    assert_eq!((scan.sensor, scan.at_ns), (2, 101_100_000_000));
    let told = rear * Point3::from(scan.sweep.points[0].position_m.map(f64::from));
    assert!((told - post).norm() < 1e-4, "{told}");
    // Rays started where the sensor was then: 0.2 m farther back, which is ahead of one that looks back.
    assert!((scan.origin_m[0] - 0.2).abs() < 0.02, "{:?}", scan.origin_m);
    // The same sensor goes back in time, or lies farther back than anybody knows how the vehicle moved: out of order.
    let mut again = older.clone();
    again.header.stamp = Time { sec: 200, nanosec: 950_000_000 };
    assert_eq!(intake.cloud(&again, arrival(201), 10), Err(IntakeError::OutOfOrder { by_s: 0.05 }));
    let mut lost = cloud(200, "mast", &[[2.0, 0.0, -1.0]]);
    lost.header.stamp.nanosec = 700_000_000;
    assert!(matches!(intake.cloud(&lost, arrival(201), 10), Err(IntakeError::OutOfOrder { .. })));
}

/// A depth camera: rows of pixels with bytes unused behind each, NaN where nothing came back, and axes to the right, down
/// and ahead. It looks ahead and down by 0.3 rad from 1 m above the rear axle, 1.5 m above level ground on which a block
/// stands.
#[test]
fn an_organised_cloud_of_a_depth_camera_is_taken_in_its_optical_frame() {
    let (n_rows, n_cols, point_step, padding) = (24_u32, 32_u32, 16_u32, 8_u32);
    let optical = UnitQuaternion::from_euler_angles(-0.5 * PI, 0.0, -0.5 * PI);
    let camera =
        mount([0.6, 0.0, 1.0], [0.0, 0.3, 0.0]) * Isometry3::from_parts(Translation3::identity(), optical);
    let (mut data, mut expected) = (Vec::new(), Vec::new());
    for row in 0..n_rows {
        for col in 0..n_cols {
            let ray =
                nalgebra::Vector3::new(0.04 * (f64::from(col) - 15.5), 0.04 * (f64::from(row) - 11.5), 1.0);
            let place_m = hit(&camera, &ray);
            expected.extend(place_m);
            let seen = place_m.map(|place_m| camera.inverse() * place_m);
            let seen = seen.map_or([f32::NAN; 3], |seen| seen.coords.map(|axis_m| axis_m as f32).into());
            data.extend(seen.iter().flat_map(|axis_m| axis_m.to_le_bytes()));
            data.extend([0xAA; 4]);
        }
        data.extend([0xBB; 8]);
    }
    let mut organised = cloud(201, "camera_optical", &[]);
    (organised.height, organised.width, organised.point_step) = (n_rows, n_cols, point_step);
    (organised.row_step, organised.data) = (n_cols * point_step + padding, data);
    let n_lost = (n_rows * n_cols) as usize - expected.len();
    assert!(n_lost > 50 && expected.len() > 300, "{n_lost} of {}", n_rows * n_cols);
    let mut intake = intake();
    intake.clouds.sensors = vec![("camera_optical".into(), camera)];
    let scan = intake.cloud(&organised, arrival(201), 1 << 16).unwrap();
    assert_eq!((scan.sensor, scan.sweep.n_without_place), (1, n_lost));
    assert_eq!(scan.sweep.points.len(), expected.len());
    let mut n_of_class = [0; 4];
    for (point, place_m) in scan.sweep.points.iter().zip(&expected) {
        let told = camera * Point3::from(point.position_m.map(f64::from));
        assert!((told - place_m).norm() < 1e-5, "{told} {place_m}");
        n_of_class[point.class_number as usize] += 1;
        if place_m.z > 0.0 {
            assert_eq!(point.class_number, OBSTACLE, "{place_m}");
        } else if place_m.z < -0.499 {
            assert_eq!(point.class_number, OPEN, "{place_m}");
        }
    }
    assert!(n_of_class[OPEN as usize] > 200 && n_of_class[OBSTACLE as usize] > 20, "{n_of_class:?}");
}

/// Where a ray of the camera ends within 6 m: on the front of a block 1 m wide and high, 3 m ahead, or on the ground.
fn hit(camera: &Isometry3<f64>, ray: &nalgebra::Vector3<f64>) -> Option<Point3<f64>> {
    let (eye, ray) = (camera * Point3::origin(), camera * ray);
    let at = |share: f64| eye + ray * share;
    let front = at((3.0 - eye.x) / ray.x);
    if front.y.abs() <= 0.5 && (-0.5..=0.5).contains(&front.z) {
        return Some(front);
    }
    let ground = at((-0.5 - eye.z) / ray.z);
    let is_ahead = ray.z < 0.0 && (ground - eye).norm() < 6.0;
    is_ahead.then_some(ground)
}

/// A real sweep of 64 beams over grass, bushes and trees: hung upside down it shows the same things as upright.
#[test]
#[ignore = "needs the shared data"]
fn a_real_sweep_is_the_same_however_its_sensor_hangs() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain/rellis_scan.npz");
    let mut archive = NpzReader::new(File::open(path).unwrap()).unwrap();
    let places: Array2<f32> = archive.by_name("xyz").unwrap();
    let places: Vec<Point3<f64>> =
        places.rows().into_iter().map(|row| Point3::from([row[0], row[1], row[2]].map(f64::from))).collect();
    let taken = |rotation_rad: [f64; 3]| {
        let mount = mount([0.0; 3], rotation_rad);
        let seen = places
            .iter()
            .map(|place_m| (mount.inverse() * place_m).coords.map(|axis_m| axis_m as f32).into());
        let mut intake = intake();
        intake.clouds.sensors = vec![("lidar".into(), mount)];
        let cloud = cloud(201, "lidar", &seen.collect::<Vec<[f32; 3]>>());
        intake.cloud(&cloud, arrival(201), 1 << 18).unwrap().sweep
    };
    let upright = taken([0.0; 3]);
    let obstacles = upright.points.iter().filter(|point| point.class_number == OBSTACLE).count();
    let share = obstacles as f64 / upright.points.len() as f64;
    assert!((0.02..0.8).contains(&share), "trees, and ground between them: {share}");
    for rotation_rad in [[PI, 0.0, 0.5], [-0.5 * PI, 0.0, -0.5 * PI]] {
        let turned = taken(rotation_rad);
        assert_eq!(turned.points.len(), upright.points.len());
        let pairs = turned.points.iter().zip(&upright.points);
        let n_other = pairs.filter(|(turned, upright)| turned.class_number != upright.class_number).count();
        // Rounding takes a few points over the edges of their columns.
        assert!(n_other * 500 < upright.points.len(), "{n_other} of {}", upright.points.len());
    }
}
