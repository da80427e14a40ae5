//! Fits the networks of a [`Method`](crate::Method) to a dataset.
//!
//! Predictor and flow are trained together on the method's loss until the validation error of their running mean over
//! the passes no longer falls; the best mean is kept. Then the predictor is frozen and the flow alone is fitted to the
//! latents of the training data by maximum likelihood, as NatPN and EVORA do.

mod error;
mod evaluation;
mod refinement;
mod samples;
mod settings;
mod steps;

use std::ops::ControlFlow;

use candle_core::{Device, Tensor};
use serde::{Deserialize, Serialize};

use crate::loss::{BatchLoss, LossTerms};
use crate::network::Network;
use crate::{
    Architecture, Checkpoint, Dataset, DatasetError, DatasetOrigin, DensityRange, PARAMETER_BINS,
    PARAMETER_NAMES, Sidecar, Standardisation,
};
pub use error::TrainError;
use evaluation::Evaluation;
pub use evaluation::Percentiles;
pub use refinement::{Assessment, Refined, Refinement, assess, refine};
use samples::{Samples, gather};
pub use settings::Settings;
use steps::{Best, Place, RunningMean, adam, order, pass};

/// Keys of the random streams that order the examples.
const JOINT_KEY: u64 = 2;
const FLOW_KEY: u64 = 3;
/// Rows that pass the encoder at a time where nothing is learnt.
const CHUNK: usize = 1024;

/// What is being trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Predictor and flow together.
    Joint,
    /// The flow alone.
    Flow,
}

impl std::fmt::Display for Phase {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Joint => "training",
            Self::Flow => "fitting the flow",
        })
    }
}

/// One pass over the data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// What was trained.
    pub phase: Phase,
    /// From 1 in each phase.
    pub epoch: usize,
    /// Mean of the loss over the steps: the method's loss, or the negative log density of the flow alone.
    pub training_loss: f64,
    /// By what the best weights are chosen: EMD2 summed over the parameters, or the negative log density.
    pub validation_error: f64,
    /// Whether no pass before was better.
    pub is_best: bool,
}

/// A finished training.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best weights.
    pub checkpoint: Checkpoint,
    /// Every pass, in order.
    pub curves: Vec<Epoch>,
    /// Validation EMD2 per parameter of the checkpoint.
    pub validation_emd2: [f64; Architecture::N_HEADS],
    /// Standard error of its sum: how much other drives of the kind would change it.
    pub validation_standard_error: f64,
    /// n / (n + n_prior) over the validation data; `None` without evidence.
    pub learned_weight: Option<Percentiles>,
    /// Whether it was broken off.
    pub end: TrainingEnd,
}

/// How a training ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainingEnd {
    /// By itself.
    Finished,
    /// At the caller's wish; the checkpoint is the best so far.
    Interrupted,
}

/// Trains on the calling thread alone, so that several trainings run side by side.
///
/// `revision` names the program in the checkpoint. `progress` hears of every pass and may break off: the best weights
/// so far are returned then.
///
/// # Errors
/// Settings out of range, data that is empty or not finite, a parameter that was never measured, training data with one
/// class per parameter, validation data of another vehicle, layout or
/// prior, a loss that is not finite.
pub fn train(
    training: &Dataset,
    validation: &Dataset,
    settings: &Settings,
    revision: &str,
    progress: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
) -> Result<Outcome, TrainError> {
    settings.validate()?;
    check(training, validation)?;
    let mut run = Run::new(training, validation, settings)?;
    run.fit(progress)?;
    run.calibrate()?;
    let checkpoint = run.checkpoint(&training.origin, revision)?;
    run.outcome(checkpoint)
}

fn check(training: &Dataset, validation: &Dataset) -> Result<(), TrainError> {
    for (which, dataset) in [("training", training), ("validation", validation)] {
        let refused = |problem| TrainError::Data { which, problem };
        dataset.validate().map_err(refused)?;
        if let Some(parameter) = dataset.n_measured().iter().position(|&n| n == 0) {
            return Err(refused(DatasetError::NothingMeasured { parameter: PARAMETER_NAMES[parameter] }));
        }
    }
    if !teaches(training) {
        return Err(TrainError::OneClass { n: training.examples.len() });
    }
    let (expected, found) = (&training.origin, &validation.origin);
    let mismatch = |what, expected: String, found: String| {
        if expected == found { Ok(()) } else { Err(TrainError::Mismatch { what, expected, found }) }
    };
    mismatch("vehicle", expected.vehicle.clone(), found.vehicle.clone())?;
    mismatch("layout", format!("{:?}", expected.layout), format!("{:?}", found.layout))?;
    mismatch("prior", format!("{:?}", expected.prior), format!("{:?}", found.prior))
}

