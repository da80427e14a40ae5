use std::sync::LazyLock;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use physics_prior::PriorConfig;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use traversability::N_BINS;

use super::*;
use crate::{Example, FeatureLayout, Method, Predictor, loss};

const GEOMETRY: Geometry = Geometry {
    wheelbase_m: 2.0,
    track_m: 1.2,
    length_m: 3.0,
    width_m: 1.5,
    rear_overhang_m: 0.5,
    ground_clearance_m: 0.3,
    wheel_radius_m: 0.4,
};

/// A feature in the middle column, which a mirror leaves in its place.
const MIDDLE: usize = 3;

/// Ground of one number, [`MIDDLE`]: traction falls and angles rise with it. The physics prior says nothing.
fn dataset(n: usize, seed: u64) -> Dataset {
    let layout = FeatureLayout::for_vehicle(&GEOMETRY);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let examples = (0..n).map(|_| {
        let mut features: Vec<f32> = (0..layout.n_features()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let rough: f32 = rng.random_range(0.0..1.0);
        features[MIDDLE] = 4.0 * rough - 2.0;
        let mut noisy = |value: f32| value + rng.random_range(-0.03..0.03);
        let measured = [noisy(1.0 - rough), f32::NAN, noisy(0.8 * rough), noisy(0.5 * rough)];
        Example {
            features,
            measured,
            prior: [[1.0 / N_BINS as f32; N_BINS]; 4],
            unevenness_m: rough,
            drive: 0,
            pose: [0.0; 3],
        }
    });
    let mut examples: Vec<Example> = examples.collect();
    // Angular traction is known of every other footprint.
    for example in examples.iter_mut().step_by(2) {
        example.measured[1] = example.measured[0] * 0.5;
    }
    let origin = DatasetOrigin {
        vehicle: "test".to_owned(),
        layout,
        prior: PriorConfig::default(),
        drives: vec!["drawn".to_owned()],
        provenance: String::new(),
    };
    Dataset { origin, examples }
}

static TRAINING: LazyLock<Dataset> = LazyLock::new(|| dataset(1200, 1));
static VALIDATION: LazyLock<Dataset> = LazyLock::new(|| dataset(300, 2));

fn quick(method: Method) -> Settings {
    Settings {
        batch: 64,
        epochs_max: 10,
        flow_epochs_max: 2,
        learning_rate: 3e-3,
        encoder_hidden: vec![32],
        ..Settings::new(method, 7)
    }
}

fn trained(settings: &Settings) -> Outcome {
    train(&TRAINING, &VALIDATION, settings, "here", &mut |_| ControlFlow::Continue(())).unwrap()
}

fn refusal(training: &Dataset, validation: &Dataset, settings: &Settings) -> TrainError {
    let outcome = train(training, validation, settings, "here", &mut |_| ControlFlow::Continue(()));
    outcome.map(|_| ()).unwrap_err()
}

/// EMD2 of the uniform distribution, per parameter.
fn uniform_error(dataset: &Dataset) -> [f64; 4] {
    let uniform = [1.0 / N_BINS as f64; N_BINS];
    std::array::from_fn(|parameter| {
        let bins =
            dataset.examples.iter().filter_map(|e| PARAMETER_BINS[parameter].bin_of(e.measured[parameter]));
        let errors: Vec<f64> = bins
            .map(|bin| {
                crate::dirichlet::emd2(&uniform, &std::array::from_fn(|b| f64::from(u8::from(b == bin))))
            })
            .collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    })
}

#[test]
fn every_method_learns_what_there_is_to_learn() {
    let uniform = uniform_error(&VALIDATION);
    for method in Method::ALL {
        let outcome = trained(&quick(method));
        for (parameter, error) in outcome.validation_emd2.iter().enumerate() {
            assert!(
                *error < 0.4 * uniform[parameter],
                "{method:?} {parameter}: {error} {}",
                uniform[parameter]
            );
        }
        assert_eq!(outcome.learned_weight.is_some(), method.is_evidential());
        assert_eq!(outcome.checkpoint.sidecar.density.is_some(), method.is_evidential());
        let joint: Vec<&Epoch> = outcome.curves.iter().filter(|epoch| epoch.phase == Phase::Joint).collect();
        assert!(joint[joint.len() - 1].training_loss < joint[0].training_loss, "{method:?}");
    }
}

#[test]
fn same_seed_gives_the_same_weights_for_any_number_of_threads_and_another_seed_others() {
    let settings = quick(Method::Pietra);
    let alone = trained(&settings);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let among = pool.install(|| trained(&settings));
    assert_eq!(alone, among);
    assert_eq!(alone.checkpoint.weights_bytes().unwrap(), among.checkpoint.weights_bytes().unwrap());
    let other = trained(&Settings { seed: 8, ..settings });
    assert_ne!(alone.checkpoint.tensors, other.checkpoint.tensors);
}

#[test]
fn interruption_keeps_the_best_weights_so_far() {
    let settings = Settings { epochs_max: 3, ..quick(Method::Vanilla) };
    let whole = trained(&settings);
    let long = Settings { epochs_max: 50, ..settings };
    let stop = &mut |epoch: &Epoch| match epoch.epoch {
        3 => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    let broken_off = train(&TRAINING, &VALIDATION, &long, "here", stop).unwrap();
    assert_eq!(broken_off.end, TrainingEnd::Interrupted);
    assert_eq!(whole.end, TrainingEnd::Finished);
    assert_eq!(broken_off.checkpoint.tensors, whole.checkpoint.tensors);
    assert_eq!(broken_off.curves, whole.curves);
}

#[test]
fn training_ends_when_validation_no_longer_gets_better() {
    let settings = Settings { epochs_max: 60, patience: 2, learning_rate: 2e-2, ..quick(Method::Vanilla) };
    let curves = trained(&settings).curves;
    let best = curves.iter().rfind(|epoch| epoch.is_best).unwrap().epoch;
    assert!(curves.len() < 60);
    assert_eq!(curves.len(), best + 2);
    let least = curves.iter().map(|epoch| epoch.validation_error).fold(f64::INFINITY, f64::min);
    assert_eq!(curves[best - 1].validation_error, least);
}

#[test]
fn flow_alone_is_fitted_behind_a_frozen_predictor() {
    let joint = trained(&Settings { flow_epochs_max: 0, ..quick(Method::Pietra) });
    let fitted = trained(&Settings { flow_epochs_max: 10, ..quick(Method::Pietra) });
    let (before, after) = (&joint.checkpoint.tensors, &fitted.checkpoint.tensors);
    for (name, tensor) in before {
        assert_eq!(tensor == &after[name], !name.starts_with("flow"), "{name}");
    }
    let flow: Vec<&Epoch> = fitted.curves.iter().filter(|epoch| epoch.phase == Phase::Flow).collect();
    assert!(flow[flow.len() - 1].validation_error < flow[0].validation_error);
}

#[test]
fn learned_weight_is_high_where_there_was_data() {
    let weight = trained(&Settings { flow_epochs_max: 20, ..quick(Method::Pietra) }).learned_weight.unwrap();
    assert!(weight.p05 <= weight.p25 && weight.p25 <= weight.p50 && weight.p75 <= weight.p95);
    assert!(weight.p50 > 0.5, "{weight:?}");
}

#[test]
fn data_that_does_not_fit_is_refused() {
    let settings = quick(Method::Vanilla);
    let changed = |change: fn(&mut Dataset)| {
        let mut dataset = VALIDATION.clone();
        change(&mut dataset);
        dataset
    };
    let empty = changed(|d| d.examples.clear());
    let told = refusal(&empty, &VALIDATION, &settings).to_string();
    assert_eq!(told, "training data: dataset: expected at least one example, found none");
    let one_class = changed(|d| d.examples.iter_mut().for_each(|e| e.measured = [0.52, 0.9, 0.01, 0.02]));
    let error = refusal(&one_class, &VALIDATION, &settings);
    assert!(matches!(error, TrainError::OneClass { n: 300 }), "{error}");
    let infinite = changed(|d| d.examples[5].features[2] = f32::INFINITY);
    let told = refusal(&TRAINING, &infinite, &settings).to_string();
    assert!(
        told.starts_with("validation data: example 5, features: expected a finite number, found inf"),
        "{told}"
    );
    let unmeasured = changed(|d| d.examples.iter_mut().for_each(|e| e.measured[3] = f32::NAN));
    let told = refusal(&TRAINING, &unmeasured, &settings).to_string();
    assert!(told.starts_with("validation data: pitch: expected measurements"), "{told}");
}

#[test]
fn data_sets_of_different_origin_are_refused() {
    let settings = quick(Method::Vanilla);
    type Change = fn(&mut DatasetOrigin);
    let cases: [(&str, Change); 3] = [
        ("vehicle", |origin| origin.vehicle = "another".to_owned()),
        ("layout", |origin| origin.layout.height_scale_m *= 2.0),
        ("prior", |origin| origin.prior.evidence = 5.0),
    ];
    for (what, change) in cases {
        let mut other = VALIDATION.clone();
        change(&mut other.origin);
        let error = refusal(&TRAINING, &other, &settings);
        assert!(matches!(&error, TrainError::Mismatch { what: found, .. } if *found == what), "{error}");
    }
    let told = refusal(&TRAINING, &VALIDATION, &Settings { batch: 0, ..settings }).to_string();
    assert_eq!(told, "settings: batch: expected a count from 1 to 65536, found 0");
}

#[test]
fn loss_that_runs_away_names_epoch_and_step() {
    // Twenty layers whose weights change by one a step leave the range of f32.
    let wild = Settings { learning_rate: 1.0, encoder_hidden: vec![32; 20], ..quick(Method::Pietra) };
    let error = refusal(&TRAINING, &VALIDATION, &wild);
    let TrainError::NonFiniteLoss { phase, epoch, step, found } = &error else { panic!("{error}") };
    assert!(*epoch >= 1 && *step >= 1 && !found.is_finite());
    let place = format!("{phase}, epoch {epoch}, step {step}: expected a finite loss, found {found}");
    assert!(error.to_string().starts_with(&place), "{error}");
}

/// A small checkpoint with evidence.
pub(crate) fn checkpoint() -> Checkpoint {
    trained(&Settings { epochs_max: 1, flow_epochs_max: 1, ..quick(Method::Pietra) }).checkpoint
}

#[test]
fn fast_inference_says_what_the_trained_networks_say() {
    let settings = quick(Method::Pietra);
    let mut run = Run::new(&TRAINING, &VALIDATION, &settings).unwrap();
    run.fit(&mut |_| ControlFlow::Continue(())).unwrap();
    let (inputs, _) = run.validation.chunk(0, run.validation.n).unwrap();
    let outputs = run.network.outputs(&inputs).unwrap().to_vec2::<f32>().unwrap();
    let checkpoint = run.checkpoint(&TRAINING.origin, "here").unwrap();
    let footprints: Vec<&[f32]> = VALIDATION.examples.iter().map(|e| e.features.as_slice()).collect();
    let predictions =
        Predictor::new(&checkpoint, Instructions::widest()).unwrap().predict(&footprints).unwrap();
    for (output, prediction) in outputs.iter().zip(&predictions) {
        let evidence = prediction.evidence.unwrap();
        let log_density = output[4 * N_BINS + 4];
        assert!((evidence.log_density - log_density).abs() < 1e-5 * log_density.abs().max(1.0));
        let n = loss::evidence(f64::from(log_density), run.terms.log_budget);
        for parameter in 0..4 {
            let expected = loss::softmax(&output[parameter * N_BINS..(parameter + 1) * N_BINS]);
            let found = prediction.pmfs[parameter].probabilities();
            assert!(found.iter().zip(expected).all(|(f, e)| (f64::from(*f) - e).abs() < 1e-5));
            let expected = n * loss::sigmoid(f64::from(output[4 * N_BINS + parameter]));
            assert!((f64::from(evidence.counts[parameter]) / expected - 1.0).abs() < 1e-4);
        }
    }
}
