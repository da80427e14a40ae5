//! The predictor against the same networks written down once more, plainly and in double precision.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod untrained;

use bicycle::lanes::Instructions;
use evidential::{Architecture, Checkpoint, CheckpointError, Method, Prediction, Predictor, PredictorError};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use untrained::checkpoint;

/// What [`Architecture`] describes, in f64: distributions, log density, evidence.
struct Plain {
    probabilities: Vec<Vec<f64>>,
    log_density: f64,
    evidence: Vec<f64>,
}

fn layer(checkpoint: &Checkpoint, name: &str, input: &[f64]) -> Vec<f64> {
    let [weights, biases] = ["weight", "bias"].map(|part| &checkpoint.tensors[&format!("{name}.{part}")]);
    let sum = |row: &[f32], bias: &f32| {
        f64::from(*bias) + row.iter().zip(input).map(|(w, x)| f64::from(*w) * x).sum::<f64>()
    };
    weights.values.chunks(weights.shape[1]).zip(&biases.values).map(|(row, bias)| sum(row, bias)).collect()
}

fn leaky(values: Vec<f64>) -> Vec<f64> {
    values.into_iter().map(|v| if v > 0.0 { v } else { f64::from(Architecture::LEAK) * v }).collect()
}

fn plain(checkpoint: &Checkpoint, features: &[f32]) -> Plain {
    let sidecar = &checkpoint.sidecar;
    let scale = &sidecar.standardisation;
    let mut z: Vec<f64> = (0..features.len())
        .map(|k| (f64::from(features[k]) - f64::from(scale.mean[k])) / f64::from(scale.deviation[k]))
        .collect();
    let n_hidden = sidecar.architecture.encoder_hidden.len();
    for k in 0..=n_hidden {
        z = layer(checkpoint, &format!("encoder.{k}"), &z);
        z = if k < n_hidden { leaky(z) } else { z };
    }
    let softmax = |logits: Vec<f64>| {
        let sum: f64 = logits.iter().map(|logit| logit.exp()).sum();
        logits.iter().map(|logit| logit.exp() / sum).collect()
    };
    let branch = |name: &str| {
        layer(checkpoint, &format!("{name}.1"), &leaky(layer(checkpoint, &format!("{name}.0"), &z)))
    };
    let probabilities = (0..4).map(|head| softmax(branch(&format!("heads.{head}")))).collect();
    if !sidecar.method.is_evidential() {
        return Plain { probabilities, log_density: 0.0, evidence: Vec::new() };
    }
    let log_density = log_density(checkpoint, z.clone());
    let log_budget = sidecar.density.unwrap().log_budget;
    let n = (log_density + log_budget).clamp(-30.0, 30.0).exp();
    let evidence = branch("evidence").into_iter().map(|logit| n / (1.0 + (-logit).exp())).collect();
    Plain { probabilities, log_density, evidence }
}

fn log_density(checkpoint: &Checkpoint, mut z: Vec<f64>) -> f64 {
    let values = |name: &str| checkpoint.tensors[name].values.iter().map(|v| f64::from(*v)).collect();
    let [centres, alpha, beta]: [Vec<f64>; 3] = ["flow.centre", "flow.alpha", "flow.beta"].map(values);
    let dimension = z.len() as f64;
    let mut log_density = -0.5 * dimension * std::f64::consts::TAU.ln();
    for (k, centre) in centres.chunks(z.len()).enumerate() {
        let a = alpha[k].exp().ln_1p();
        let b = beta[k].exp().ln_1p() - a;
        let r = z.iter().zip(centre).map(|(z, c)| (z - c).powi(2)).sum::<f64>().sqrt();
        let h = 1.0 / (a + r);
        log_density += (dimension - 1.0) * (b * h).ln_1p() + (b * h - b * r * h * h).ln_1p();
        z = z.iter().zip(centre).map(|(z, c)| z + b * h * (z - c)).collect();
    }
    log_density - 0.5 * z.iter().map(|z| z * z).sum::<f64>()
}

fn footprints(n: usize, seed: u64, reach: f32) -> Vec<Vec<f32>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let n_features = untrained::architecture(Method::Pietra).n_inputs;
    (0..n).map(|_| (0..n_features).map(|_| rng.random_range(-reach..reach)).collect()).collect()
}

fn is_close(found: f32, expected: f64) -> bool {
    (f64::from(found) - expected).abs() <= 1e-5 * expected.abs().max(1.0)
}

