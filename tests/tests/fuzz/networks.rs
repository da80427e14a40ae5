//! Checkpoints and datasets: safetensors of which header, numbers or sidecar are broken.

use std::sync::LazyLock;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use bus::layout::Scalar;
use evidential::{
    Architecture, Checkpoint, Dataset, Example, Method, Predictor, Tensor, WeightsDigest, shipped,
};
use rand::RngExt;
use traversability::N_BINS;

use crate::harness::{Fate, Reader, Rng};
use crate::mutate::{self, integer, once_in};

/// Safetensors with their header broken as text, or their numbers as numbers.
fn broken_tensors(rng: &mut Rng, whole: &[u8]) -> Vec<u8> {
    let (length, rest) = whole.split_first_chunk::<8>().unwrap();
    let (header, data) = rest.split_at(u64::from_le_bytes(*length) as usize);
    let (mut header, mut data) = (header.to_vec(), data.to_vec());
    if once_in(rng, 2) {
        header = mutate::text(rng, std::str::from_utf8(&header).unwrap());
    } else {
        let places: Vec<_> = (0..data.len() / 4).map(|place| (4 * place, Scalar::F32)).collect();
        mutate::scalars(rng, &mut data, &places);
    }
    let length = if once_in(rng, 16) { integer(rng) } else { header.len() as u64 };
    let mut bytes = [length.to_le_bytes().as_slice(), &header, &data].concat();
    if once_in(rng, 8) {
        mutate::bytes(rng, &mut bytes);
    }
    bytes
}

/// The vehicle that the networks which come with the program were trained on.
fn geometry() -> Geometry {
    formats::read_vehicle("pietra_full_size").unwrap().geometry
}

/// Networks as small as they can be, with everything that large ones have.
static CHECKPOINT: LazyLock<Checkpoint> = LazyLock::new(|| {
    let mut sidecar = shipped(Method::Pietra, &geometry()).unwrap().sidecar;
    for patch in [&mut sidecar.layout.height_patch, &mut sidecar.layout.cover_patch] {
        (patch.n_rows, patch.n_cols) = (2, 1);
    }
    let n = sidecar.layout.n_features();
    (sidecar.standardisation.mean, sidecar.standardisation.deviation) = (vec![0.0; n], vec![1.0; n]);
    sidecar.architecture = Architecture {
        n_inputs: n,
        encoder_hidden: vec![3],
        n_latent: 2,
        head_hidden: 3,
        evidence_hidden: 3,
        n_flow_layers: 1,
    };
    sidecar.training = serde_json::Value::Null;
    let shapes = sidecar.architecture.tensor_shapes();
    let tensor =
        |shape: &[usize]| Tensor { shape: shape.to_vec(), values: vec![0.1; shape.iter().product()] };
    let tensors = shapes.iter().map(|(name, shape)| (name.clone(), tensor(shape))).collect();
    Checkpoint::new(sidecar, tensors).unwrap()
});

static WEIGHTS: LazyLock<Vec<u8>> = LazyLock::new(|| CHECKPOINT.weights_bytes().unwrap());
static SIDECAR: LazyLock<String> =
    LazyLock::new(|| String::from_utf8(CHECKPOINT.sidecar_bytes().unwrap()).unwrap());

/// Number of bytes of the weights, weights, sidecar; most sidecars hold the hash of the weights that they come with.
pub fn checkpoint(rng: &mut Rng) -> Vec<u8> {
    let is_sidecar = once_in(rng, 2);
    let weights = if is_sidecar { WEIGHTS.clone() } else { broken_tensors(rng, &WEIGHTS) };
    let mut sidecar = SIDECAR.clone().into_bytes();
    if is_sidecar {
        sidecar = mutate::text(rng, &SIDECAR);
    } else if !once_in(rng, 8) {
        let hash = WeightsDigest::of(&weights).hexadecimal();
        sidecar = SIDECAR.replace(&CHECKPOINT.sidecar.weights_sha256, &hash).into_bytes();
    }
    [(weights.len() as u64).to_le_bytes().as_slice(), &weights, &sidecar].concat()
}

/// Reads the two files, and has the networks that are taken predict.
pub fn read_checkpoint() -> Reader {
    Box::new(|input| {
        let (length, rest) = input.split_first_chunk::<8>().unwrap();
        let (weights, sidecar) = rest.split_at(u64::from_le_bytes(*length) as usize);
        let Ok(checkpoint) = Checkpoint::from_bytes(weights, sidecar) else { return Fate::Refused };
        if let Ok(predictor) = Predictor::new(&checkpoint, Instructions::widest()) {
            let footprint = vec![0.5; predictor.n_features()];
            drop(predictor.predict(&[footprint]));
        }
        Fate::Taken
    })
}

/// Three footprints of two drives.
static DATASET: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let sidecar = &CHECKPOINT.sidecar;
    let origin = evidential::DatasetOrigin {
        vehicle: sidecar.vehicle.clone(),
        layout: sidecar.layout,
        prior: sidecar.prior,
        drives: vec!["a".to_owned(), "b".to_owned()],
        provenance: "made up".to_owned(),
    };
    let example = |k: u32| Example {
        features: vec![0.1 * k as f32; sidecar.layout.n_features()],
        measured: [0.5, f32::NAN, 0.1, 0.2],
        prior: [[1.0 / N_BINS as f32; N_BINS]; 4],
        unevenness_m: 0.01,
        drive: k % 2,
        pose: [f64::from(k), 0.0, 0.0],
    };
    Dataset { origin, examples: (0..3).map(example).collect() }.to_bytes().unwrap()
});

pub fn dataset(rng: &mut Rng) -> Vec<u8> {
    broken_tensors(rng, &DATASET)
}

/// Reads footprints, and asks of those that are taken what training asks.
pub fn read_dataset() -> Reader {
    Box::new(|input| {
        let Ok(dataset) = Dataset::from_bytes(input) else { return Fate::Refused };
        drop(dataset.validate_for_training());
        dataset.unevenness_quantile_m(0.5);
        Fate::Taken
    })
}

/// Weights and sidecar as a message carries them.
pub fn message_payload() -> (u64, Vec<u8>) {
    (WEIGHTS.len() as u64, [WEIGHTS.as_slice(), SIDECAR.as_bytes()].concat())
}

/// A number of bytes that is somewhere in a payload, or not.
pub fn said_length(rng: &mut Rng, n: usize) -> u64 {
    if once_in(rng, 2) { rng.random_range(0..=n as u64 + 1) } else { integer(rng) }
}
