//! One case: what of its answer is right.

use formats::GapKind;
use serde::Serialize;
use sim_to_real::Verdict;

use super::parameters::{ParameterError, errors};
use super::{DiagnosedCase, truth};

/// What of an answer is right. `None` where the case has no bearing on it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hit {
    /// Name of the case.
    pub case: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the plant.
    pub plant: String,
    /// How much had been added.
    pub kind: GapKind,
    /// What had been added.
    pub truth: Vec<String>,
    /// Size: s, m, l or -.
    pub magnitude: String,
    /// Style of driving.
    pub style: String,
    /// Conclusion.
    pub verdict: Verdict,
    /// What was announced.
    pub announced: Vec<String>,
    /// First of the ranking and its score.
    pub first: Option<(String, f64)>,
    /// Explanations that the data cannot tell apart.
    pub credible_set: Vec<String>,
    /// Single: the first of the ranking is the effect.
    pub is_first_right: Option<bool>,
    /// Single: one of the first two is.
    pub is_in_first_two: Option<bool>,
    /// Single: the credible set holds the effect.
    pub is_credible: Option<bool>,
    /// Single and pair: exactly what had been added was announced, and nothing unknown.
    pub is_exact: Option<bool>,
    /// Pair: both were announced.
    pub are_both_named: Option<bool>,
    /// None: something was announced.
    pub is_false_alarm: Option<bool>,
    /// Unknown that no effect can stand for: flagged.
    pub is_flagged: Option<bool>,
    /// Unknown that an effect can stand for: flagged, or that effect announced.
    pub is_flagged_or_mimicked: Option<bool>,
    /// Single and pair: the first place is one where an effect shows.
    pub is_place_right: Option<bool>,
    /// Share of the gap that closed on held-out drives.
    pub closed: Option<f64>,
    /// The same as predicted.
    pub predicted_closed: Option<f64>,
    /// Parameters that the label tells.
    pub parameters: Vec<ParameterError>,
}

impl Hit {
    pub(super) fn of(case: &DiagnosedCase) -> Self {
        let DiagnosedCase { name, label, answer, .. } = case;
        let truth = &label.effects;
        let announced: Vec<String> = answer.effects.iter().map(|effect| effect.id.clone()).collect();
        let says_unknown = matches!(answer.verdict, Verdict::Unknown | Verdict::EffectsAndUnknown);
        let is_true = |id: &String| truth.contains(id);
        let n_true_announced = announced.iter().filter(|id| is_true(id)).count();
        let single = |right: bool| (label.kind == GapKind::Single).then_some(right);
        let has_names = matches!(label.kind, GapKind::Single | GapKind::Pair);
        let first_true = |n: usize| answer.ranking.iter().take(n).any(|ranked| is_true(&ranked.id));
        let mimics = truth.first().and_then(|id| truth::mimics(id));
        let unknown = |right: bool, can_be_mimicked: bool| {
            (label.kind == GapKind::Unknown && mimics.is_some() == can_be_mimicked).then_some(right)
        };
        let is_mimicked = announced.iter().any(|id| mimics.is_some_and(|names| names.contains(&id.as_str())));
        let first_place = answer.places.first().map(|place| place.condition);
        let shows = |id: &String| first_place.is_some_and(|place| truth::places(id).contains(&place));
        Self {
            case: name.clone(),
            vehicle: label.vehicle.clone(),
            plant: label.plant.clone(),
            kind: label.kind,
            truth: truth.clone(),
            magnitude: label.magnitude.clone(),
            style: label.style.clone(),
            verdict: answer.verdict,
            first: answer.ranking.first().map(|ranked| (ranked.id.clone(), ranked.score)),
            credible_set: answer.credible_set.clone(),
            is_first_right: single(first_true(1)),
            is_in_first_two: single(first_true(2)),
            is_credible: single(answer.credible_set.iter().any(is_true)),
            is_exact: has_names.then_some(
                !says_unknown && n_true_announced == truth.len() && announced.len() == truth.len(),
            ),
            are_both_named: (label.kind == GapKind::Pair).then_some(n_true_announced == truth.len()),
            is_false_alarm: (label.kind == GapKind::None).then_some(!announced.is_empty()),
            is_flagged: unknown(says_unknown, false),
            is_flagged_or_mimicked: unknown(says_unknown || is_mimicked, true),
            is_place_right: has_names.then(|| truth.iter().any(shows)),
            closed: answer.shrink.closed,
            predicted_closed: answer.shrink.predicted_closed,
            parameters: errors(label, answer),
            announced,
        }
    }

    /// Whether effects of the catalogue had been added.
    pub(super) fn has_names(&self) -> bool {
        matches!(self.kind, GapKind::Single | GapKind::Pair)
    }

    pub(super) fn is_single(&self) -> bool {
        self.kind == GapKind::Single
    }

    /// Distance of the predicted closed fraction from the achieved one.
    pub(super) fn predicted_off(&self) -> Option<f64> {
        Some((self.predicted_closed? - self.closed?).abs())
    }

    /// Whether a person who reads the answer is led right.
    pub fn is_right(&self) -> bool {
        match self.kind {
            GapKind::None => self.is_false_alarm == Some(false) && self.verdict == Verdict::None,
            GapKind::Single | GapKind::Pair => self.is_exact == Some(true),
            GapKind::Unknown => self.is_flagged.or(self.is_flagged_or_mimicked) == Some(true),
        }
    }
}
