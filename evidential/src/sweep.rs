//! The search for the parameters of a method on validation data alone, and what it found.

use data_encoding::HEXLOWER;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::{Architecture, Dataset, DatasetFileError, Method, Settings};

/// Values that are tried in every combination.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Learning rates of Adam.
    pub learning_rates: Vec<f64>,
    /// kappa of equation 14, for methods with a physics loss.
    pub physics_weights: Vec<f64>,
    /// Weights of the entropy bonus, for methods with evidence.
    pub entropy_weights: Vec<f64>,
}

/// One training of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// What was trained, with its seed.
    pub settings: Settings,
    /// [`fingerprint`] of the data.
    pub data: String,
    /// Validation EMD2 per parameter; `None` if the loss did not stay finite.
    pub validation_emd2: Option<[f64; Architecture::N_HEADS]>,
    /// Standard error of its sum over the validation drives; 0 if there is none.
    pub validation_standard_error: f64,
    /// Passes of the joint training.
    pub n_epochs: usize,
}

/// The best parameters of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// The parameters; the seed is that of the first trial.
    pub settings: Settings,
    /// Mean validation EMD2 over the seeds, per parameter.
    pub validation_emd2: [f64; Architecture::N_HEADS],
    /// Mean over the seeds of the sum over the parameters.
    pub validation_total: f64,
    /// Standard deviation of that sum over the seeds.
    pub validation_deviation: f64,
    /// Standard error of that sum over the validation drives, mean over the seeds.
    pub validation_standard_error: f64,
    /// Trainings that the mean is taken over.
    pub n_seeds: usize,
}

/// The best parameters of every method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selections {
    /// [`fingerprint`] of the data they were chosen on.
    pub data: String,
    /// How the data came to be, for people.
    pub provenance: String,
    /// One per method that was searched.
    pub selections: Vec<Selection>,
}

/// Why nothing can be selected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{method}: expected parameters with a finite loss for all of {n_seeds} seeds, found none")]
pub struct SelectionError {
    /// Name of the method.
    pub method: &'static str,
    /// Seeds that were asked for.
    pub n_seeds: usize,
}

impl Grid {
    /// The grid of PIETRA, section V-B.
    pub fn paper() -> Self {
        Self {
            learning_rates: vec![1e-3, 1e-4, 1e-5],
            physics_weights: vec![0.1, 0.5, 1.0],
            entropy_weights: vec![1e-3, 1e-4, 1e-5],
        }
    }

    /// Every combination of the values that the method of `base` looks at.
    pub fn candidates(&self, base: &Settings) -> Vec<Settings> {
        let axis = |is_used: bool, values: &[f64], usual: f64| {
            if is_used { values.to_vec() } else { vec![usual] }
        };
        let method = base.method;
        let physics = axis(method.has_physics_loss(), &self.physics_weights, base.physics_weight);
        let entropy = axis(method.is_evidential(), &self.entropy_weights, base.entropy_weight);
        let mut candidates = Vec::new();
        for &learning_rate in &self.learning_rates {
            for &physics_weight in &physics {
                for &entropy_weight in &entropy {
                    candidates.push(Settings {
                        learning_rate,
                        physics_weight,
                        entropy_weight,
                        ..base.clone()
                    });
                }
            }
        }
        candidates
    }
}

/// SHA-256 of training and validation data together, hexadecimal.
///
/// # Errors
/// Data that does not validate.
pub fn fingerprint(training: &Dataset, validation: &Dataset) -> Result<String, DatasetFileError> {
    let mut hash = Sha256::new();
    hash.update(training.to_bytes()?);
    hash.update(validation.to_bytes()?);
    Ok(HEXLOWER.encode(&hash.finalize()))
}

impl Selection {
    /// The candidate with the least mean validation EMD2 over the seeds 1 to `n_seeds`, by the rule of one standard
    /// error (Breiman and others, 1984): whatever lies within the least mean's standard error over the validation drives
    /// is as good, and of these the one that holds most to physics is taken, the largest kappa. Validation data are like the training data
    /// and do not ask for it; ground beyond them does. Of equal kappas the least mean counts, of equals the first.
    ///
    /// # Errors
    /// No candidate has a finite result for all seeds.
    pub fn of(
        method: Method,
        candidates: &[Settings],
        n_seeds: usize,
        trials: &[Trial],
    ) -> Result<Self, SelectionError> {
        let judged = candidates.iter().filter_map(|candidate| Self::judged(candidate, n_seeds, trials));
        let judged: Vec<Self> = judged.collect();
        let by_total = |left: &&Self, right: &&Self| left.validation_total.total_cmp(&right.validation_total);
        let best = judged.iter().min_by(by_total);
        let best = best.ok_or(SelectionError { method: method.name(), n_seeds })?;
        let limit = best.validation_total + best.validation_standard_error;
        let as_good = || judged.iter().filter(|selection| selection.validation_total <= limit);
        let kappa = as_good().map(|selection| selection.settings.physics_weight).fold(0.0, f64::max);
        let chosen =
            as_good().filter(|selection| selection.settings.physics_weight >= kappa).min_by(by_total);
        Ok(chosen.unwrap_or(best).clone())
    }

