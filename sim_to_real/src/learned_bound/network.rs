//! The network in Candle: features to corrections, corrections to residuals, and its training.

use super::features::{CORRECTION_S, Examples, N_CORRECTIONS, N_FEATURES, ROWS_PER_CORRECTION, Scaling};
use crate::drive::{HORIZONS, N_QUANTITIES};
use crate::rollout::PER_START;
use candle_core::{D, Device, Result, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::PI;

/// Neurons of each of the two hidden layers.
const N_HIDDEN: usize = 12;
/// Pull of the weights towards none, per step and learning rate (AdamW).
const WEIGHT_DECAY: f64 = 1.0;
/// Where the loss bends from square to straight, in standard deviations.
const BEND: f64 = 3.0;
const SEED: u64 = 0;

/// Two hidden layers beside a straight way from features to corrections. What leads to the corrections begins at zero,
/// so that nothing is corrected before anything is learned.
pub(super) struct Network {
    layers: Vec<[Var; 2]>,
    straight: Var,
    sums: RolloutSums,
}

/// How a network is trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    pub(super) learning_rate: f64,
    /// Rollouts per step.
    pub(super) batch: usize,
    pub(super) n_passes: usize,
}

/// A network with the scaling that it was trained in.
pub(super) struct Trained<'a> {
    pub(super) network: &'a Network,
    pub(super) scaling: &'a Scaling,
}

/// A batch of rollouts as tensors.
struct Batch {
    /// [rollouts x corrections, features], scaled.
    features: Tensor,
    /// [rollouts, corrections].
    speed: Tensor,
    turn: Tensor,
    /// [rollouts, per start].
    residuals: Tensor,
    /// 1 where something was measured.
    is_measured: Tensor,
    unit: Tensor,
    per_sigma: Tensor,
}

/// What sums corrections over a rollout.
struct RolloutSums {
    /// [corrections, corrections]: from yaw rates to the turn at the middle of each correction's time.
    turn: Tensor,
    /// [corrections, horizons]: from rates to what they amount to at a horizon.
    until: Tensor,
    /// [corrections, horizons]: the last correction before a horizon.
    at: Tensor,
}

impl RolloutSums {
    fn new() -> Result<Self> {
        let dt = CORRECTION_S as f32;
        let ends = HORIZONS.map(|steps| steps / ROWS_PER_CORRECTION);
        let table = |n: usize, value: &dyn Fn(usize, usize) -> f32| {
            let values: Vec<f32> = (0..N_CORRECTIONS)
                .flat_map(|from| (0..n).map(move |to| (from, to)))
                .map(|(a, b)| value(a, b))
                .collect();
            Tensor::from_vec(values, (N_CORRECTIONS, n), &Device::Cpu)
        };
        Ok(Self {
            turn: table(N_CORRECTIONS, &|from, to| match from.cmp(&to) {
                std::cmp::Ordering::Less => dt,
                std::cmp::Ordering::Equal => 0.5 * dt,
                std::cmp::Ordering::Greater => 0.0,
            })?,
            until: table(ends.len(), &|from, to| if from < ends[to] { dt } else { 0.0 })?,
            at: table(ends.len(), &|from, to| f32::from(u8::from(from + 1 == ends[to])))?,
        })
    }

    /// Changes of the outcomes [rollouts, per start] by corrections [rollouts, corrections, quantities]; positions turn
    /// with the corrected yaw.
    fn outcomes(&self, corrections: &Tensor, batch: &Batch) -> Result<Tensor> {
        let of = |quantity: usize| corrections.narrow(2, quantity, 1)?.squeeze(2);
        let [ahead, left, yaw_rate] = [of(0)?, of(1)?, of(2)?];
        let [seen_speed, seen_yaw_rate, seen_side_speed] = [of(3)?, of(4)?, of(5)?];
        let turn = (&batch.turn + yaw_rate.matmul(&self.turn)?)?;
        let (sine, cosine) = (turn.sin()?, turn.cos()?);
        let speed = (&batch.speed + &ahead)?;
        let along = ((&speed * &cosine)? - (&left * &sine)?)?;
        let along = (along - (&batch.speed * batch.turn.cos()?)?)?;
        let across = ((&speed * &sine)? + (&left * &cosine)?)?;
        let across = (across - (&batch.speed * batch.turn.sin()?)?)?;
        let changes = [
            along.matmul(&self.until)?,
            across.matmul(&self.until)?,
            yaw_rate.matmul(&self.until)?,
            (ahead + seen_speed)?.matmul(&self.at)?,
            (yaw_rate + seen_yaw_rate)?.matmul(&self.at)?,
            (left + seen_side_speed)?.matmul(&self.at)?,
        ];
        // [rollouts, horizons, quantities], as the residuals stand.
        Tensor::stack(&changes, D::Minus1)?.flatten_from(1)
    }
}

