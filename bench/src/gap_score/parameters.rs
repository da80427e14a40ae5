//! How far estimated parameters are off.

use std::collections::BTreeMap;

use formats::GapLabel;
use serde::Serialize;
use serde_json::Value;
use sim_to_real::{Answer, Estimate, NamedEffect};

use super::truth::{COMPARABLE, Comparable};
use super::{Hit, Quantiles};

/// The parameters of one announced effect, held against the label's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterError {
    /// Effect.
    pub effect: String,
    /// Distance of the estimate from the truth over the distance of the truth from doing nothing; of several
    /// parameters as of one vector.
    pub relative: f64,
    /// Whether every parameter's interval holds the truth.
    pub is_covered: bool,
}

/// One for each effect that had been added, was announced, and has parameters in the label.
pub(super) fn errors(label: &GapLabel, answer: &Answer) -> Vec<ParameterError> {
    answer
        .effects
        .iter()
        .filter(|named| label.effects.contains(&named.id))
        .filter_map(|named| error_of(named, label))
        .collect()
}

fn error_of(named: &NamedEffect, label: &GapLabel) -> Option<ParameterError> {
    let compared: Vec<(f64, f64, Estimate)> = COMPARABLE
        .iter()
        .filter(|comparable| comparable.effect == named.id)
        .filter_map(|comparable| {
            let truth = number(label.injection.get(comparable.key)?, comparable)?;
            Some((truth, comparable.neutral, *named.parameters.get(comparable.parameter)?))
        })
        .collect();
    let norm = |squares: &mut dyn Iterator<Item = f64>| squares.sum::<f64>().sqrt();
    let off = norm(&mut compared.iter().map(|(truth, _, found)| (found.value - truth).powi(2)));
    let size = norm(&mut compared.iter().map(|(truth, neutral, _)| (truth - neutral).powi(2)));
    (size > 0.0).then(|| ParameterError {
        effect: named.id.clone(),
        relative: off / size,
        is_covered: compared.iter().all(|(truth, _, found)| (found.low..=found.high).contains(truth)),
    })
}

fn number(value: &Value, comparable: &Comparable) -> Option<f64> {
    match value {
        Value::Array(values) => values.get(comparable.index)?.as_f64(),
        value => value.as_f64(),
    }
}

/// Relative errors by effect.
pub(super) fn by_effect(hits: &[Hit]) -> Vec<(String, Quantiles)> {
    let mut groups: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for error in hits.iter().flat_map(|hit| &hit.parameters) {
        groups.entry(&error.effect).or_default().push(error.relative);
    }
    groups.into_iter().map(|(effect, errors)| (effect.to_owned(), Quantiles::of(errors))).collect()
}
