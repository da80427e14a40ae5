//! The predictor against the networks that were trained.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use candle_core::{Device, Tensor};
use rand::RngExt;
use traversability::Bins;

use super::Predictor;
use crate::network::Network;
use crate::random::stream;
use crate::{Checkpoint, DensityRange, FeatureLayout, Method, Settings, Sidecar, Standardisation};

const CAR: Geometry = Geometry {
    wheelbase_m: 0.26,
    track_m: 0.2,
    length_m: 0.33,
    width_m: 0.25,
    rear_overhang_m: 0.035,
    ground_clearance_m: 0.04,
    wheel_radius_m: 0.075,
};
const N_FOOTPRINTS: usize = 50;

fn standardisation(n: usize) -> Standardisation {
    let mut rng = stream(3, &[]);
    Standardisation {
        mean: (0..n).map(|_| rng.random_range(-0.5..0.5)).collect(),
        deviation: (0..n).map(|_| rng.random_range(0.3..2.0)).collect(),
    }
}

fn checkpoint(network: &Network, method: Method) -> Checkpoint {
    let layout = FeatureLayout::for_vehicle(&CAR);
    let architecture = Settings::new(method, 1).architecture(layout.n_features());
    let range = DensityRange { min: -9.0, max: 0.0, log_budget: architecture.log_budget() };
    let sidecar = Sidecar {
        format: Sidecar::FORMAT,
        method,
        vehicle: "car".to_owned(),
        standardisation: standardisation(layout.n_features()),
        architecture,
        layout,
        traction_bins: Bins::TRACTION.values().to_vec(),
        attitude_bins_rad: Bins::ATTITUDE.values().to_vec(),
        prior: physics_prior::PriorConfig::for_vehicle(&CAR),
        density: method.is_evidential().then_some(range),
        training: serde_json::Value::Null,
        git_revision: String::new(),
        weights_sha256: String::new(),
    };
    Checkpoint::new(sidecar, network.tensors().unwrap()).unwrap()
}

/// Rows of the trained networks' outputs for raw features.
fn outputs(network: &Network, checkpoint: &Checkpoint, footprints: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut inputs = Vec::new();
    for features in footprints {
        checkpoint.sidecar.standardisation.apply(features, &mut inputs);
    }
    let shape = (footprints.len(), checkpoint.sidecar.architecture.n_inputs);
    let inputs = Tensor::from_vec(inputs, shape, &Device::Cpu).unwrap();
    network.outputs(&inputs).unwrap().to_vec2().unwrap()
}

#[test]
fn both_forms_of_the_networks_agree() {
    for (seed, method) in Method::ALL.into_iter().enumerate() {
        let n_features = FeatureLayout::for_vehicle(&CAR).n_features();
        let network = Network::new(&Settings::new(method, 1).architecture(n_features), seed as u64).unwrap();
        let checkpoint = checkpoint(&network, method);
        let mut rng = stream(5, &[]);
        let footprints: Vec<Vec<f32>> = (0..N_FOOTPRINTS)
            .map(|_| (0..n_features).map(|_| rng.random_range(-1.0..1.0)).collect())
            .collect();
        let predictions =
            Predictor::new(&checkpoint, Instructions::widest()).unwrap().predict(&footprints).unwrap();
        for (found, expected) in predictions.iter().zip(outputs(&network, &checkpoint, &footprints)) {
            for (pmf, logits) in found.pmfs.iter().zip(expected.chunks(12)) {
                let sum: f32 = logits.iter().map(|logit| logit.exp()).sum();
                let pairs = pmf.probabilities().iter().zip(logits);
                assert!(pairs.clone().all(|(p, logit)| (p - logit.exp() / sum).abs() < 1e-5), "{method:?}");
            }
            let Some(evidence) = found.evidence else { continue };
            let [scales @ .., log_density] = &expected[48..] else { panic!("too few outputs") };
            assert!((evidence.log_density - log_density).abs() < 1e-5 * log_density.abs().max(1.0));
            let log_n = f64::from(*log_density) + checkpoint.sidecar.architecture.log_budget();
            let n = log_n.clamp(-30.0, 30.0).exp();
            for (found, logit) in evidence.counts.iter().zip(scales) {
                let expected = n / (1.0 + f64::from(-logit).exp());
                assert!((f64::from(*found) / expected - 1.0).abs() < 1e-4, "{found} {expected}");
            }
        }
    }
}