/// Whether any parameter was measured in more than one bin. All need not be: on even ground every pitch is small.
fn teaches(dataset: &Dataset) -> bool {
    PARAMETER_BINS.iter().enumerate().any(|(parameter, bins)| {
        let mut seen = dataset.examples.iter().filter_map(|example| bins.bin_of(example.measured[parameter]));
        let first = seen.next();
        seen.any(|bin| Some(bin) != first)
    })
}

/// A training under way.
struct Run<'a> {
    settings: &'a Settings,
    standardisation: Standardisation,
    training: Samples,
    validation: Samples,
    network: Network,
    terms: LossTerms,
    curves: Vec<Epoch>,
    end: TrainingEnd,
}

type Progress<'a> = &'a mut dyn FnMut(&Epoch) -> ControlFlow<()>;

/// Whether a phase goes on after a pass.
enum Next {
    Continue,
    Stop,
}

impl<'a> Run<'a> {
    fn new(training: &Dataset, validation: &Dataset, settings: &'a Settings) -> Result<Self, TrainError> {
        let standardisation = Standardisation::of(training);
        let architecture = settings.architecture(training.origin.layout.n_features());
        let method = settings.method;
        let terms = LossTerms {
            prior: method.prior(),
            prior_evidence: training.origin.prior.evidence,
            log_budget: architecture.log_budget(),
            physics_weight: if method.has_physics_loss() { settings.physics_weight } else { 0.0 },
            entropy_weight: if method.is_evidential() { settings.entropy_weight } else { 0.0 },
        };
        Ok(Self {
            settings,
            training: Samples::with_mirrored(training, &standardisation),
            validation: Samples::new(validation, &standardisation),
            standardisation,
            network: Network::new(&architecture, settings.seed)?,
            terms,
            curves: Vec::new(),
            end: TrainingEnd::Finished,
        })
    }

    /// Both phases, the second only if nobody broke off the first.
    fn fit(&mut self, progress: Progress<'_>) -> Result<(), TrainError> {
        self.fit_jointly(progress)?;
        if self.settings.method.is_evidential() && self.end == TrainingEnd::Finished {
            self.fit_flow(progress)?;
        }
        Ok(())
    }

    /// Sets the certainty budget by the validation data, see [`DensityRange::log_budget`].
    fn calibrate(&mut self) -> Result<(), TrainError> {
        let Some(mut densities) = self.densities(&self.validation)? else { return Ok(()) };
        densities.sort_by(f32::total_cmp);
        let edge = (DensityRange::EDGE_SHARE * densities.len() as f64) as usize;
        self.terms.log_budget = self.terms.prior_evidence.ln() - f64::from(densities[edge]);
        Ok(())
    }

    /// The networks as they are, with what they mean.
    fn checkpoint(&self, origin: &DatasetOrigin, revision: &str) -> Result<Checkpoint, TrainError> {
        let sidecar = Sidecar {
            format: Sidecar::FORMAT,
            method: self.settings.method,
            vehicle: origin.vehicle.clone(),
            architecture: self.settings.architecture(origin.layout.n_features()),
            layout: origin.layout,
            standardisation: self.standardisation.clone(),
            traction_bins: PARAMETER_BINS[0].values().to_vec(),
            attitude_bins_rad: PARAMETER_BINS[2].values().to_vec(),
            prior: origin.prior,
            density: self.density_range()?,
            training: serde_json::json!(self.settings),
            git_revision: revision.to_owned(),
            weights_sha256: String::new(),
        };
        Ok(Checkpoint::new(sidecar, self.network.tensors()?)?)
    }

    fn outcome(self, checkpoint: Checkpoint) -> Result<Outcome, TrainError> {
        let evaluation = Evaluation::new(&self.network, &self.validation, &self.terms)?;
        let learned_weight =
            (!evaluation.learned_weights.is_empty()).then(|| Percentiles::of(evaluation.learned_weights));
        Ok(Outcome {
            checkpoint,
            curves: self.curves,
            validation_emd2: evaluation.emd2,
            validation_standard_error: evaluation.standard_error,
            learned_weight,
            end: self.end,
        })
    }

    /// Trains everything on the method's loss and leaves the best running mean of the weights in the network.
    fn fit_jointly(&mut self, progress: Progress<'_>) -> Result<(), TrainError> {
        let variables = self.network.variables();
        let mut optimiser = adam(variables.clone(), self.settings.learning_rate)?;
        let mut mean = RunningMean::new(variables.clone())?;
        let mut best = Best::new(variables);
        for epoch in 1..=self.settings.epochs_max {
            let place = Place { phase: Phase::Joint, epoch };
            let (network, training, terms) = (&self.network, &self.training, self.terms);
            let order = order(self.settings.seed, JOINT_KEY, epoch, training.n);
            let training_loss = pass(&order, self.settings.batch, place, &mut optimiser, |indices| {
                let (inputs, targets) = training.batch(indices)?;
                network.outputs(&inputs)?.apply_op2(&targets, BatchLoss::new(terms))
            })?;
            mean.take_in(epoch)?;
            mean.exchange()?;
            let error = Evaluation::new(&self.network, &self.validation, &self.terms)?.total();
            if let Next::Stop = self.conclude(place, training_loss, error, &mut best, progress)? {
                break;
            }
            mean.exchange()?;
        }
        Ok(best.restore()?)
    }