#[test]
fn predictions_are_those_of_the_plain_networks() {
    for (seed, method) in Method::ALL.into_iter().enumerate() {
        let checkpoint = checkpoint(method, seed as u64);
        let predictor = Predictor::new(&checkpoint, Instructions::widest()).unwrap();
        // 75 is no multiple of any number of lanes.
        let footprints = footprints(75, 3, 1.5);
        for (found, features) in predictor.predict(&footprints).unwrap().iter().zip(&footprints) {
            let expected = plain(&checkpoint, features);
            for (pmf, expected) in found.pmfs.iter().zip(&expected.probabilities) {
                assert!(
                    pmf.probabilities().iter().zip(expected).all(|(p, e)| is_close(*p, *e)),
                    "{method:?}"
                );
            }
            assert_eq!(found.evidence.is_some(), method.is_evidential());
            if let Some(evidence) = found.evidence {
                assert!(is_close(evidence.log_density, expected.log_density), "{evidence:?}");
                assert!(evidence.counts.iter().zip(&expected.evidence).all(|(n, e)| is_close(*n, *e)));
            }
        }
    }
}

#[test]
fn a_prediction_does_not_depend_on_its_neighbours() {
    let predictor = Predictor::new(&checkpoint(Method::Pietra, 1), Instructions::widest()).unwrap();
    let footprints = footprints(70, 4, 1.5);
    let together = predictor.predict(&footprints).unwrap();
    for (index, prediction) in together.iter().enumerate() {
        assert_eq!(predictor.predict(&footprints[index..=index]).unwrap()[0], *prediction);
    }
    assert!(predictor.predict(&footprints[..0]).unwrap().is_empty());
}

fn all_finite(prediction: &Prediction) -> bool {
    let sound = |p: &f32| p.is_finite() && *p >= 0.0;
    let evidence = prediction.evidence.unwrap();
    prediction.pmfs.iter().all(|pmf| pmf.probabilities().iter().all(sound))
        && evidence.log_density.is_finite()
        && evidence.counts.iter().all(sound)
}

#[test]
fn nothing_that_is_a_number_breaks_the_arithmetic() {
    let predictor = Predictor::new(&checkpoint(Method::Pietra, 2), Instructions::widest()).unwrap();
    for reach in [0.0, 1e-30, 10.0, 1e3, 1e20, f32::MAX] {
        let far: Vec<Vec<f32>> = footprints(40, 5, 1.0)
            .into_iter()
            .map(|features| features.into_iter().map(|v| v * reach).collect())
            .collect();
        let predictions = predictor.predict(&far).unwrap();
        assert!(predictions.iter().all(all_finite), "{reach}");
        if reach >= 1e3 {
            let evidence = predictions.iter().map(|p| p.evidence.unwrap().counts[0]).fold(0.0, f32::max);
            assert!(evidence < 1e-6, "nothing speaks for ground like that: {evidence}");
        }
    }
}

#[test]
fn what_is_no_number_or_too_few_of_them_is_refused_with_its_place() {
    let predictor = Predictor::new(&checkpoint(Method::Pietra, 2), Instructions::widest()).unwrap();
    let mut broken = footprints(40, 6, 1.0);
    broken[33][7] = f32::NAN;
    let message = predictor.predict(&broken).unwrap_err().to_string();
    assert_eq!(message, "footprint 33, feature 7: expected a finite number, found NaN");
    broken[33].pop();
    let message = predictor.predict(&broken).unwrap_err().to_string();
    assert_eq!(
        message,
        format!(
            "footprint 33: expected {0} features, found {1}",
            predictor.n_features(),
            predictor.n_features() - 1
        )
    );
}

#[test]
fn checkpoints_that_do_not_hold_together_are_refused() {
    let whole = checkpoint(Method::Pietra, 3);
    let refused = |change: &dyn Fn(&mut Checkpoint)| {
        let mut broken = whole.clone();
        change(&mut broken);
        Predictor::new(&broken, Instructions::widest()).unwrap_err()
    };
    let error = refused(&|broken| drop(broken.tensors.remove("heads.2.1.bias")));
    assert!(matches!(error, PredictorError::Checkpoint(CheckpointError::Mismatch { .. })), "{error}");
    let error =
        refused(&|broken| broken.tensors.get_mut("encoder.0.weight").unwrap().values[5] = f32::INFINITY);
    assert!(error.to_string().contains("encoder.0.weight"), "{error}");
    let error = refused(&|broken| broken.sidecar.standardisation.deviation[3] = 0.0);
    assert!(error.to_string().contains("deviation"), "{error}");
    let huge = |name: &'static str| {
        move |broken: &mut Checkpoint| broken.tensors.get_mut(name).unwrap().values[0] = 1e25
    };
    for name in ["encoder.1.weight", "heads.3.1.bias", "evidence.1.weight", "flow.alpha"] {
        let error = refused(&huge(name));
        assert!(matches!(error, PredictorError::Magnitude { .. }), "{name}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    #[test]
    fn distributions_sum_to_one(seed in 0..1000u64, reach in 0.0..50f32) {
        let predictor = Predictor::new(&checkpoint(Method::Evora, seed), Instructions::widest()).unwrap();
        for prediction in predictor.predict(&footprints(33, seed, reach + 1e-3)).unwrap() {
            for pmf in &prediction.pmfs {
                prop_assert!((pmf.probabilities().iter().sum::<f32>() - 1.0).abs() < 1e-5);
            }
        }
    }
}
