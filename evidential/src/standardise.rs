//! Features to inputs of the networks.

use crate::{Dataset, Standardisation};

impl Standardisation {
    /// Least deviation that divides a feature, in units of the feature: heights over the layout's scale, shares from
    /// 0 to 1. Whatever never varied in training (plants on a course without any) becomes a loud input when it shows
    /// up, but not so loud that rounding noise does.
    pub const DEVIATION_MIN: f32 = 0.05;

    /// Mean and deviation of every feature over a dataset, which must not be empty.
    pub fn of(dataset: &Dataset) -> Self {
        let n = dataset.examples.len() as f64;
        let n_features = dataset.origin.layout.n_features();
        let mut mean = vec![0.0; n_features];
        for example in &dataset.examples {
            for (sum, &value) in mean.iter_mut().zip(&example.features) {
                *sum += f64::from(value) / n;
            }
        }
        let mut variance = vec![0.0; n_features];
        for example in &dataset.examples {
            for ((sum, &value), mean) in variance.iter_mut().zip(&example.features).zip(&mean) {
                *sum += (f64::from(value) - mean).powi(2) / n;
            }
        }
        Self {
            mean: mean.iter().map(|&mean| mean as f32).collect(),
            deviation: variance.iter().map(|sum| (sum.sqrt() as f32).max(Self::DEVIATION_MIN)).collect(),
        }
    }

    /// Appends the inputs that belong to the features of one footprint.
    pub fn apply(&self, features: &[f32], inputs: &mut Vec<f32>) {
        let moments = self.mean.iter().zip(&self.deviation);
        inputs.extend(
            features.iter().zip(moments).map(|(value, (mean, deviation))| (value - mean) / deviation),
        );
    }
}
