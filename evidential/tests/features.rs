//! Features: where they are sampled, and what they say of ground that the test drew itself.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::{FRAC_PI_2, TAU};

use bicycle::Geometry;
use evidential::FeatureLayout;
use proptest::prelude::*;
use terrain::{GridGeometry, GridMap, PatchShape, SurfaceCell, TerrainClass};

/// 3.4 m by 1.8 m.
const CRAWLER: Geometry = Geometry {
    wheelbase_m: 2.5,
    track_m: 1.55,
    length_m: 3.4,
    width_m: 1.8,
    rear_overhang_m: 0.45,
    ground_clearance_m: 0.42,
    wheel_radius_m: 0.45,
};

/// 0.33 m by 0.25 m: wide for its length.
const SMALL_CAR: Geometry = Geometry {
    wheelbase_m: 0.18,
    track_m: 0.19,
    length_m: 0.33,
    width_m: 0.25,
    rear_overhang_m: 0.075,
    ground_clearance_m: 0.03,
    wheel_radius_m: 0.075,
};

const GROUND: GridGeometry = GridGeometry { resolution_m: 0.2, origin: [-30, -30], n_rows: 60, n_cols: 60 };

fn surface(cell: impl Fn(f64, f64) -> SurfaceCell) -> GridMap<SurfaceCell> {
    let cells = (0..GROUND.n_cells()).map(|index| {
        let [x_m, y_m] = GROUND.centre_m(GROUND.cell(index));
        cell(x_m, y_m)
    });
    GridMap::from_values(GROUND, cells.collect()).unwrap()
}

fn bare(height_m: f64) -> SurfaceCell {
    SurfaceCell::certain(height_m as f32, TerrainClass::Open, 0.0)
}

#[test]
fn square_cells_of_both_patches_cover_the_body_and_little_more() {
    for geometry in [CRAWLER, SMALL_CAR] {
        let layout = FeatureLayout::for_vehicle(&geometry);
        for PatchShape { n_rows, n_cols, spacing_m, rear_m } in [layout.height_patch, layout.cover_patch] {
            let half_m = 0.5 * spacing_m;
            let rear_edge_m = -rear_m - half_m;
            let front_edge_m = (n_rows as f64 - 1.0) * spacing_m - rear_m + half_m;
            let side_m = 0.5 * n_cols as f64 * spacing_m;
            let front_m = geometry.length_m - geometry.rear_overhang_m;
            assert!(rear_edge_m <= -geometry.rear_overhang_m + 1e-9 && front_edge_m >= front_m - 1e-9);
            assert!(side_m >= 0.5 * geometry.width_m - 1e-9);
            // Centred on the body, and one of the two directions fits exactly.
            assert!((rear_edge_m + front_edge_m - (front_m - geometry.rear_overhang_m)).abs() < 1e-9);
            let spare_m = [front_edge_m - front_m, side_m - 0.5 * geometry.width_m];
            assert!(
                spare_m[0].min(spare_m[1]) < 1e-9 && spare_m[0].max(spare_m[1]) < 0.3 * geometry.length_m
            );
        }
        assert_eq!(layout.n_features(), 12 * 7 + 4 * 5 * 3);
    }
}

#[test]
fn a_slope_rises_along_the_patch_by_its_gradient() {
    let layout = FeatureLayout::for_vehicle(&CRAWLER);
    // 20 % northward, heading north: rows go uphill, columns are level.
    let features = layout.features(&surface(|_, y_m| bare(0.2 * y_m)), [0.0, 0.0, FRAC_PI_2]).unwrap();
    let PatchShape { n_cols, spacing_m, rear_m, .. } = layout.height_patch;
    for (index, feature) in features[..layout.height_patch.n_samples()].iter().enumerate() {
        let forward_m = (index / n_cols) as f64 * spacing_m - rear_m;
        // Relative to the mean under the wheels, half a wheelbase ahead; in wheel radii.
        let expected = 0.2 * (forward_m - 0.5 * CRAWLER.wheelbase_m) / CRAWLER.wheel_radius_m;
        assert!((f64::from(*feature) - expected).abs() < 1e-4, "{index}: {feature} {expected}");
    }
}

