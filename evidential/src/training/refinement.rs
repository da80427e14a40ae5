//! Networks learn on from what they are, of little data and in little time.
//!
//! The encoder stays as it is: what the flow holds for familiar is a place among the latents, and would lose its
//! meaning if they moved. First the flow is fitted to the latents of new and old examples, so that new ground becomes
//! familiar and old ground stays so; the certainty budget is kept. Then the heads and the evidence scales are fitted
//! to the method's loss, with the flow as it is now.

use candle_core::{Device, Tensor};
use terrain::SettingError;

use super::evaluation::scores;
use super::samples::{Samples, gather};
use super::steps::{Place, adam, order, pass};
use super::{CHUNK, FLOW_KEY, JOINT_KEY, Phase, Settings, TrainError, mean_surprise};
use crate::loss::{BatchLoss, LossTerms};
use crate::network::Network;
use crate::{Architecture, Checkpoint, Dataset, DatasetError, DensityRange, Sidecar};

/// How networks learn on. The same settings, networks and data give the same weights, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Of the order of examples.
    pub seed: u64,
    /// Of Adam while the heads are fitted.
    pub learning_rate: f64,
    /// Passes of the heads.
    pub epochs: usize,
    /// Of Adam while the flow is fitted.
    pub flow_learning_rate: f64,
    /// Passes of the flow.
    pub flow_epochs: usize,
    /// Examples per step.
    pub batch: usize,
}

impl Refinement {
    /// Settings that learn well on a few hundred to a few thousand examples.
    pub fn new(seed: u64) -> Self {
        Self { seed, learning_rate: 1e-3, epochs: 12, flow_learning_rate: 1e-3, flow_epochs: 6, batch: 64 }
    }

    fn validate(&self) -> Result<(), SettingError> {
        // The same ranges as those of a whole training.
        let Self { seed, learning_rate, epochs, flow_learning_rate, flow_epochs, batch } = *self;
        let whole = Settings::new(crate::Method::Pietra, seed);
        let whole = Settings { learning_rate, flow_learning_rate, batch, ..whole };
        Settings { epochs_max: epochs, flow_epochs_max: flow_epochs, ..whole }.validate()
    }
}

/// Times that few new examples are repeated at most, to count as much as the old ones beside them.
const REPEATS_MAX: usize = 4;

/// Networks that have learned on, and what they came from.
pub struct Refined {
    before: Checkpoint,
    after: Checkpoint,
    /// Training examples, by which densities are measured.
    familiar: Samples,
}

/// Fits networks to new examples beside old ones, on the calling thread alone. `goes_on` is asked after every pass;
/// `None` when it says no.
///
/// # Errors
/// Settings out of range, examples that are none or of another vehicle, layout or prior than the networks', a loss that
/// is not finite.
pub fn refine(
    checkpoint: &Checkpoint,
    fresh: &Dataset,
    familiar: Option<&Dataset>,
    settings: &Refinement,
    goes_on: &dyn Fn() -> bool,
) -> Result<Option<Refined>, TrainError> {
    settings.validate()?;
    check(checkpoint, "new", fresh)?;
    familiar.map_or(Ok(()), |familiar| check(checkpoint, "old", familiar))?;
    let standardisation = &checkpoint.sidecar.standardisation;
    let mut samples = Samples::with_mirrored(fresh, standardisation);
    let n_fresh = samples.n;
    if let Some(familiar) = familiar {
        samples.append(Samples::with_mirrored(familiar, standardisation));
    }
    let repeats = ((samples.n - n_fresh) / n_fresh).clamp(1, REPEATS_MAX);
    let taken = taken(samples.n, n_fresh, repeats);
    let network = Network::of(checkpoint)?;
    let fit =
        Fit { network: &network, samples: &samples, latents: latents(&network, &samples)?, taken, settings };
    if !(fit.flow(goes_on)? && fit.heads(&terms(&checkpoint.sidecar), goes_on)?) {
        return Ok(None);
    }
    let after = Checkpoint::new(checkpoint.sidecar.clone(), network.tensors()?)?;
    Ok(Some(Refined { before: checkpoint.clone(), after, familiar: samples }))
}

/// Every sample once, the fresh ones, which come first, as often as said.
fn taken(n: usize, n_fresh: usize, repeats: usize) -> Vec<u32> {
    let fresh = (1..repeats).flat_map(|_| 0..n_fresh as u32);
    (0..n as u32).chain(fresh).collect()
}

