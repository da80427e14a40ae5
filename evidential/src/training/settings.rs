//! What a training run may choose.

use serde::{Deserialize, Serialize};
use terrain::SettingError;

use crate::{Architecture, Method};

/// Everything that a training run depends on beside its data. The same settings and data give the same weights, bit
/// for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// What is trained.
    pub method: Method,
    /// Of initial weights and of the order of examples.
    pub seed: u64,
    /// Of Adam.
    pub learning_rate: f64,
    /// kappa of equation 14; only methods with a physics loss look at it.
    pub physics_weight: f64,
    /// Weight of the entropy bonus; only methods with evidence look at it.
    pub entropy_weight: f64,
    /// Examples per step.
    pub batch: usize,
    /// Passes over the training data at most.
    pub epochs_max: usize,
    /// Passes without a better validation error after which training ends.
    pub patience: usize,
    /// Of Adam while the flow alone is fitted.
    pub flow_learning_rate: f64,
    /// Passes of the flow's own fit at most, with the same patience; 0 leaves the flow as the joint training made it.
    pub flow_epochs_max: usize,
    /// Widths of the encoder's hidden layers.
    pub encoder_hidden: Vec<usize>,
    /// Width of the latent.
    pub n_latent: usize,
    /// Width of every head's hidden layer.
    pub head_hidden: usize,
    /// Width of the evidence head's hidden layer.
    pub evidence_hidden: usize,
    /// Layers of the radial flow.
    pub n_flow_layers: usize,
}

/// Widest layer, most layers, largest batch: beyond, a slip of the keyboard is likelier than a wish.
const COUNT_MAX: usize = 1 << 16;

impl Settings {
    /// Settings of a method that learn well on a few ten thousand examples.
    pub fn new(method: Method, seed: u64) -> Self {
        Self {
            method,
            seed,
            learning_rate: 1e-3,
            physics_weight: 0.1,
            entropy_weight: 1e-4,
            batch: 128,
            epochs_max: 100,
            patience: 15,
            flow_learning_rate: 1e-4,
            flow_epochs_max: 2,
            encoder_hidden: vec![32, 32],
            n_latent: 16,
            head_hidden: 32,
            evidence_hidden: 16,
            n_flow_layers: 8,
        }
    }

    /// Refuses values outside their ranges.
    pub fn validate(&self) -> Result<(), SettingError> {
        let rates = [("learning_rate", self.learning_rate), ("flow_learning_rate", self.flow_learning_rate)];
        SettingError::check_finite(&rates, "a number above 0, at most 1", |v| v > 0.0 && v <= 1.0)?;
        let weights = [("physics_weight", self.physics_weight), ("entropy_weight", self.entropy_weight)];
        SettingError::check_finite(&weights, "a finite number >= 0", |v| v >= 0.0)?;
        let mut counts = vec![
            ("batch", self.batch),
            ("epochs_max", self.epochs_max),
            ("patience", self.patience),
            ("n_latent", self.n_latent),
            ("head_hidden", self.head_hidden),
            ("evidence_hidden", self.evidence_hidden),
            ("n_flow_layers", self.n_flow_layers),
        ];
        counts.extend(self.encoder_hidden.iter().map(|&width| ("encoder_hidden", width)));
        let counts: Vec<_> = counts.into_iter().map(|(field, count)| (field, count as f64)).collect();
        SettingError::check_finite(&counts, "a count from 1 to 65536", |v| {
            (1.0..=COUNT_MAX as f64).contains(&v)
        })?;
        let may_be_zero = [("flow_epochs_max", self.flow_epochs_max as f64)];
        SettingError::check_finite(&may_be_zero, "a count from 0 to 65536", |v| v <= COUNT_MAX as f64)
    }

    /// Sizes of the networks for footprints of so many features; a method without evidence has none of its parts.
    pub fn architecture(&self, n_inputs: usize) -> Architecture {
        let if_evidential = |count: usize| if self.method.is_evidential() { count } else { 0 };
        Architecture {
            n_inputs,
            encoder_hidden: self.encoder_hidden.clone(),
            n_latent: self.n_latent,
            head_hidden: self.head_hidden,
            evidence_hidden: if_evidential(self.evidence_hidden),
            n_flow_layers: if_evidential(self.n_flow_layers),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_for_every_method() {
        for method in Method::ALL {
            assert_eq!(Settings::new(method, 1).validate(), Ok(()));
        }
    }

    #[test]
    fn wrong_values_are_refused_with_field_and_number() {
        let default = || Settings::new(Method::Pietra, 1);
        let wrong = [
            (Settings { learning_rate: 0.0, ..default() }, "learning_rate"),
            (Settings { flow_learning_rate: f64::NAN, ..default() }, "flow_learning_rate"),
            (Settings { physics_weight: -0.1, ..default() }, "physics_weight"),
            (Settings { entropy_weight: f64::INFINITY, ..default() }, "entropy_weight"),
            (Settings { batch: 0, ..default() }, "batch"),
            (Settings { epochs_max: 0, ..default() }, "epochs_max"),
            (Settings { patience: 0, ..default() }, "patience"),
            (Settings { n_latent: 0, ..default() }, "n_latent"),
            (Settings { encoder_hidden: vec![64, 0], ..default() }, "encoder_hidden"),
            (Settings { head_hidden: 70_000, ..default() }, "head_hidden"),
            (Settings { flow_epochs_max: 70_000, ..default() }, "flow_epochs_max"),
        ];
        for (settings, field) in wrong {
            assert_eq!(settings.validate().unwrap_err().field, field);
        }
        let told = Settings { learning_rate: 0.0, ..default() }.validate().unwrap_err().to_string();
        assert_eq!(told, "learning_rate: expected a number above 0, at most 1, found 0");
    }

    #[test]
    fn methods_without_evidence_have_no_flow() {
        assert_eq!(Settings::new(Method::Vanilla, 1).architecture(30).n_flow_layers, 0);
        assert_eq!(Settings::new(Method::Evora, 1).architecture(30).n_flow_layers, 8);
    }
}
