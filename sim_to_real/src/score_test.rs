//! Score tests: how strongly drives ask for an effect, in units of how much nominal drives ask for it by chance.
//!
//! An effect changes the residuals from r to r - d. Over a stretch of a drive, with the loss's weights w, the score of its
//! size is the sum of w d r and the information the sum of w d d; their ratio is the size that the stretch asks for, 1 at
//! a fit. Were residuals independent, the squared score would be as large as the information. They are not: what it is
//! larger by on nominal drives, in the direction of this very effect, is its dispersion (quasi-likelihood, McCullagh and
//! Nelder 1989, section 9.2).

use crate::answer::Support;
use crate::calibration::distance;
use crate::causes::{Explanation, Trial};
use crate::least_squares::weight;
use crate::rollout::PER_START;
use bicycle::Effect;
use serde::{Deserialize, Serialize};

/// Rollouts of a stretch, ten seconds.
const STRETCH: usize = 50;
/// The usual dispersion of a machine counts like that many stretches.
const USUAL_STRETCHES: f64 = 8.0;
/// Information of a stretch that tells next to nothing, in shares of the mean of all.
const LEAST_INFORMATION: f64 = 0.01;
/// Gain of an effect with which a rollout runs away beyond all numbers.
const RAN_AWAY: f64 = -100.0;
/// Information below which nominal drives say nothing of how much of an effect they ask for.
const SILENT: f64 = 5.0;

/// Score and information of the size of an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Score {
    pub(crate) score: f64,
    pub(crate) information: f64,
}

impl Score {
    /// What runs away beyond all numbers tells nothing.
    pub(crate) fn of(before: &[f32], after: &[f32]) -> Self {
        let add = |sum: Self, (before, after): (&f32, &f32)| {
            let [before, change] = [*before, before - after].map(f64::from);
            let weighed = f64::from(weight(before as f32)) * change;
            Self { score: sum.score + weighed * before, information: sum.information + weighed * change }
        };
        let told = before.iter().zip(after).filter(|(before, after)| (*before - *after).is_finite());
        told.fold(Self::default(), add)
    }

    /// What the best size of the effect would take off the sum of squares, were the change in proportion to the size.
    pub(crate) fn gain(self) -> f64 {
        self.score.max(0.0).powi(2) / self.information.max(f64::MIN_POSITIVE)
    }

    /// Of the effect as it is and not of its size: what nominal drives ask for, up to all of it either way.
    fn amplitude(self) -> f64 {
        (self.score / self.information.max(SILENT)).clamp(-1.0, 1.0)
    }

    /// In standard deviations of chance; what is asked for the other way round is nothing.
    fn strength(self, dispersion: f64) -> f64 {
        let chance = (self.information * dispersion).sqrt().max(f64::MIN_POSITIVE);
        (self.score / chance).max(0.0)
    }
}

impl<'a> std::iter::Sum<&'a Self> for Score {
    fn sum<I: Iterator<Item = &'a Self>>(scores: I) -> Self {
        scores.fold(Self::default(), |sum, own| Self {
            score: sum.score + own.score,
            information: sum.information + own.information,
        })
    }
}

/// Of every stretch of every drive, the last one of a drive up to half as long again.
fn scores(trial: &Trial<'_>, before: &[f32], causes: &[Effect]) -> Vec<Vec<Score>> {
    let after = trial.judged_residuals(causes);
    let mut start = 0;
    let mut by_drive = Vec::new();
    for drive in trial.comparison.drives() {
        let n = drive.starts.len();
        let ends = (1..(n / STRETCH).max(1)).map(|k| k * STRETCH).chain([n]);
        let mut from = 0;
        let of = |to: usize| {
            let rows = (start + from) * PER_START..(start + to) * PER_START;
            from = to;
            Score::of(&before[rows.clone()], &after[rows])
        };
        by_drive.push(ends.map(of).collect());
        start += n;
    }
    by_drive
}

