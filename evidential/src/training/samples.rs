//! A dataset as the arrays that training feeds to the networks.

use candle_core::{Device, Result, Tensor};

use crate::loss::N_TARGETS;
use crate::{Dataset, PARAMETER_BINS, Standardisation};

/// Stands for a measurement that means nothing.
const UNMEASURED: f32 = -1.0;

/// Inputs and targets of all examples, row-major.
pub(super) struct Samples {
    pub n: usize,
    inputs: Vec<f32>,
    targets: Vec<f32>,
    /// Which drive each example belongs to.
    drives: Vec<u32>,
}

impl Samples {
    pub(super) fn new(dataset: &Dataset, standardisation: &Standardisation) -> Self {
        let n = dataset.examples.len();
        let mut inputs = Vec::with_capacity(n * standardisation.mean.len());
        let mut targets = Vec::with_capacity(n * N_TARGETS);
        for example in &dataset.examples {
            standardisation.apply(&example.features, &mut inputs);
            targets.extend(example.prior.iter().flatten());
            let measured = example.measured.iter().zip(&PARAMETER_BINS);
            targets
                .extend(measured.map(|(&value, bins)| bins.bin_of(value).map_or(UNMEASURED, |b| b as f32)));
        }
        let drives = dataset.examples.iter().map(|example| example.drive).collect();
        Self { n, inputs, targets, drives }
    }

    /// Every example twice, as it is and seen in a mirror: what lies left and what lies right teach alike.
    pub(super) fn with_mirrored(dataset: &Dataset, standardisation: &Standardisation) -> Self {
        let mut samples = Self::new(dataset, standardisation);
        for example in &dataset.examples {
            let mirrored = dataset.origin.layout.mirrored(&example.features);
            standardisation.apply(&mirrored, &mut samples.inputs);
        }
        samples.targets.extend_from_within(..);
        samples.drives.extend_from_within(..);
        samples.n *= 2;
        samples
    }

    /// Takes in the samples of another dataset, behind its own.
    pub(super) fn append(&mut self, other: Self) {
        self.n += other.n;
        self.inputs.extend(other.inputs);
        self.targets.extend(other.targets);
        self.drives.extend(other.drives);
    }

    /// Targets of the examples named.
    pub(super) fn targets(&self, indices: &[u32]) -> Result<Tensor> {
        gather(&self.targets, self.n, indices)
    }

    /// Inputs and targets of the examples named.
    pub(super) fn batch(&self, indices: &[u32]) -> Result<(Tensor, Tensor)> {
        Ok((gather(&self.inputs, self.n, indices)?, self.targets(indices)?))
    }

    /// Drive of every example.
    pub(super) fn drives(&self) -> &[u32] {
        &self.drives
    }

    /// Inputs and the rows of targets of the examples from `start` on, at most so many.
    pub(super) fn chunk(&self, start: usize, n_max: usize) -> Result<(Tensor, &[f32])> {
        let end = (start + n_max).min(self.n);
        let width = self.inputs.len() / self.n;
        let inputs = &self.inputs[start * width..end * width];
        let inputs = Tensor::from_slice(inputs, (end - start, width), &Device::Cpu)?;
        Ok((inputs, &self.targets[start * N_TARGETS..end * N_TARGETS]))
    }
}

/// Rows of a row-major array of `n_rows`.
pub(super) fn gather(values: &[f32], n_rows: usize, indices: &[u32]) -> Result<Tensor> {
    let width = values.len() / n_rows;
    let mut rows = Vec::with_capacity(indices.len() * width);
    for &index in indices {
        let start = index as usize * width;
        rows.extend_from_slice(&values[start..start + width]);
    }
    Tensor::from_vec(rows, (indices.len(), width), &Device::Cpu)
}