impl Network {
    fn new(random: &mut Xoshiro256PlusPlus) -> Result<Self> {
        let widths = [N_FEATURES, N_HIDDEN, N_HIDDEN, N_QUANTITIES];
        let mut layers = Vec::new();
        for (place, pair) in widths.windows(2).enumerate() {
            // Glorot and Bengio 2010.
            let bound = if place == 2 { 0.0 } else { (6.0 / (pair[0] + pair[1]) as f32).sqrt() };
            let mut drawn = || if bound > 0.0 { random.random_range(-bound..bound) } else { 0.0 };
            let weights: Vec<f32> = (0..pair[0] * pair[1]).map(|_| drawn()).collect();
            layers.push([
                Var::from_vec(weights, (pair[0], pair[1]), &Device::Cpu)?,
                Var::from_vec(vec![0.0_f32; pair[1]], pair[1], &Device::Cpu)?,
            ]);
        }
        let straight = Var::zeros((N_FEATURES, N_QUANTITIES), candle_core::DType::F32, &Device::Cpu)?;
        Ok(Self { layers, straight, sums: RolloutSums::new()? })
    }

    /// Residuals with the correction [rollouts, per start]; 0 where nothing was measured.
    fn residuals(&self, batch: &Batch) -> Result<Tensor> {
        let mut values = batch.features.clone();
        for (place, [weights, biases]) in self.layers.iter().enumerate() {
            values = values.matmul(weights)?.broadcast_add(biases)?;
            if place + 1 < self.layers.len() {
                values = values.tanh()?;
            }
        }
        let values = (values + batch.features.matmul(&self.straight)?)?;
        let n = batch.speed.dim(0)?;
        let corrections = values.broadcast_mul(&batch.unit)?.reshape((n, N_CORRECTIONS, N_QUANTITIES))?;
        let changes = self.sums.outcomes(&corrections, batch)?.broadcast_mul(&batch.per_sigma)?;
        (&batch.residuals + changes)? * &batch.is_measured
    }
}

impl Trained<'_> {
    /// The residuals with the learned correction.
    pub(super) fn corrected(&self, examples: &Examples) -> Result<Vec<f32>> {
        let rows: Vec<usize> = (0..examples.n()).collect();
        self.network.residuals(&Batch::of(examples, self.scaling, &rows)?)?.flatten_all()?.to_vec1()
    }
}

impl Batch {
    fn of(examples: &Examples, scaling: &Scaling, rows: &[usize]) -> Result<Self> {
        let tensor = |values: &[f32], width: usize| {
            let own: Vec<f32> =
                rows.iter().flat_map(|row| &values[row * width..(row + 1) * width]).copied().collect();
            Tensor::from_vec(own, (rows.len(), width), &Device::Cpu)
        };
        let vector = |values: Vec<f32>| {
            let n = values.len();
            Tensor::from_vec(values, n, &Device::Cpu)
        };
        let features = tensor(&examples.features, N_CORRECTIONS * N_FEATURES)?
            .reshape((rows.len() * N_CORRECTIONS, N_FEATURES))?
            .broadcast_sub(&vector(scaling.centre.clone())?)?
            .broadcast_mul(&vector(scaling.per_spread.clone())?)?
            // What lies far outside of the drives learned from must not be carried on without end.
            .clamp(-4.0, 4.0)?;
        let residuals = tensor(&examples.residuals, PER_START)?;
        Ok(Self {
            features,
            speed: tensor(&examples.foretold[0], N_CORRECTIONS)?,
            turn: tensor(&examples.foretold[1], N_CORRECTIONS)?,
            is_measured: residuals.ne(0.0)?.to_dtype(residuals.dtype())?,
            residuals,
            unit: vector(scaling.unit.to_vec())?,
            per_sigma: vector(examples.per_sigma.clone())?,
        })
    }
}