/// Refuses data that the networks cannot learn on from, or be judged by.
fn check(checkpoint: &Checkpoint, which: &'static str, data: &Dataset) -> Result<(), TrainError> {
    data.validate().map_err(|problem| TrainError::Data { which, problem })?;
    if data.n_measured() == [0; Architecture::N_HEADS] {
        return Err(TrainError::Data { which, problem: DatasetError::Empty });
    }
    checkpoint.require_vehicle(&data.origin.vehicle)?;
    checkpoint.require_layout(&data.origin.layout)?;
    Ok(checkpoint.require_prior(&data.origin.prior)?)
}

/// The loss that networks were trained with; weights that their file does not tell are the usual ones.
fn terms(sidecar: &Sidecar) -> LossTerms {
    let settings: Settings =
        serde_json::from_value(sidecar.training.clone()).unwrap_or_else(|_| Settings::new(sidecar.method, 0));
    LossTerms {
        prior: sidecar.method.prior(),
        prior_evidence: sidecar.prior.evidence,
        log_budget: sidecar
            .density
            .as_ref()
            .map_or_else(|| sidecar.architecture.log_budget(), |density| density.log_budget),
        physics_weight: if sidecar.method.has_physics_loss() { settings.physics_weight } else { 0.0 },
        entropy_weight: if sidecar.method.is_evidential() { settings.entropy_weight } else { 0.0 },
    }
}

/// Latents of all samples, row-major.
fn latents(network: &Network, samples: &Samples) -> Result<Vec<f32>, TrainError> {
    let mut latents = Vec::new();
    for start in (0..samples.n).step_by(CHUNK) {
        let (inputs, _) = samples.chunk(start, CHUNK)?;
        latents.extend(network.latents(&inputs)?.flatten_all()?.to_vec1::<f32>()?);
    }
    Ok(latents)
}

/// A refinement under way.
struct Fit<'a> {
    network: &'a Network,
    samples: &'a Samples,
    latents: Vec<f32>,
    /// Which samples make a pass.
    taken: Vec<u32>,
    settings: &'a Refinement,
}

