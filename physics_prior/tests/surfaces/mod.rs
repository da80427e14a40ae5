//! Vehicles, surfaces and maps that the tests share.
#![allow(dead_code, reason = "every test crate uses its own part")]
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use bicycle::lanes::Instructions;
use bicycle::{Geometry, Vehicle};
use physics_prior::{Assumption, PriorConfig, PriorMap};
use terrain::{Cell, GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::{CvarLevel, Risk};

/// PIETRA's RC car.
pub const CAR: Geometry = Geometry {
    wheelbase_m: 0.26,
    track_m: 0.2,
    length_m: 0.33,
    width_m: 0.25,
    rear_overhang_m: 0.035,
    ground_clearance_m: 0.04,
    wheel_radius_m: 0.075,
};

/// A full-size machine.
pub const TRUCK: Geometry = Geometry {
    wheelbase_m: 2.4,
    track_m: 1.5,
    length_m: 3.4,
    width_m: 1.8,
    rear_overhang_m: 0.5,
    ground_clearance_m: 0.35,
    wheel_radius_m: 0.4,
};

/// The shipped full-size vehicle.
pub fn full_size() -> Vehicle {
    toml::from_str(include_str!("../../../scenarios/vehicles/pietra_full_size.toml")).unwrap()
}

/// A window whose south-west corner is the map's origin.
pub fn window(resolution_m: f64, n_rows: usize, n_cols: usize) -> GridGeometry {
    GridGeometry { resolution_m, origin: [0, 0], n_rows, n_cols }
}

/// A surface given by a function of the cells' centres.
pub fn surface(geometry: GridGeometry, cell_at: impl Fn(f64, f64) -> SurfaceCell) -> GridMap<SurfaceCell> {
    let value = |index| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        cell_at(x_m, y_m)
    };
    GridMap::from_values(geometry, (0..geometry.n_cells()).map(value).collect()).unwrap()
}

/// Bare ground of the given height.
pub fn open(height_m: f64) -> SurfaceCell {
    SurfaceCell::certain(height_m as f32, TerrainClass::Open, 0.0)
}

/// Level, bare ground.
pub fn level_ground(geometry: GridGeometry) -> GridMap<SurfaceCell> {
    surface(geometry, |_, _| open(0.0))
}

/// Rough ground with vegetation, obstacles, holes and noise; every cell from a hash of its place.
pub fn rough(geometry: GridGeometry, seed: u64) -> GridMap<SurfaceCell> {
    let hash = |x: f64, y: f64, salt: u64| {
        let [i, j] = [x, y].map(|v| (v / geometry.resolution_m).floor() as i64 as u64);
        let mut h = seed ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ j.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        h = (h ^ salt.wrapping_mul(0x1656_67b1_9e37_79f9)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h = (h ^ (h >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        ((h ^ (h >> 33)) >> 11) as f64 / (1u64 << 53) as f64
    };
    surface(geometry, |x, y| {
        let height_m = 0.3 * (1.7 * x).sin() * (1.3 * y).cos() + 0.03 * hash(x, y, 1);
        let green = 0.5 + 0.5 * (0.9 * x + 0.4 * y).sin();
        let mut cell = SurfaceCell::certain(height_m as f32, TerrainClass::Open, (0.15 * green) as f32);
        cell.class_probability = [1.0 - green as f32, 0.0, green as f32, 0.0];
        cell.height_variance_m2 = (1e-4 * hash(x, y, 2)) as f32;
        match hash(x, y, 3) {
            u if u < 0.01 => SurfaceCell::certain(1.0, TerrainClass::Obstacle, 0.0),
            u if u < 0.05 => SurfaceCell::UNKNOWN,
            _ => cell,
        }
    })
}

pub fn level(level: f64) -> CvarLevel {
    CvarLevel::new(level).unwrap()
}

/// The physics prior with default parameters at a level.
pub fn physics(at: f64) -> Assumption {
    Assumption::Physics { prior: PriorConfig::default(), level: level(at) }
}

/// A map over a surface of the same window.
pub fn prior_map(
    geometry: &Geometry,
    assumption: &Assumption,
    surface: &GridMap<SurfaceCell>,
    n_yaws: usize,
) -> PriorMap {
    let window = *surface.geometry();
    let mut map =
        PriorMap::new(geometry, assumption, window.resolution_m, window, n_yaws, Instructions::widest())
            .unwrap();
    map.update_all(surface).unwrap();
    map
}

/// The cell in the middle of a window.
pub fn middle(geometry: &GridGeometry) -> Cell {
    Cell { row: geometry.n_rows / 2, col: geometry.n_cols / 2 }
}

/// Whether two risks agree up to f32 rounding.
pub fn close(a: Risk, b: Risk, tolerance: f32) -> bool {
    let pairs = [
        (a.linear_traction, b.linear_traction),
        (a.angular_traction, b.angular_traction),
        (a.roll_rad, b.roll_rad),
        (a.pitch_rad, b.pitch_rad),
    ];
    pairs.iter().all(|(a, b)| (a - b).abs() <= tolerance)
}