#[test]
fn left_is_the_last_column() {
    let layout = FeatureLayout::for_vehicle(&CRAWLER);
    // Heading east, the left side is north.
    let features = layout.features(&surface(|_, y_m| bare(0.1 * y_m)), [0.0, 0.0, 0.0]).unwrap();
    let n_cols = layout.height_patch.n_cols;
    assert!(features[..n_cols].windows(2).all(|pair| pair[0] < pair[1]), "{:?}", &features[..n_cols]);
}

#[test]
fn cover_says_plants_looseness_obstacles_and_holes() {
    let layout = FeatureLayout::for_vehicle(&CRAWLER);
    // Ahead of the rear axle by more than 2 m plants, behind it a hole, between loose ground; heading east.
    let ground = surface(|x_m, _| match x_m {
        x_m if x_m > 2.0 => SurfaceCell::certain(0.0, TerrainClass::Vegetation, 0.9),
        x_m if x_m > 0.3 => SurfaceCell::certain(0.0, TerrainClass::Loose, 0.0),
        x_m if x_m > 0.05 => SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0),
        _ => SurfaceCell::UNKNOWN,
    });
    let features = layout.features(&ground, [0.0, 0.0, 0.0]).unwrap();
    let cover: Vec<&[f32]> = features[layout.height_patch.n_samples()..].chunks(4).collect();
    let in_row = |row: usize| cover[row * layout.cover_patch.n_cols + 1];
    // Rows at -0.11, 0.57, 1.25, 1.93 and 2.61 m.
    assert_eq!(in_row(0)[3], 1.0, "a hole");
    assert_eq!(in_row(1), [0.0, 1.0, 0.0, 0.0], "loose");
    assert_eq!(in_row(4), [2.0, 0.0, 0.0, 0.0], "plants of two wheel radii");
    let blocked =
        layout.features(&surface(|_, _| SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0)), [0.0; 3]);
    assert_eq!(blocked.unwrap()[layout.height_patch.n_samples()..][..4], [0.0, 0.0, 1.0, 0.0]);
}

#[test]
fn nothing_is_said_where_no_wheel_stands_on_known_ground() {
    let layout = FeatureLayout::for_vehicle(&CRAWLER);
    assert_eq!(layout.features(&surface(|_, _| SurfaceCell::UNKNOWN), [0.0; 3]), None);
    assert_eq!(layout.features(&surface(|_, _| bare(0.0)), [100.0, 0.0, 0.0]), None);
    assert_eq!(layout.features(&surface(|_, _| bare(0.0)), [f64::NAN, 0.0, 0.0]), None);
}

proptest! {
    #[test]
    fn features_are_finite_and_do_not_know_the_altitude(
        x in -2.0..2.0_f64, y in -2.0..2.0_f64, yaw in 0.0..TAU, altitude in -50.0..50.0_f64, holes in 2usize..30,
    ) {
        let layout = FeatureLayout::for_vehicle(&CRAWLER);
        let wavy = |altitude_m: f64| {
            let mut ground = surface(|x, y| bare(altitude_m + 0.3 * (1.3 * x).sin() * (0.8 * y).cos()));
            ground.values_mut().iter_mut().step_by(holes).for_each(|cell| *cell = SurfaceCell::UNKNOWN);
            ground
        };
        let low = layout.features(&wavy(0.0), [x, y, yaw]);
        let high = layout.features(&wavy(altitude), [x, y, yaw]);
        prop_assert_eq!(low.is_some(), high.is_some());
        for (low, high) in low.into_iter().flatten().zip(high.into_iter().flatten()) {
            // Heights near 50 m are rounded to 4e-6 m.
            prop_assert!(low.is_finite() && (low - high).abs() < 1e-4, "{} {}", low, high);
        }
    }
}
