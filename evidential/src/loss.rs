//! The training losses of all methods for a batch, as one differentiable operation.
//!
//! Evidence and posterior are those of equations 9 and 10 with an evidence scale s per parameter: n = N p(z) and
//! `beta = n_prior p_prior + s n p`. The loss of a parameter is UEMD2 to the measured bin (equation 13), plus kappa
//! times UEMD2 to the physics prior (equation 14), minus the entropy weight times the entropy of Dir(beta), a bonus as
//! in NatPN. Methods without evidence take EMD2 of the prediction in the place of both UEMD2s.

use std::sync::OnceLock;

use candle_core::{CpuStorage, CustomOp2, DType, Layout, Result, Shape, Tensor, bail};
use traversability::N_BINS;

use crate::{Architecture, Prior, dirichlet};

const N_HEADS: usize = Architecture::N_HEADS;
/// Logits of all heads. The networks give these per example, then with evidence a logit of the evidence scale per head
/// and the log density.
pub(crate) const N_LOGITS: usize = N_HEADS * N_BINS;
/// Numbers per example of a target: the physics prior of all heads, then the measured bin of each, negative where
/// the measurement means nothing.
pub(crate) const N_TARGETS: usize = N_LOGITS + N_HEADS;

/// Evidence stays within exp(-30) and exp(30); the gradient passes through (NatPN).
const LOG_EVIDENCE_MAX: f64 = 30.0;
/// Smaller concentrations count as this much in the entropy, and have no gradient there. The physics prior leaves
/// bins empty, and the entropy falls as -1/beta towards an empty bin: without a floor, bins that nobody believes in
/// would outweigh all data.
const ENTROPY_CONCENTRATION_MIN: f64 = 1e-2;

/// Concentrations or probabilities over the bins of one parameter.
type PerBin = [f64; N_BINS];

/// What the loss of a method is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LossTerms {
    /// What learned evidence is weighed against.
    pub prior: Prior,
    /// Evidence of that prior.
    pub prior_evidence: f64,
    /// Logarithm of the certainty budget N.
    pub log_budget: f64,
    /// kappa of equation 14; 0 leaves the physics out of the loss.
    pub physics_weight: f64,
    /// Weight of the entropy bonus.
    pub entropy_weight: f64,
}

/// Evidence n = N p(z) within its bounds (equation 10).
pub(crate) fn evidence(log_density: f64, log_budget: f64) -> f64 {
    (log_density + log_budget).clamp(-LOG_EVIDENCE_MAX, LOG_EVIDENCE_MAX).exp()
}

/// 1 / (1 + exp(-x)).
pub(crate) fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Probabilities of logits.
pub(crate) fn softmax(logits: &[f32]) -> PerBin {
    let largest = logits.iter().fold(f32::NEG_INFINITY, |largest, &logit| largest.max(logit));
    let weights: PerBin = std::array::from_fn(|bin| f64::from(logits[bin] - largest).exp());
    let per_sum = 1.0 / weights.iter().sum::<f64>();
    weights.map(|weight| weight * per_sum)
}

impl LossTerms {
    /// The prior of the posterior, as concentrations.
    fn prior_concentration(&self, physics: &PerBin) -> PerBin {
        match self.prior {
            Prior::Physics => physics.map(|p| self.prior_evidence * p),
            Prior::Uniform => [self.prior_evidence / N_BINS as f64; N_BINS],
            Prior::None => [0.0; N_BINS],
        }
    }

    /// How well the expected posterior PMF (equation 11) meets what was measured at one example.
    pub(crate) fn score(&self, output: &[f32], target: &[f32]) -> Scored {
        let evidence = (!matches!(self.prior, Prior::None))
            .then(|| evidence(f64::from(output[N_LOGITS + N_HEADS]), self.log_budget));
        let emd2 = std::array::from_fn(|head| {
            let measured = measured_bin(target, head)?;
            let bins = head * N_BINS..(head + 1) * N_BINS;
            let predicted = softmax(&output[bins.clone()]);
            let Some(evidence) = evidence else {
                return Some(dirichlet::emd2(&predicted, &one_hot(measured)));
            };
            let physics: PerBin = std::array::from_fn(|bin| f64::from(target[bins.start + bin]));
            let prior = self.prior_concentration(&physics);
            let weight = sigmoid(f64::from(output[N_LOGITS + head])) * evidence;
            let per_total = 1.0 / (prior.iter().sum::<f64>() + weight);
            let mean = std::array::from_fn(|bin| (prior[bin] + weight * predicted[bin]) * per_total);
            Some(dirichlet::emd2(&mean, &one_hot(measured)))
        });
        Scored { emd2, learned_weight: evidence.map(|n| n / (n + self.prior_evidence)) }
    }

