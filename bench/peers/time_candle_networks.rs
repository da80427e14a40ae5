//! Times the networks of a learned map in Candle on the CPU, as it comes, on features that are already there.
//!
//! The sizes are those of `surefoot bench learned-map`; arguments: updates and footprints that go through all layers at
//! a time. `RAYON_NUM_THREADS` sets the threads.
#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::time::Instant;

use candle_core::{D, DType, Device, Result, Tensor};
use candle_nn::ops::{leaky_relu, sigmoid, softmax};
use candle_nn::{Linear, Module, VarBuilder, VarMap, linear};

const N_POSES: usize = 81 * 96 * 13;
const WIDTHS: [usize; 4] = [144, 96, 64, 16];
const N_LATENT: usize = 16;
const HEAD_HIDDEN: usize = 32;
const EVIDENCE_HIDDEN: usize = 16;
const N_BINS: usize = 12;
const N_HEADS: usize = 4;
const N_FLOW_LAYERS: usize = 8;
const N_WARM_UP: usize = 3;
const LEAK: f64 = 0.01;

struct Networks {
    encoder: Vec<Linear>,
    heads: Vec<[Linear; 2]>,
    evidence: [Linear; 2],
    centres: Tensor,
}

impl Networks {
    fn new(weights: VarBuilder<'_>) -> Result<Self> {
        let pair = |name: String, width: usize, n: usize| -> Result<[Linear; 2]> {
            let weights = weights.pp(name);
            Ok([linear(N_LATENT, width, weights.pp("0"))?, linear(width, n, weights.pp("1"))?])
        };
        let layers = WIDTHS.windows(2).enumerate();
        let layers = layers.map(|(k, ends)| linear(ends[0], ends[1], weights.pp(format!("encoder.{k}"))));
        let heads = (0..N_HEADS).map(|head| pair(format!("heads.{head}"), HEAD_HIDDEN, N_BINS));
        Ok(Self {
            encoder: layers.collect::<Result<_>>()?,
            heads: heads.collect::<Result<_>>()?,
            evidence: pair("evidence".to_owned(), EVIDENCE_HIDDEN, N_HEADS)?,
            centres: Tensor::rand(-0.5f32, 0.5, (N_FLOW_LAYERS, N_LATENT), weights.device())?,
        })
    }

    /// Distributions and evidence.
    fn forward(&self, features: &Tensor) -> Result<(Vec<Tensor>, Tensor)> {
        let mut z = features.clone();
        for (k, layer) in self.encoder.iter().enumerate() {
            z = layer.forward(&z)?;
            z = if k + 1 < self.encoder.len() { leaky_relu(&z, LEAK)? } else { z };
        }
        let branch = |[first, second]: &[Linear; 2]| second.forward(&leaky_relu(&first.forward(&z)?, LEAK)?);
        let softmaxes = self.heads.iter().map(|head| softmax(&branch(head)?, D::Minus1));
        let log_budget = 0.5 * N_LATENT as f64 * (4.0 * std::f64::consts::PI).ln();
        let n = (self.log_density(&z)? + log_budget)?.clamp(-30f32, 30f32)?.exp()?;
        let evidence = sigmoid(&branch(&self.evidence)?)?.broadcast_mul(&n.unsqueeze(1)?)?;
        Ok((softmaxes.collect::<Result<_>>()?, evidence))
    }

    /// Radial flow with a = 0.9 and b = -0.2 in every layer.
    fn log_density(&self, z: &Tensor) -> Result<Tensor> {
        let (a, b) = (0.9, -0.2);
        let (mut z, mut sum) = (z.clone(), Tensor::zeros(z.dim(0)?, DType::F32, z.device())?);
        for layer in 0..N_FLOW_LAYERS {
            let off = z.broadcast_sub(&self.centres.get(layer)?)?;
            let h = (off.sqr()?.sum(1)?.sqrt()? + a)?.recip()?;
            let bh = (&h * b)?;
            z = (z + off.broadcast_mul(&bh.unsqueeze(1)?)?)?;
            let across = ((&bh + 1.0)?.log()? * (N_LATENT - 1) as f64)?;
            let along = ((bh * h)? * a)?;
            sum = (sum + across + (along + 1.0)?.log()?)?;
        }
        sum - ((z.sqr()?.sum(1)? + N_LATENT as f64 * std::f64::consts::TAU.ln())? * 0.5)?
    }
}

fn main() -> Result<()> {
    let mut arguments =
        std::env::args().skip(1).map(|word| word.parse::<usize>().map_err(candle_core::Error::wrap));
    let n_updates = arguments.next().unwrap_or(Ok(30))?.max(1);
    let chunk = arguments.next().unwrap_or(Ok(8192))?.clamp(1, N_POSES);
    let variables = VarMap::new();
    let networks = Networks::new(VarBuilder::from_varmap(&variables, DType::F32, &Device::Cpu))?;
    let features = Tensor::randn(0f32, 1.0, (N_POSES, WIDTHS[0]), &Device::Cpu)?;
    let mut times_ms = Vec::new();
    for update in 0..n_updates + N_WARM_UP {
        let began = Instant::now();
        for first in (0..N_POSES).step_by(chunk) {
            networks.forward(&features.narrow(0, first, chunk.min(N_POSES - first))?)?;
        }
        if update >= N_WARM_UP {
            times_ms.push(began.elapsed().as_secs_f64() * 1e3);
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let (min, median) = (times_ms[0], times_ms[(times_ms.len() - 1) / 2]);
    println!(
        "{{\"peer\": \"Candle, networks 96-64:16, chunks of {chunk}\", \"updates\": {n_updates}, \
         \"ms\": {{\"min\": {min:.2}, \"median\": {median:.2}}}}}"
    );
    Ok(())
}
