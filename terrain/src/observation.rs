//! What a vehicle measures of the ground: poses and range scans with semantics.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Pose of the body frame (rear axle's centre) in the map frame.
///
/// Roll > 0 lifts the left side, pitch > 0 lowers the nose, yaw is counter-clockwise from east
/// (intrinsic z-y-x angles).
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Up [m].
    pub z_m: f64,
    /// Roll [rad].
    pub roll_rad: f64,
    /// Pitch [rad].
    pub pitch_rad: f64,
    /// Yaw [rad].
    pub yaw_rad: f64,
}

impl Pose {
    /// The rigid motion that takes body coordinates to map coordinates.
    pub fn isometry(&self) -> Isometry3<f64> {
        // By axes, since nalgebra would ask the platform for sines.
        let about = |axis: usize, angle_rad: f64| {
            let (sine, cosine) = libm::sincos(0.5 * angle_rad);
            let mut imaginary = Vector3::zeros();
            imaginary[axis] = sine;
            UnitQuaternion::new_unchecked(Quaternion::from_parts(cosine, imaginary))
        };
        let rotation = about(2, self.yaw_rad) * about(1, self.pitch_rad) * about(0, self.roll_rad);
        Isometry3::from_parts(Translation3::new(self.x_m, self.y_m, self.z_m), rotation)
    }

    /// Whether every component is a finite number.
    pub fn is_finite(&self) -> bool {
        [self.x_m, self.y_m, self.z_m, self.roll_rad, self.pitch_rad, self.yaw_rad]
            .iter()
            .all(|v| v.is_finite())
    }
}

/// What covers the ground, as a camera would name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum TerrainClass {
    /// Rigid ground: soil, rock, concrete.
    Open = 0,
    /// Loose ground: sand, gravel.
    Loose = 1,
    /// Soft plants that a wheel can press down.
    Vegetation = 2,
    /// What must not be touched: trunks, walls, water.
    Obstacle = 3,
}

impl TerrainClass {
    /// Number of classes.
    pub const COUNT: usize = 4;
    /// All classes in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [Self::Open, Self::Loose, Self::Vegetation, Self::Obstacle];
}

/// One return of a range sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangePoint {
    /// Position in the body frame [m].
    pub position_m: [f32; 3],
    /// What the camera says it is.
    pub class: TerrainClass,
}

/// One sweep of a range sensor, in the body frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// When the sweep was measured, monotonic [ns].
    pub valid_at_ns: u64,
    /// Where the rays start, in the body frame [m].
    pub origin_m: [f32; 3],
    /// Returns; rays without a return are absent.
    pub points: Vec<RangePoint>,
}
