//! Checkpoints of random weights, the car that they are for, and ground of all kinds.
#![allow(dead_code, reason = "every test crate uses its own part")]
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use std::collections::BTreeMap;

use bicycle::Geometry;
use evidential::{
    Architecture, Checkpoint, DensityRange, FeatureLayout, Method, Sidecar, Standardisation, Tensor,
};
use physics_prior::PriorConfig;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::Bins;

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

/// Small networks for the car's features.
pub fn architecture(method: Method) -> Architecture {
    Architecture {
        n_inputs: FeatureLayout::for_vehicle(&CAR).n_features(),
        encoder_hidden: vec![21, 17],
        n_latent: 5,
        head_hidden: 9,
        evidence_hidden: if method.is_evidential() { 6 } else { 0 },
        n_flow_layers: if method.is_evidential() { 3 } else { 0 },
    }
}

/// Random weights, and a density range that splits random ground.
pub fn checkpoint(method: Method, seed: u64) -> Checkpoint {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let architecture = architecture(method);
    let tensors: BTreeMap<String, Tensor> = architecture
        .tensor_shapes()
        .into_iter()
        .map(|(name, shape)| {
            let reach =
                if name.starts_with("flow") { 1.0 } else { 1.8 / (shape[shape.len() - 1] as f32).sqrt() };
            let n = shape.iter().product();
            let values = (0..n).map(|_| rng.random_range(-reach..reach)).collect();
            (name, Tensor { shape, values })
        })
        .collect();
    let n = architecture.n_inputs;
    let standardisation = Standardisation {
        mean: (0..n).map(|_| rng.random_range(-0.3..0.3)).collect(),
        deviation: (0..n).map(|_| rng.random_range(0.2..1.5)).collect(),
    };
    let range = DensityRange { min: -6.0, max: 0.0, log_budget: architecture.log_budget() + 1.3 };
    let sidecar = Sidecar {
        format: Sidecar::FORMAT,
        method,
        vehicle: "rc_car".to_owned(),
        architecture,
        layout: FeatureLayout::for_vehicle(&CAR),
        standardisation,
        traction_bins: Bins::TRACTION.values().to_vec(),
        attitude_bins_rad: Bins::ATTITUDE.values().to_vec(),
        prior: PriorConfig::for_vehicle(&CAR),
        density: method.is_evidential().then_some(range),
        training: serde_json::Value::Null,
        git_revision: "none".to_owned(),
        weights_sha256: String::new(),
    };
    Checkpoint::new(sidecar, tensors).unwrap()
}

/// Rough ground with plants, loose ground, obstacles and holes; every cell by a number of its own.
pub fn rough(geometry: GridGeometry, seed: u64) -> GridMap<SurfaceCell> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut cell = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let height_m = 40.0 + 0.2 * (1.1 * x_m).sin() * (0.9 * y_m).cos() + rng.random_range(-0.03..0.03);
        let kind = rng.random_range(0..60);
        let class = match kind {
            0 => TerrainClass::Obstacle,
            1..=9 => TerrainClass::Vegetation,
            10..=14 => TerrainClass::Loose,
            _ => TerrainClass::Open,
        };
        let plants_m = if class == TerrainClass::Vegetation { rng.random_range(0.0..0.3) } else { 0.0 };
        let mut cell = SurfaceCell::certain(height_m as f32, class, plants_m);
        cell.height_variance_m2 = 1e-4;
        // A hole of several cells now and then, and a large one in the corner.
        let in_corner = x_m - geometry.south_west_m()[0] < 0.6 && y_m - geometry.south_west_m()[1] < 0.7;
        if kind == 59 || in_corner { SurfaceCell::UNKNOWN } else { cell }
    };
    GridMap::from_values(geometry, (0..geometry.n_cells()).map(&mut cell).collect()).unwrap()
}
