//! The flow that tells how familiar a moment is, fitted to the training examples.

use std::collections::BTreeMap;

use candle_core::{Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use evidential::{LogDensity, RadialFlow};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Data, Settings, TrainError, keep};
use crate::familiarity::{Fade, LAYERS, features, n_features};

const STEPS: usize = 1500;
const BATCH: usize = 512;
const LEARNING_RATE: f64 = 5e-3;
/// Least deviation of a feature.
const DEVIATION_MIN: f32 = 1e-2;
/// Shares of the training examples below which trust is gone, and begins to fade.
const SHARES: [f64; 2] = [0.001, 0.05];

/// Fits the flow on one thread: others would wait longer for one another than they compute.
pub(super) fn fit(
    data: &Data,
    settings: &Settings,
    tensors: &mut BTreeMap<String, crate::Tensor>,
) -> Result<Fade, TrainError> {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(|| fit_flow(data, settings, tensors)),
        Err(_) => fit_flow(data, settings, tensors),
    }
}

/// Fits the flow, adds its weights and tells where trust fades.
fn fit_flow(
    data: &Data,
    settings: &Settings,
    tensors: &mut BTreeMap<String, evidential::Tensor>,
) -> Result<Fade, TrainError> {
    let width = n_features(settings.architecture.senses());
    let rows = standardised(data, width, tensors)?;
    let n = rows.len() / width;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(settings.seed.wrapping_add(2));
    let bound = 1.0 / (width as f32).sqrt();
    let mut uniform = |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(-bound..bound)).collect() };
    let centres = Var::from_vec(uniform(LAYERS * width), (LAYERS, width), &Device::Cpu)?;
    let shapes = Var::from_vec(uniform(2 * LAYERS), (2, LAYERS), &Device::Cpu)?;
    let parameters = ParamsAdamW { lr: LEARNING_RATE, weight_decay: 0.0, ..ParamsAdamW::default() };
    let mut optimiser = AdamW::new(vec![centres.clone(), shapes.clone()], parameters)?;
    for _ in 0..STEPS {
        let batch: Vec<f32> = (0..BATCH)
            .flat_map(|_| {
                let row = rng.random_range(0..n);
                rows[row * width..(row + 1) * width].iter().copied()
            })
            .collect();
        let batch = Tensor::from_vec(batch, (BATCH, width), &Device::Cpu)?;
        let loss = batch.apply_op3(&centres, &shapes, LogDensity)?.mean_all()?.neg()?;
        optimiser.backward_step(&loss)?;
    }
    keep(tensors, "flow.centre", &centres)?;
    keep(tensors, "flow.shape", &shapes)?;
    fade(&rows, width, &tensors["flow.centre"].values, &tensors["flow.shape"].values)
}

/// The features of all training examples, standardised; their means and deviations are kept.
fn standardised(
    data: &Data,
    width: usize,
    tensors: &mut BTreeMap<String, crate::Tensor>,
) -> candle_core::Result<Vec<f32>> {
    let n = data.training.n;
    let (windows, desired) =
        (data.training.windows.flatten_all()?.to_vec1::<f32>()?, data.training.desired.to_vec2::<f32>()?);
    let n_window = windows.len() / n;
    let history = if width > n_features(false) { n_window } else { 0 };
    let mut rows = vec![0.0; n * width];
    for (k, row) in rows.chunks_exact_mut(width).enumerate() {
        features(&windows[k * n_window..][..history], [desired[k][0], desired[k][1]], row);
    }
    let column = |feature: usize| rows.iter().skip(feature).step_by(width).map(|value| f64::from(*value));
    let means: Vec<f32> = (0..width).map(|k| (column(k).sum::<f64>() / n as f64) as f32).collect();
    let deviation = |k: usize| {
        let variance = column(k).map(|value| (value - f64::from(means[k])).powi(2)).sum::<f64>() / n as f64;
        (variance.sqrt() as f32).max(DEVIATION_MIN)
    };
    let deviations: Vec<f32> = (0..width).map(deviation).collect();
    for row in rows.chunks_exact_mut(width) {
        for (value, (mean, deviation)) in row.iter_mut().zip(means.iter().zip(&deviations)) {
            *value = (*value - mean) / deviation;
        }
    }
    for (name, values) in [("flow.mean", means), ("flow.deviation", deviations)] {
        tensors.insert(name.to_owned(), crate::Tensor { shape: vec![width], values });
    }
    Ok(rows)
}

fn fade(rows: &[f32], width: usize, centres: &[f32], shapes: &[f32]) -> Result<Fade, TrainError> {
    let (alpha, beta) = shapes.split_at(LAYERS);
    let flow = RadialFlow::new(centres, alpha, beta);
    let mut scratch = flow.scratch();
    let mut densities: Vec<f64> =
        rows.chunks_exact(width).map(|row| flow.log_density(row, &mut scratch)).collect();
    densities.sort_by(f64::total_cmp);
    let [none, whole] = SHARES.map(|share| densities[(share * densities.len() as f64) as usize]);
    // Examples that are all alike have one density: trust then ends within a unit of it.
    Ok(Fade { none: none.min(whole - 1.0), whole })
}