    /// Fits the flow alone to the latents of the training data and leaves the likeliest in the network.
    fn fit_flow(&mut self, progress: Progress<'_>) -> Result<(), TrainError> {
        let [training, validation] = [self.latents(&self.training)?, self.latents(&self.validation)?];
        let variables = self.network.flow_variables();
        let mut optimiser = adam(variables.clone(), self.settings.flow_learning_rate)?;
        let shape = (self.validation.n, self.settings.n_latent);
        let validation = Tensor::from_vec(validation, shape, &Device::Cpu)?;
        let mut best = Best::new(variables);
        // The flow as the joint training left it may be the best.
        best.offer(0, scalar(&mean_surprise(&self.network, &validation)?)?)?;
        for epoch in 1..=self.settings.flow_epochs_max {
            let place = Place { phase: Phase::Flow, epoch };
            let (network, n) = (&self.network, self.training.n);
            let order = order(self.settings.seed, FLOW_KEY, epoch, n);
            let training_loss = pass(&order, self.settings.batch, place, &mut optimiser, |indices| {
                mean_surprise(network, &gather(&training, n, indices)?)
            })?;
            let error = scalar(&mean_surprise(&self.network, &validation)?)?;
            if let Next::Stop = self.conclude(place, training_loss, error, &mut best, progress)? {
                break;
            }
        }
        Ok(best.restore()?)
    }

    /// Keeps the weights if they are the best, reports, and says whether to go on.
    fn conclude(
        &mut self,
        place: Place,
        training_loss: f64,
        validation_error: f64,
        best: &mut Best,
        progress: Progress<'_>,
    ) -> Result<Next, TrainError> {
        let Place { phase, epoch } = place;
        if !validation_error.is_finite() {
            let step = self.training.n.div_ceil(self.settings.batch);
            return Err(TrainError::NonFiniteLoss { phase, epoch, step, found: validation_error });
        }
        let is_best = best.offer(epoch, validation_error)?;
        self.curves.push(Epoch { phase, epoch, training_loss, validation_error, is_best });
        if progress(&self.curves[self.curves.len() - 1]).is_break() {
            self.end = TrainingEnd::Interrupted;
            return Ok(Next::Stop);
        }
        Ok(if epoch - best.epoch >= self.settings.patience { Next::Stop } else { Next::Continue })
    }

    /// Latents of all samples, row-major.
    fn latents(&self, samples: &Samples) -> Result<Vec<f32>, TrainError> {
        let mut latents = Vec::with_capacity(samples.n * self.settings.n_latent);
        for start in (0..samples.n).step_by(CHUNK) {
            let (inputs, _) = samples.chunk(start, CHUNK)?;
            latents.extend(self.network.latents(&inputs)?.flatten_all()?.to_vec1::<f32>()?);
        }
        Ok(latents)
    }

    /// Log densities of the training data; `None` without a flow.
    fn density_range(&self) -> Result<Option<DensityRange>, TrainError> {
        let Some(densities) = self.densities(&self.training)? else { return Ok(None) };
        let min = densities.iter().copied().fold(f32::INFINITY, f32::min);
        let max = densities.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let log_budget = self.terms.log_budget;
        Ok(Some(DensityRange { min: f64::from(min), max: f64::from(max), log_budget }))
    }

    /// Log densities of all samples; `None` without a flow.
    fn densities(&self, samples: &Samples) -> Result<Option<Vec<f32>>, TrainError> {
        let shape = (samples.n, self.settings.n_latent);
        let latents = Tensor::from_vec(self.latents(samples)?, shape, &Device::Cpu)?;
        let densities = self.network.log_densities(&latents)?;
        Ok(densities.map(|densities| densities.to_vec1::<f32>()).transpose()?)
    }
}

fn scalar(tensor: &Tensor) -> candle_core::Result<f64> {
    Ok(f64::from(tensor.to_scalar::<f32>()?))
}

/// Mean negative log density of latents.
fn mean_surprise(network: &Network, latents: &Tensor) -> candle_core::Result<Tensor> {
    match network.log_densities(latents)? {
        Some(densities) => densities.mean_all()?.neg(),
        None => candle_core::bail!("expected networks with a flow"),
    }
}

#[cfg(test)]
pub(crate) mod tests;