    /// Mean and deviation of a candidate; `None` unless all seeds ended well.
    fn judged(candidate: &Settings, n_seeds: usize, trials: &[Trial]) -> Option<Self> {
        let of_seed = |seed: u64| {
            let settings = Settings { seed, ..candidate.clone() };
            let trial = trials.iter().find(|trial| trial.settings == settings)?;
            Some((trial.validation_emd2?, trial.validation_standard_error))
        };
        let seeds: Vec<([f64; 4], f64)> = (1..=n_seeds as u64).map(of_seed).collect::<Option<_>>()?;
        let (errors, standard_errors): (Vec<[f64; 4]>, Vec<f64>) = seeds.into_iter().unzip();
        let n = errors.len() as f64;
        let totals = || errors.iter().map(|error| error.iter().sum::<f64>());
        let validation_total = totals().sum::<f64>() / n;
        let variance = totals().map(|total| (total - validation_total).powi(2)).sum::<f64>();
        Some(Self {
            settings: Settings { seed: 1, ..candidate.clone() },
            validation_emd2: std::array::from_fn(|head| {
                errors.iter().map(|error| error[head]).sum::<f64>() / n
            }),
            validation_total,
            // Of the seeds as a sample; one seed has none.
            validation_deviation: (variance / (n - 1.0).max(1.0)).sqrt(),
            validation_standard_error: standard_errors.iter().sum::<f64>() / n,
            n_seeds,
        })
    }
}

impl Selections {
    /// The selections that came with the program.
    ///
    /// # Errors
    /// They are no selections of this version.
    pub fn shipped() -> Result<Self, serde_json::Error> {
        serde_json::from_str(include_str!("../selections.json"))
    }

    /// The selected settings of a method with a seed; `None` if it was not searched.
    pub fn settings(&self, method: Method, seed: u64) -> Option<Settings> {
        let selection = self.selections.iter().find(|selection| selection.settings.method == method)?;
        Some(Settings { seed, ..selection.settings.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(learning_rate: f64, seed: u64, error: Option<f64>) -> Trial {
        let settings = Settings { learning_rate, ..Settings::new(Method::Vanilla, seed) };
        Trial {
            settings,
            data: String::new(),
            validation_emd2: error.map(|error| [error, 0.0, 1.0, 0.0]),
            validation_standard_error: 0.0,
            n_epochs: 1,
        }
    }

    #[test]
    fn grid_has_the_axes_that_a_method_looks_at() {
        let n = Method::ALL.map(|method| Grid::paper().candidates(&Settings::new(method, 1)).len());
        assert_eq!(n, [27, 9, 27, 9, 9, 3]);
        let candidates = Grid::paper().candidates(&Settings::new(Method::Pietra, 1));
        assert!(candidates.iter().all(|candidate| candidate.validate().is_ok()));
        let distinct = |k: usize| !candidates[..k].contains(&candidates[k]);
        assert!((0..candidates.len()).all(distinct));
    }

    #[test]
    fn least_mean_over_all_seeds_is_selected() {
        let candidates = [1e-3, 1e-4, 1e-5].map(|rate| trial(rate, 1, None).settings);
        let mut trials = vec![
            trial(1e-3, 1, Some(0.1)),
            trial(1e-3, 2, Some(0.9)),
            trial(1e-4, 1, Some(0.3)),
            trial(1e-4, 2, Some(0.5)),
            trial(1e-5, 1, Some(0.1)),
            trial(1e-5, 2, None),
        ];
        let found = Selection::of(Method::Vanilla, &candidates, 2, &trials).unwrap();
        assert_eq!(found.settings.learning_rate, 1e-4);
        assert!(
            (found.validation_total - 1.4).abs() < 1e-12 && (found.validation_emd2[0] - 0.4).abs() < 1e-12
        );
        // 0.3 and 0.5: sqrt(0.01 + 0.01).
        assert!((found.validation_deviation - 0.02f64.sqrt()).abs() < 1e-12);
        trials[5] = trial(1e-5, 2, Some(0.2));
        assert_eq!(
            Selection::of(Method::Vanilla, &candidates, 2, &trials).unwrap().settings.learning_rate,
            1e-5
        );
        let told = Selection::of(Method::Vanilla, &candidates, 3, &trials).unwrap_err().to_string();
        assert_eq!(told, "vanilla: expected parameters with a finite loss for all of 3 seeds, found none");
    }

    #[test]
    fn within_one_standard_error_the_largest_kappa_is_selected() {
        let trial = |physics_weight: f64, seed: u64, error: f64| Trial {
            settings: Settings { physics_weight, ..Settings::new(Method::Pietra, seed) },
            validation_standard_error: 0.1,
            ..trial(1e-3, seed, Some(error))
        };
        // Mean 0.5, standard error 0.1.
        let least = [trial(0.1, 1, 0.4), trial(0.1, 2, 0.6)];
        let selected = |errors: [f64; 2]| {
            let others = [0.5, 1.0].into_iter().zip(errors);
            let others = others.flat_map(|(kappa, error)| [trial(kappa, 1, error), trial(kappa, 2, error)]);
            let trials: Vec<Trial> = least.iter().cloned().chain(others).collect();
            let candidates: Vec<Settings> = trials.iter().step_by(2).map(|t| t.settings.clone()).collect();
            Selection::of(Method::Pietra, &candidates, 2, &trials).unwrap().settings.physics_weight
        };
        assert_eq!(selected([0.55, 0.61]), 0.5);
        assert_eq!(selected([0.55, 0.59]), 1.0);
        assert_eq!(selected([0.61, 0.59]), 1.0);
        assert_eq!(selected([0.61, 0.61]), 0.1);
    }

    #[test]
    fn shipped_selections_are_valid() {
        let shipped = Selections::shipped().unwrap();
        for selection in &shipped.selections {
            selection.settings.validate().unwrap();
            let settings = shipped.settings(selection.settings.method, 9).unwrap();
            assert_eq!(Settings { seed: selection.settings.seed, ..settings }, selection.settings);
        }
    }
}