    /// Mean loss of a batch, summed over the parameters, and its gradient by all outputs.
    ///
    /// `outputs` and `targets` are row-major with one example per row. Means of the data term run over the examples
    /// whose measurement of that parameter means something, all others over all examples.
    pub(crate) fn batch(&self, outputs: &[f32], targets: &[f32]) -> (f64, Vec<f32>) {
        let n = targets.len() / N_TARGETS;
        let width = outputs.len() / n;
        let mut valid = [0usize; N_HEADS];
        for target in targets.chunks_exact(N_TARGETS) {
            for (count, bin) in valid.iter_mut().zip(&target[N_LOGITS..]) {
                *count += usize::from(*bin >= 0.0);
            }
        }
        let data_share = valid.map(|count| 1.0 / count.max(1) as f64);
        let mut gradient = vec![0.0; outputs.len()];
        let mut sum = 0.0;
        let rows = outputs.chunks_exact(width).zip(targets.chunks_exact(N_TARGETS));
        for ((output, target), slot) in rows.zip(gradient.chunks_exact_mut(width)) {
            for (head, &data) in data_share.iter().enumerate() {
                let shares = Shares { data, all: 1.0 / n as f64 };
                sum += self.head(head, output, target, shares, slot);
            }
        }
        (sum, gradient)
    }

    /// Adds one parameter's gradient and returns its loss, both times the shares of their means.
    fn head(&self, head: usize, output: &[f32], target: &[f32], shares: Shares, slot: &mut [f32]) -> f64 {
        let bins = head * N_BINS..(head + 1) * N_BINS;
        let predicted = softmax(&output[bins.clone()]);
        let physics: PerBin = std::array::from_fn(|bin| f64::from(target[bins.start + bin]));
        let measured = measured_bin(target, head);
        if matches!(self.prior, Prior::None) {
            let (loss, by_p) = self.plain(&predicted, &physics, measured, shares);
            softmax_backward(&predicted, &by_p, &mut slot[bins]);
            return loss;
        }
        let scale = sigmoid(f64::from(output[N_LOGITS + head]));
        let weight = scale * evidence(f64::from(output[N_LOGITS + N_HEADS]), self.log_budget);
        let prior = self.prior_concentration(&physics);
        let concentration: PerBin = std::array::from_fn(|bin| prior[bin] + weight * predicted[bin]);
        let (loss, by_concentration) = self.evidential(&concentration, &physics, measured, shares);
        softmax_backward(&predicted, &by_concentration.map(|g| weight * g), &mut slot[bins]);
        let by_log_weight = weight * dot(&by_concentration, &predicted);
        slot[N_LOGITS + head] = (by_log_weight * (1.0 - scale)) as f32;
        slot[N_LOGITS + N_HEADS] += by_log_weight as f32;
        loss
    }

    /// Loss and its gradient by the predicted distribution, without evidence.
    fn plain(&self, p: &PerBin, physics: &PerBin, measured: Option<usize>, shares: Shares) -> (f64, PerBin) {
        let mut total = Sum::default();
        if let Some(bin) = measured {
            let target = one_hot(bin);
            total.add(shares.data, dirichlet::emd2(p, &target), &dirichlet::emd2_gradient(p, &target));
        }
        if self.physics_weight > 0.0 {
            let share = shares.all * self.physics_weight;
            total.add(share, dirichlet::emd2(p, physics), &dirichlet::emd2_gradient(p, physics));
        }
        (total.value, total.gradient)
    }