/// Squared score over information, mean over stretches, once the scores are those of what is left beside an amplitude.
fn dispersion(stretches: &[Score], amplitude: f64) -> f64 {
    let n = stretches.len().max(1) as f64;
    let least = LEAST_INFORMATION * stretches.iter().map(|own| own.information).sum::<f64>() / n;
    let ratio = |own: &Score| {
        let left = own.score - amplitude * own.information;
        left * left / own.information.max(least).max(f64::MIN_POSITIVE)
    };
    stretches.iter().map(ratio).sum::<f64>() / n
}

/// An effect of some size on nominal drives that the model was not calibrated on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Nominal {
    effect: Effect,
    dispersion: f64,
    n_stretches: f64,
    amplitude: f64,
}

/// How strongly nominal drives ask for effects that they do not have.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Chance {
    /// Every effect at every size that the catalogue tries.
    nominal: Vec<Nominal>,
    /// Dispersion of the median effect.
    usual: f64,
}

/// Scores of effects at the sizes that the catalogue tries on one drive.
pub(crate) type TriedScores = Vec<(Effect, Vec<Score>)>;

/// On a nominal drive that the model was not calibrated on.
pub(crate) fn tried_scores(trial: &Trial<'_>, effects: &[Effect]) -> TriedScores {
    let before = trial.judged_residuals(&[]);
    effects.iter().map(|&own| (own, scores(trial, &before, &[own]).concat())).collect()
}

impl Chance {
    /// Of nominal drives, each with the same effects in the same order.
    pub(crate) fn of(drives: &[&TriedScores]) -> Self {
        let Some(first) = drives.first() else { return Self::default() };
        let effect = |place: usize| {
            let stretches: Vec<Score> = drives.iter().flat_map(|drive| drive[place].1.clone()).collect();
            Nominal {
                effect: first[place].0,
                dispersion: dispersion(&stretches, 0.0),
                n_stretches: stretches.len() as f64,
                amplitude: stretches.iter().sum::<Score>().amplitude(),
            }
        };
        let nominal: Vec<Nominal> = (0..first.len()).map(effect).collect();
        let mut told: Vec<f64> =
            nominal.iter().map(|own| own.dispersion).filter(|dispersion| *dispersion > 0.0).collect();
        told.sort_by(f64::total_cmp);
        let usual = told.get(told.len() / 2).copied().unwrap_or(1.0);
        Self { nominal, usual }
    }

