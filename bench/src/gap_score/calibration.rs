//! Whether scores are probabilities.
//!
//! Cases with something that has no name are left out: there no name is plainly right or wrong.

use formats::GapKind;
use serde::Serialize;

use super::DiagnosedCase;

/// Bins of the score.
const N_BINS: usize = 10;

/// Scores held against how often they were right.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Every effect of every ranking by its score; empty bins are left out.
    pub bins: Vec<ReliabilityBin>,
    /// Mean squared distance of the scores from 0 and 1, over all effects of all rankings (Brier 1950).
    pub brier: Option<f64>,
    /// The same over the first names alone.
    pub brier_first: Option<f64>,
    /// Mean distance of score and share over the bins, weighted by their numbers.
    pub expected_error: Option<f64>,
}

/// Scores of one size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ReliabilityBin {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How many scores.
    pub n: usize,
    /// Their mean.
    pub mean_score: f64,
    /// Share of them whose effect had been added.
    pub share: f64,
}

impl Calibration {
    pub(super) fn of(diagnosed: &[DiagnosedCase]) -> Self {
        let judged = || diagnosed.iter().filter(|case| case.label.kind != GapKind::Unknown);
        let scores = |case: &DiagnosedCase, n: usize| -> Vec<(f64, bool)> {
            let ranking = case.answer.ranking.iter().take(n);
            ranking.map(|ranked| (ranked.score, case.label.effects.contains(&ranked.id))).collect()
        };
        let all: Vec<(f64, bool)> = judged().flat_map(|case| scores(case, usize::MAX)).collect();
        let first: Vec<(f64, bool)> = judged().flat_map(|case| scores(case, 1)).collect();
        let bins: Vec<ReliabilityBin> =
            (0..N_BINS).filter_map(|index| ReliabilityBin::of(index, &all)).collect();
        let off = |bin: &ReliabilityBin| bin.n as f64 * (bin.mean_score - bin.share).abs();
        let expected_error = mean(bins.iter().map(off)).map(|sum| sum * bins.len() as f64 / all.len() as f64);
        Self { expected_error, bins, brier: brier(&all), brier_first: brier(&first) }
    }
}

impl ReliabilityBin {
    fn of(index: usize, scores: &[(f64, bool)]) -> Option<Self> {
        let [low, high] = [index, index + 1].map(|end| end as f64 / N_BINS as f64);
        let place = |score: f64| ((score * N_BINS as f64) as usize).min(N_BINS - 1);
        let inside: Vec<_> = scores.iter().filter(|(score, _)| place(*score) == index).collect();
        let mean_score = mean(inside.iter().map(|(score, _)| *score))?;
        let share = mean(inside.iter().map(|(_, is_true)| f64::from(u8::from(*is_true))))?;
        Some(Self { low, high, n: inside.len(), mean_score, share })
    }
}

fn brier(scores: &[(f64, bool)]) -> Option<f64> {
    mean(scores.iter().map(|(score, is_true)| (score - f64::from(u8::from(*is_true))).powi(2)))
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let n = values.len();
    (n > 0).then(|| values.sum::<f64>() / n as f64)
}
