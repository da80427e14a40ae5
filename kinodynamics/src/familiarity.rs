//! How much a moment is like what a model was trained on: the density of a flow over few numbers.
//!
//! They are the desired speed and curvature and, for a model that senses, how much each of the six components shook in the
//! last half second. The density is that of the crate `evidential` for the ground; where it falls below what nineteen of
//! twenty training examples had, trust begins to fade, and it is gone where one in a thousand lay.

use evidential::{FlowScratch, RadialFlow};
use serde::{Deserialize, Serialize};

use crate::architecture::{AXES, WINDOW};

/// Layers of the flow.
pub(crate) const LAYERS: usize = 8;
/// Shaking below this counts as none, in training deviations.
const SHAKE_MIN: f32 = 1e-3;

/// Where trust fades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fade {
    /// Log density at which nothing is left of it: that of the one in a thousand training examples that are least alike.
    pub none: f64,
    /// Log density from which on it is whole: that of the one in twenty.
    pub whole: f64,
}

/// The density and where trust in a model fades.
#[derive(Clone, Debug)]
pub(crate) struct Familiarity {
    means: Vec<f32>,
    deviations: Vec<f32>,
    flow: RadialFlow,
    fade: Fade,
    scratch: FlowScratch,
    features: Vec<f32>,
}

/// Numbers that tell how alike a moment is.
pub(crate) fn n_features(senses: bool) -> usize {
    if senses { 2 + AXES } else { 2 }
}

/// The numbers of a moment: the standardised window and the inputs of the command network.
pub(crate) fn features(window: &[f32], inputs: [f32; 2], features: &mut [f32]) {
    features[..2].copy_from_slice(&inputs);
    for (column, feature) in window.chunks_exact(WINDOW).zip(&mut features[2..]) {
        let mean = column.iter().sum::<f32>() / WINDOW as f32;
        let square = column.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / WINDOW as f32;
        *feature = libm::logf(square.sqrt().max(SHAKE_MIN));
    }
}

impl Familiarity {
    pub(crate) fn new(means: Vec<f32>, deviations: Vec<f32>, flow: RadialFlow, fade: Fade) -> Self {
        let features = vec![0.0; means.len()];
        Self { means, deviations, scratch: flow.scratch(), flow, fade, features }
    }

    /// Share of trust, 0 to 1.
    pub(crate) fn share(&mut self, window: &[f32], inputs: [f32; 2]) -> f32 {
        let density = self.log_density(window, inputs);
        let Fade { none, whole } = self.fade;
        let share = ((density - none) / (whole - none)).clamp(0.0, 1.0);
        if share.is_nan() { 0.0 } else { share as f32 }
    }

    fn log_density(&mut self, window: &[f32], inputs: [f32; 2]) -> f64 {
        features(window, inputs, &mut self.features);
        for ((feature, mean), deviation) in self.features.iter_mut().zip(&self.means).zip(&self.deviations) {
            *feature = (*feature - mean) / deviation;
        }
        self.flow.log_density(&self.features, &mut self.scratch)
    }
}
