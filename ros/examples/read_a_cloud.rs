//! `cargo run -p ros --example read_a_cloud`
//!
//! Reads a point cloud of an own layout as the bridge does: the sensor sits on a mast, half a metre ahead of the rear
//! axle and a metre above it, and looks to the left.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use ros::cloud::{Classes, GeometryClasses, Meaning};
use ros::intake::{Clouds, Intake};
use ros::message::{Header, PointCloud2, PointField, TfMessage, Time, Transform, TransformStamped, Vector3};
use ros::odometry::Frames;
use ros::rigid;
use ros::stamps::{Arrival, StampClock, StampSource};
use ros::transforms::Transforms;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let frames = Frames { map: "map".into(), vehicle: "rear_axle".into() };
    let lengths = GeometryClasses { column_m: 0.3, step_m: 0.15, plants_max_m: 1.0 };
    let clock = StampClock::new(StampSource::OfItsOwn);
    let meaning = Meaning { classes: Classes::Geometry(lengths), times: None };
    let clouds = Clouds { meaning, sensors: Vec::new() };
    let mut intake = Intake::new(frames, clouds, clock, Transforms::new(1_000_000_000));

    // Without knowing where the sensor is, a cloud says nothing.
    let arrival = Arrival { monotonic_ns: 5_000_000_000, utc_ns: 0 };
    let cloud = cloud(&[[2.0, 0.0, -1.0], [3.0, 1.0, -1.0], [f32::NAN, 0.0, 0.0]]);
    if let Err(why) = intake.cloud(&cloud, arrival, 1000) {
        println!("refused: {why}");
    }

    let left = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    intake.fixed_frames(&told(&Isometry3::from_parts(Translation3::new(0.5, 0.0, 1.0), left)))?;
    let scan = intake.cloud(&cloud, arrival, 1000)?;
    println!("rays start at {:?} m, {} had no return", scan.origin_m, scan.sweep.n_without_place);
    for point in &scan.sweep.points {
        println!("a return at {:?} m, of class {}", point.position_m, point.class_number);
    }
    let [x_m, y_m, z_m] = scan.sweep.points[0].position_m;
    assert!((x_m - 0.5).abs() + (y_m - 2.0).abs() + z_m.abs() < 1e-6, "ahead of the sensor is to the left");
    Ok(())
}

/// Where the sensor sits, as `/tf_static` tells it.
fn told(motion: &Isometry3<f64>) -> TfMessage {
    let [x, y, z] = motion.translation.vector.into();
    let transform =
        Transform { translation: Vector3 { x, y, z }, rotation: rigid::quaternion_of(&motion.rotation) };
    let header = Header { frame_id: "rear_axle".into(), ..Header::default() };
    TfMessage { transforms: vec![TransformStamped { header, child_frame_id: "mast".into(), transform }] }
}

/// A cloud whose points are an intensity, then z, y and x.
fn cloud(points: &[[f32; 3]]) -> PointCloud2 {
    let field = |(name, offset): (&str, u32)| PointField { name: name.into(), offset, datatype: 7, count: 1 };
    let data = points.iter().flat_map(|[x_m, y_m, z_m]| [0.5, *z_m, *y_m, *x_m]).flat_map(f32::to_le_bytes);
    PointCloud2 {
        header: Header { stamp: Time { sec: 7, nanosec: 0 }, frame_id: "mast".into() },
        height: 1,
        width: points.len() as u32,
        fields: [("intensity", 0), ("z", 4), ("y", 8), ("x", 12)].map(field).to_vec(),
        point_step: 16,
        row_step: 16 * points.len() as u32,
        data: data.collect(),
        ..PointCloud2::default()
    }
}