    /// Loss and its gradient by the concentrations.
    fn evidential(
        &self,
        concentration: &PerBin,
        physics: &PerBin,
        measured: Option<usize>,
        shares: Shares,
    ) -> (f64, PerBin) {
        let mut total = Sum::default();
        if let Some(bin) = measured {
            let (value, gradient) = dirichlet::uemd2_with_gradient(concentration, &one_hot(bin));
            total.add(shares.data, value, &gradient);
        }
        if self.physics_weight > 0.0 {
            let (value, gradient) = dirichlet::uemd2_with_gradient(concentration, physics);
            total.add(shares.all * self.physics_weight, value, &gradient);
        }
        if self.entropy_weight > 0.0 {
            let floored = concentration.map(|beta| beta.max(ENTROPY_CONCENTRATION_MIN));
            let mut gradient = dirichlet::entropy_gradient(&floored);
            for (slope, &beta) in gradient.iter_mut().zip(concentration) {
                *slope = if beta < ENTROPY_CONCENTRATION_MIN { 0.0 } else { *slope };
            }
            total.add(-shares.all * self.entropy_weight, dirichlet::entropy(&floored), &gradient);
        }
        (total.value, total.gradient)
    }
}

/// How well one example is met.
pub(crate) struct Scored {
    /// EMD2 of the expected posterior PMF to the measured bin; `None` where the measurement means nothing.
    pub emd2: [Option<f64>; N_HEADS],
    /// n / (n + n_prior); `None` without evidence.
    pub learned_weight: Option<f64>,
}

/// Which bin was measured, `None` where that means nothing.
fn measured_bin(target: &[f32], head: usize) -> Option<usize> {
    let bin = target[N_LOGITS + head];
    (bin >= 0.0).then_some(bin as usize)
}

/// What one example counts in the means of a batch.
#[derive(Clone, Copy, Debug)]
struct Shares {
    /// In the mean over meaningful measurements.
    data: f64,
    /// In the mean over all examples.
    all: f64,
}

/// Weighted terms of a loss.
#[derive(Default)]
struct Sum {
    value: f64,
    gradient: PerBin,
}

impl Sum {
    fn add(&mut self, weight: f64, value: f64, gradient: &PerBin) {
        self.value += weight * value;
        for (sum, term) in self.gradient.iter_mut().zip(gradient) {
            *sum += weight * term;
        }
    }
}

fn one_hot(bin: usize) -> PerBin {
    let mut target = [0.0; N_BINS];
    target[bin.min(N_BINS - 1)] = 1.0;
    target
}

fn dot(left: &PerBin, right: &PerBin) -> f64 {
    left.iter().zip(right).map(|(l, r)| l * r).sum()
}

/// Gradient by logits from that by their probabilities: p_j (g_j - sum p g).
fn softmax_backward(p: &PerBin, by_p: &PerBin, by_logits: &mut [f32]) {
    let mean = dot(p, by_p);
    for bin in 0..N_BINS {
        by_logits[bin] = (p[bin] * (by_p[bin] - mean)) as f32;
    }
}

/// [`LossTerms::batch`] as an operation on (outputs, targets) whose result is a scalar. The gradient falls out of the
/// forward pass and is kept for the backward pass.
pub(crate) struct BatchLoss {
    terms: LossTerms,
    gradient: OnceLock<Vec<f32>>,
}

impl BatchLoss {
    pub(crate) fn new(terms: LossTerms) -> Self {
        Self { terms, gradient: OnceLock::new() }
    }
}

impl CustomOp2 for BatchLoss {
    fn name(&self) -> &'static str {
        "evidential-batch-loss"
    }

    fn cpu_fwd(
        &self,
        outputs: &CpuStorage,
        outputs_layout: &Layout,
        targets: &CpuStorage,
        targets_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let outputs = contiguous(outputs, outputs_layout)?;
        let targets = contiguous(targets, targets_layout)?;
        let (loss, gradient) = self.terms.batch(outputs, targets);
        drop(self.gradient.set(gradient));
        Ok((CpuStorage::F32(vec![loss as f32]), Shape::from(())))
    }

    fn bwd(
        &self,
        outputs: &Tensor,
        _targets: &Tensor,
        _loss: &Tensor,
        by_loss: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let Some(gradient) = self.gradient.get() else { bail!("backward before forward") };
        let by_loss = by_loss.to_dtype(DType::F32)?.to_scalar::<f32>()?;
        let scaled: Vec<f32> = gradient.iter().map(|slope| slope * by_loss).collect();
        Ok((Some(Tensor::from_vec(scaled, outputs.shape(), outputs.device())?), None))
    }
}

/// The numbers of a contiguous array of f32.
pub(crate) fn contiguous<'a>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [f32]> {
    let Some((start, end)) = layout.contiguous_offsets() else { bail!("expected a contiguous array") };
    Ok(&storage.as_slice::<f32>()?[start..end])
}

#[cfg(test)]
mod tests;
