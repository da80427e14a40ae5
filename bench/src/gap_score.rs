//! How good diagnoses are: answers held against the labels of what had been added, case by case and summed up.
//!
//! Pure: labels and answers go in, shares with their 95 % Wilson intervals, quantiles, a calibration curve and a
//! confusion matrix come out. Which answers count as right where several would be stands in [`truth`].

mod calibration;
mod confusion;
mod hit;
mod parameters;
mod quantiles;
mod share;
pub mod truth;

use formats::GapLabel;
use serde::Serialize;
use sim_to_real::Answer;

pub use calibration::{Calibration, ReliabilityBin};
pub use confusion::Confusion;
pub use hit::Hit;
pub use parameters::ParameterError;
pub use quantiles::Quantiles;
pub use share::Share;

/// A diagnosis and what it should have found.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnosedCase {
    /// Name.
    pub name: String,
    /// What had been added.
    pub label: GapLabel,
    /// What was answered.
    pub answer: Answer,
    /// Time that naming took once the vehicle's null was there [s].
    pub naming_s: Option<f64>,
}

/// All of a set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Number of cases.
    pub n_cases: usize,
    /// Shares of right answers.
    pub shares: Vec<Share>,
    /// First names of single effects by size, style, whether the gap is seen on held-out drives, plant and effect.
    pub first_names_by: Vec<Share>,
    /// Number of explanations in the credible set of single effects.
    pub credible_set_size: Quantiles,
    /// Closed fraction on held-out drives of single effects and pairs.
    pub closed: Quantiles,
    /// Distance of the predicted closed fraction from the achieved one.
    pub predicted_off: Quantiles,
    /// Relative errors of parameters that the label tells, of effects that were announced.
    pub parameter_error: Quantiles,
    /// The same by effect.
    pub parameter_error_by_effect: Vec<(String, Quantiles)>,
    /// Time that naming took [s].
    pub naming_s: Quantiles,
    /// Are the scores probabilities?
    pub calibration: Calibration,
    /// What was announced for what.
    pub confusion: Confusion,
    /// Every case.
    pub cases: Vec<Hit>,
}

/// Holds answers against labels. Errors: none; what a case has no bearing on is left out of its sum.
pub fn score(diagnosed: &[DiagnosedCase]) -> Score {
    let cases: Vec<Hit> = diagnosed.iter().map(Hit::of).collect();
    let named: Vec<&Hit> = cases.iter().filter(|hit| hit.has_names()).collect();
    let numbers =
        |of: fn(&Hit) -> Option<f64>, hits: &[&Hit]| Quantiles::of(hits.iter().filter_map(|hit| of(hit)));
    let singles: Vec<&Hit> = cases.iter().filter(|hit| hit.is_single()).collect();
    Score {
        n_cases: cases.len(),
        shares: share::overall(&cases),
        first_names_by: share::broken_down(&cases),
        credible_set_size: Quantiles::of(singles.iter().map(|hit| hit.credible_set.len() as f64)),
        closed: numbers(|hit| hit.closed, &named),
        predicted_off: numbers(Hit::predicted_off, &named),
        parameter_error: Quantiles::of(
            cases.iter().flat_map(|hit| hit.parameters.iter().map(|p| p.relative)),
        ),
        parameter_error_by_effect: parameters::by_effect(&cases),
        naming_s: Quantiles::of(diagnosed.iter().filter_map(|case| case.naming_s)),
        calibration: Calibration::of(diagnosed),
        confusion: Confusion::of_diagnosed(diagnosed),
        cases,
    }
}

#[cfg(test)]
mod tests;