impl Fit<'_> {
    fn order(&self, key: u64, epoch: usize) -> Vec<u32> {
        let places = order(self.settings.seed, key, epoch, self.taken.len());
        places.into_iter().map(|place| self.taken[place as usize]).collect()
    }

    fn latents_of(&self, indices: &[u32]) -> candle_core::Result<Tensor> {
        gather(&self.latents, self.samples.n, indices)
    }

    /// Fits the flow by likelihood; whether it may go on.
    fn flow(&self, goes_on: &dyn Fn() -> bool) -> Result<bool, TrainError> {
        let variables = self.network.flow_variables();
        if variables.is_empty() {
            return Ok(goes_on());
        }
        let mut optimiser = adam(variables, self.settings.flow_learning_rate)?;
        for epoch in 1..=self.settings.flow_epochs {
            let order = self.order(FLOW_KEY, epoch);
            let place = Place { phase: Phase::Flow, epoch };
            pass(&order, self.settings.batch, place, &mut optimiser, |indices| {
                mean_surprise(self.network, &self.latents_of(indices)?)
            })?;
            if !goes_on() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Fits heads and evidence scales to the loss; whether it may go on.
    fn heads(&self, terms: &LossTerms, goes_on: &dyn Fn() -> bool) -> Result<bool, TrainError> {
        let mut optimiser = adam(self.network.head_variables(), self.settings.learning_rate)?;
        for epoch in 1..=self.settings.epochs {
            let order = self.order(JOINT_KEY, epoch);
            let place = Place { phase: Phase::Joint, epoch };
            pass(&order, self.settings.batch, place, &mut optimiser, |indices| {
                let outputs = self.network.outputs_of_latents(&self.latents_of(indices)?)?;
                outputs.apply_op2(&self.samples.targets(indices)?, BatchLoss::new(*terms))
            })?;
            if !goes_on() {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

impl Refined {
    /// The networks a share of the way from what they were to what they learned, every weight in a straight line.
    ///
    /// Between a network and itself after a little more training the error on old data rises slowly at first, while
    /// that on new data falls at once (Wortsman et al. 2022, Robust fine-tuning of zero-shot models).
    ///
    /// # Errors
    /// Weights that are not finite.
    pub fn at(&self, share: f64) -> Result<Checkpoint, TrainError> {
        let mut tensors = self.before.tensors.clone();
        for (tensor, after) in tensors.values_mut().zip(self.after.tensors.values()) {
            for (value, after) in tensor.values.iter_mut().zip(&after.values) {
                *value += (share * f64::from(after - *value)) as f32;
            }
        }
        let mut checkpoint = Checkpoint::new(self.before.sidecar.clone(), tensors)?;
        let network = Network::of(&checkpoint)?;
        if let Some(density) = &mut checkpoint.sidecar.density {
            let shape = (self.familiar.n, self.before.sidecar.architecture.n_latent);
            let latents = Tensor::from_vec(latents(&network, &self.familiar)?, shape, &Device::Cpu)?;
            if let Some(densities) = network.log_densities(&latents)? {
                *density = range(&densities.to_vec1::<f32>()?, density.log_budget);
            }
        }
        Ok(checkpoint)
    }
}

fn range(densities: &[f32], log_budget: f64) -> DensityRange {
    let least = densities.iter().copied().fold(f32::INFINITY, f32::min);
    let most = densities.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    DensityRange { min: f64::from(least), max: f64::from(most), log_budget }
}

/// How well networks meet every example of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// EMD2 of the expected posterior PMF to the measured bin, per example and parameter; `None` where nothing was
    /// measured.
    emd2: Vec<[Option<f64>; Architecture::N_HEADS]>,
    /// Which drive, or place, each example belongs to.
    drives: Vec<u32>,
}

/// Judges networks by data that they must not have learned from.
///
/// # Errors
/// Examples that are none or of another vehicle, layout or prior than the networks'.
pub fn assess(checkpoint: &Checkpoint, data: &Dataset) -> Result<Assessment, TrainError> {
    check(checkpoint, "held-out", data)?;
    let samples = Samples::new(data, &checkpoint.sidecar.standardisation);
    let scored = scores(&Network::of(checkpoint)?, &samples, &terms(&checkpoint.sidecar))?;
    Ok(Assessment {
        emd2: scored.into_iter().map(|scored| scored.emd2).collect(),
        drives: samples.drives().to_vec(),
    })
}

impl Assessment {
    /// Mean EMD2 per parameter; 0 for one that was never measured.
    pub fn emd2(&self) -> [f64; Architecture::N_HEADS] {
        std::array::from_fn(|head| {
            let (sum, n) = self.sum(head, |_| true);
            sum / f64::from(n.max(1))
        })
    }

    /// The means summed over the parameters, by which networks are compared.
    pub fn total(&self) -> f64 {
        self.emd2().iter().sum()
    }

    /// By how much the total is above that of other networks on the same examples, and the standard error of that:
    /// how much other places of the kind would change it. Places are drawn, not examples, as neighbours are alike
    /// (Cochran, Sampling Techniques, section 6.3).
    pub fn above(&self, other: &Self) -> (f64, f64) {
        let differences = self
            .emd2
            .iter()
            .zip(&other.emd2)
            .map(|(own, other)| std::array::from_fn(|head| Some(own[head]? - other[head]?)));
        let paired = Self { emd2: differences.collect(), drives: self.drives.clone() };
        let mut places = paired.drives.clone();
        places.sort_unstable();
        places.dedup();
        let counts: [f64; 4] = std::array::from_fn(|head| f64::from(paired.sum(head, |_| true).1.max(1)));
        let means = paired.emd2();
        let squares: f64 = places
            .iter()
            .map(|place| {
                let of_place = |head: usize| {
                    let (sum, n) = paired.sum(head, |drive| drive == *place);
                    (sum - means[head] * f64::from(n)) / counts[head]
                };
                (0..counts.len()).map(of_place).sum::<f64>().powi(2)
            })
            .sum();
        let n = places.len() as f64;
        (means.iter().sum(), (squares * n / (n - 1.0).max(1.0)).sqrt())
    }

    fn sum(&self, head: usize, belongs: impl Fn(u32) -> bool) -> (f64, u32) {
        let of_drive = self.emd2.iter().zip(&self.drives).filter(|(_, drive)| belongs(**drive));
        of_drive.filter_map(|(emd2, _)| emd2[head]).fold((0.0, 0), |(sum, n), emd2| (sum + emd2, n + 1))
    }
}