/// Mean pseudo-Huber loss, as the fits have it.
fn loss(residuals: &Tensor) -> Result<Tensor> {
    let bent = ((residuals / BEND)?.sqr()? + 1.0)?.sqrt()?;
    (bent - 1.0)?.mean_all()? * (2.0 * BEND * BEND)
}

/// Trains for a number of passes with a rate that falls along half a cosine over the pace's own number; `after_pass`
/// sees every pass, from 1.
pub(super) fn fitted(
    examples: &Examples,
    scaling: &Scaling,
    (pace, n_passes): (Pace, usize),
    after_pass: &mut dyn FnMut(usize, &Network) -> Result<()>,
) -> Result<Network> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let network = Network::new(&mut random)?;
    let mut variables: Vec<Var> = network.layers.iter().flatten().cloned().collect();
    variables.push(network.straight.clone());
    let settings =
        ParamsAdamW { weight_decay: WEIGHT_DECAY, lr: pace.learning_rate, ..ParamsAdamW::default() };
    let mut optimiser = AdamW::new(variables, settings)?;
    let mut order: Vec<usize> = (0..examples.n()).collect();
    for pass in 1..=n_passes {
        order.shuffle(&mut random);
        let done = (pass - 1) as f64 / pace.n_passes as f64;
        optimiser.set_learning_rate(0.5 * pace.learning_rate * (1.0 + (PI * done).cos()));
        for rows in order.chunks(pace.batch) {
            let residuals = network.residuals(&Batch::of(examples, scaling, rows)?)?;
            optimiser.backward_step(&loss(&residuals)?)?;
        }
        after_pass(pass, &network)?;
    }
    Ok(network)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    /// `n` rollouts straight on at 2 m/s of which only one feature differs, drawn evenly from -1 to 1.
    fn straight(n: usize, residual: impl Fn(f32, usize) -> f32) -> Examples {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let drawn: Vec<f32> = (0..n).map(|_| random.random_range(-1.0..1.0)).collect();
        let one =
            |drawn: f32| std::array::from_fn::<f32, N_FEATURES, _>(|i| if i == 3 { drawn } else { 0.0 });
        Examples {
            features: drawn.iter().flat_map(|&drawn| one(drawn).repeat(N_CORRECTIONS)).collect(),
            foretold: [vec![2.0; n * N_CORRECTIONS], vec![0.0; n * N_CORRECTIONS]],
            residuals: drawn
                .iter()
                .flat_map(|&own| (0..PER_START).map(move |i| (own, i)))
                .map(|(a, i)| residual(a, i))
                .collect(),
            per_sigma: vec![10.0; PER_START],
        }
    }

    /// A yaw rate w more at 2 m/s, straight on: after T the turn is w T, along 2 sin(w T) / w - 2 T, across
    /// 2 (1 - cos(w T)) / w.
    #[test]
    fn a_corrected_yaw_rate_bends_the_path() {
        let examples = straight(1, |_, _| 1.0);
        let batch = Batch::of(&examples, &Scaling::of(&examples), &[0]).unwrap();
        let w = 0.3_f32;
        let values: Vec<f32> = (0..N_CORRECTIONS).flat_map(|_| [0.0, 0.0, w, 0.0, 0.0, 0.0]).collect();
        let corrections = Tensor::from_vec(values, (1, N_CORRECTIONS, N_QUANTITIES), &Device::Cpu).unwrap();
        let outcomes = RolloutSums::new().unwrap().outcomes(&corrections, &batch).unwrap();
        let outcomes: Vec<f32> = outcomes.flatten_all().unwrap().to_vec1().unwrap();
        let turn = w * 2.0;
        let expected = [2.0 * turn.sin() / w - 4.0, 2.0 * (1.0 - turn.cos()) / w, turn, 0.0, w, 0.0];
        for (found, expected) in outcomes[PER_START - N_QUANTITIES..].iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3, "{outcomes:?}");
        }
    }
}