    /// What supports a single effect, given the loss without it.
    pub(crate) fn support(
        &self,
        (trial, before): (&Trial<'_>, &[f32]),
        own: &Explanation,
        none: f64,
    ) -> Support {
        let by_drive = scores(trial, before, &own.causes);
        let stretches = by_drive.concat();
        let whole: Score = stretches.iter().sum();
        let own_amplitude = whole.score / whole.information.max(f64::MIN_POSITIVE);
        let nominal = own.causes.first().and_then(|cause| self.nearest(cause));
        let told = nominal.map_or([0.0; 2], |nominal| [nominal.dispersion, nominal.n_stretches]);
        let n = stretches.len() as f64;
        let sum =
            USUAL_STRETCHES * self.usual + told[0] * told[1] + dispersion(&stretches, own_amplitude) * n;
        let dispersion = sum / (USUAL_STRETCHES + told[1] + n);
        let strength = |scores: &Vec<Score>| scores.iter().sum::<Score>().strength(dispersion);
        Support {
            gain: (trial.comparison.numbers_ratio() * (none.ln() - own.energy())).max(RAN_AWAY),
            strength: whole.strength(dispersion),
            least_strength: by_drive.iter().map(strength).fold(f64::INFINITY, f64::min),
            nominal: nominal.map_or(0.0, |nominal| nominal.amplitude),
            attitude: 0.0,
        }
    }

    /// The same effect at the size nearest to this one.
    fn nearest(&self, effect: &Effect) -> Option<&Nominal> {
        let of_kind =
            self.nominal.iter().filter(|own| own.effect.description().id == effect.description().id);
        of_kind.min_by(|a, b| distance(&a.effect, effect).total_cmp(&distance(&b.effect, effect)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretches(scores: &[f64], information: f64) -> Vec<Score> {
        scores.iter().map(|&score| Score { score, information }).collect()
    }

    /// Scores of 4 on an information of 4 are (4^2) / 4 = 4 times what chance is without dispersion; where 3 of each is
    /// that of an amplitude of 0.75, 1 is left, a quarter.
    #[test]
    fn dispersion_is_the_squared_score_over_the_information() {
        assert!((dispersion(&stretches(&[4.0, -4.0, 4.0], 4.0), 0.0) - 4.0).abs() < 1e-12);
        assert!((dispersion(&stretches(&[4.0, 2.0], 4.0), 0.75) - 0.25).abs() < 1e-12);
        assert!(dispersion(&stretches(&[0.0; 3], 0.0), 0.0).abs() < 1e-12);
    }

    /// 12 over the root of 9 times 4; what is asked for the other way round is nothing.
    #[test]
    fn strength_is_in_standard_deviations_of_chance() {
        let of = |score: f64| Score { score, information: 9.0 }.strength(4.0);
        assert!((of(12.0) - 2.0).abs() < 1e-12);
        assert!(of(-12.0).abs() < 1e-12);
    }

    /// Half of an effect takes residuals of 1 and 1 to 0, which is 2 off their squares: at the whole of it they are -1, the change
    /// is 2 of each, the score 4 and the information 8, but for the weight of a residual of 1, the root of 0.9. One that makes
    /// them larger gains nothing.
    #[test]
    fn a_gain_is_that_of_the_best_size() {
        let gain = Score::of(&[1.0, 1.0], &[-1.0, -1.0]).gain();
        assert!((gain - 2.0 * 0.9_f64.sqrt()).abs() < 1e-6, "{gain}");
        assert_eq!(Score::of(&[1.0, 1.0], &[2.0, 2.0]).gain(), 0.0);
    }

    /// Two residuals of 1 and -2 that an effect takes to 0.5 and -2: w d r is 0.5 and w d d is 0.25 of the first alone,
    /// w being 1 / sqrt(1 + 1 / 9).
    #[test]
    fn a_score_is_that_of_what_changes() {
        let own = Score::of(&[1.0, -2.0], &[0.5, -2.0]);
        let weight = 0.9_f64.sqrt();
        assert!((own.score - 0.5 * weight).abs() < 1e-6 && (own.information - 0.25 * weight).abs() < 1e-6);
    }

    /// Nothing of what ran away is counted, and what is left is a number.
    #[test]
    fn what_ran_away_tells_nothing() {
        let own = Score::of(&[1.0, 1.0, 1.0], &[0.5, f32::INFINITY, f32::NAN]);
        assert_eq!(own, Score::of(&[1.0], &[0.5]));
        let far = Score::of(&[1.0], &[f32::MAX]);
        assert!(far.information.is_finite() && far.amplitude().is_finite() && far.strength(1.0).is_finite());
    }

    /// Nominal drives say of the nearest size what the effect is like to them: of 0.9 and 1.1 tried, 0.92 is as 0.9.
    #[test]
    fn the_nearest_size_tells() {
        let sizes = [0.9, 1.1].map(|ratio| crate::engine_tests::effect("steer_gain", ratio));
        let tried: TriedScores = sizes
            .iter()
            .zip([2.0, 6.0])
            .map(|(own, score)| (*own, stretches(&[score, -score], 4.0)))
            .collect();
        let chance = Chance::of(&[&tried, &tried]);
        let nearest = chance.nearest(&crate::engine_tests::effect("steer_gain", 0.92));
        assert!(nearest.is_some_and(|own| (own.dispersion - 1.0).abs() < 1e-12 && own.effect == sizes[0]));
        assert!(chance.nearest(&crate::engine_tests::effect("steer_lag", 0.2)).is_none());
    }
}
