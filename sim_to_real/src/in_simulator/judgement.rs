//! What is announced: a cause that is clearly better on drives that it was not fitted to, or nothing.

use super::InSimulatorDiagnosis;
use super::intervals::causes;
use super::lever::Lever;
use super::reference::Reference;
use super::replay::Setting;
use super::search::{Fitted, fitted, mean, polished, refitted};
use super::trial::Trial;
use super::types::{InSimulator, SimulatorCandidate, SimulatorCause, SimulatorDescription};
use crate::answer::{Shrink, Verdict};
use crate::diagnosis::METRIC;
use crate::judgement::{PRICE_OF_TWO, UNKNOWN_IN_NULLS, UNKNOWN_SHARE};

/// A cause is announced only when it takes this share off the loss: less than beside a calibrated model, whose own misfit
/// an effect may make up for.
const BEYOND_DOUBT: f64 = 0.085;
/// The loss that a drive may have at best, in losses of the null.
const LEAST_LOSS: f64 = 0.65;

/// An unknown rest beside less than this part of the squared gap makes a cause worthless.
const WORTH_A_NAME: f64 = 0.45;
/// A cause is clearly better when it gains so many standard errors.
const CLEARLY: f64 = 2.0;

/// What the real drives show in the simulator.
pub(super) struct Judged {
    verdict: Verdict,
    setting: Setting,
    causes: Vec<SimulatorCause>,
    candidates: Vec<SimulatorCandidate>,
    not_told_apart: Vec<String>,
}

/// A share with its standard error.
#[derive(Clone, Copy, Debug)]
struct Gain {
    share: f64,
    standard_error: f64,
}

impl Gain {
    /// What stretches gain from one loss to another, in shares of a loss.
    ///
    /// A cause that acts in some stretches alone gains much there and nothing elsewhere, which is no sign of chance. Chance
    /// makes as many stretches worse as better: the standard error is that of gains that are spread about 0 as those are
    /// that have become losses.
    fn of(before: &[f64], after: &[f64], unit: f64) -> Self {
        let gains: Vec<f64> =
            before.iter().zip(after).map(|(before, after)| (before - after) / unit).collect();
        let (n, share) = (gains.len() as f64, mean(&gains));
        let squares: f64 = gains.iter().map(|gain| 2.0 * gain.min(0.0).powi(2)).sum();
        let standard_error = if n > 1.0 { (squares / (n * (n - 1.0))).sqrt() } else { f64::INFINITY };
        Self { share, standard_error }
    }

    fn is_clear(&self, least: f64) -> bool {
        self.share > least && self.share > CLEARLY * self.standard_error
    }
}

impl Judged {
    /// `others` are tried where what the best of the likeliest leaves is unknown.
    pub(super) fn of<E>(trial: &Trial<'_, E>, likeliest: &[Lever], others: &[Lever]) -> Result<Self, E> {
        let without = trial.losses(&[Vec::new()])?.concat();
        let unit = mean(&without).max(trial.reference.loss);
        let parts = trial.parts();
        let gain = |one: &Fitted| Gain::of(&without, &one.foretold(&parts), unit);
        let is_clear =
            |singles: &[Fitted]| singles.first().is_some_and(|best| gain(best).is_clear(BEYOND_DOUBT));
        let mut singles = alone(trial, &without, likeliest, &parts)?;
        let left = if is_clear(&singles) { singles[0].loss() } else { mean(&without) };
        if is_unknown(trial.reference, left) {
            singles.extend(alone(trial, &without, others, &parts)?);
            sort_by_foretold(&mut singles, &parts);
        }
        let candidates = singles.iter().map(|one| candidate(one, gain(one))).collect();
        if !is_clear(&singles) {
            return Ok(Self::of_nothing(trial.reference, mean(&without), candidates));
        }
        let best = &singles[0];
        let (setting, losses) = with_a_second(trial, (best, &singles), &parts)?;
        let is_rival = |other: &&Fitted| {
            let behind = Gain::of(&other.foretold(&parts), &best.foretold(&parts), unit);
            gain(other).is_clear(BEYOND_DOUBT) && !behind.is_clear(0.0)
        };
        let rivals = singles[1..].iter().filter(is_rival).map(|other| other.lever.name().to_owned());
        let not_told_apart = if setting.len() == 1 { rivals.collect() } else { Vec::new() };
        let verdict = verdict(trial.reference, mean(&without), mean(&losses));
        if verdict == Verdict::Unknown {
            return Ok(Self { verdict, candidates, ..Self::of_nothing(trial.reference, 0.0, Vec::new()) });
        }
        let causes = causes(trial, &setting)?;
        Ok(Self { verdict, setting, causes, candidates, not_told_apart })
    }

    fn of_nothing(reference: &Reference, loss: f64, candidates: Vec<SimulatorCandidate>) -> Self {
        let verdict = if is_unknown(reference, loss) { Verdict::Unknown } else { Verdict::None };
        Self { verdict, setting: Vec::new(), causes: Vec::new(), candidates, not_told_apart: Vec::new() }
    }

    pub(super) fn diagnosis(
        self,
        simulator: &SimulatorDescription,
        reference: Reference,
    ) -> InSimulatorDiagnosis {
        let answer = InSimulator {
            simulator: simulator.name.clone(),
            verdict: self.verdict,
            causes: self.causes,
            not_told_apart: self.not_told_apart,
            candidates: self.candidates,
            shrink: Shrink { metric: METRIC.to_owned(), floor: reference.error, ..Shrink::default() },
            own_drives_error: reference.own_drives_error,
        };
        InSimulatorDiagnosis { answer, simulator: simulator.clone(), reference, setting: self.setting }
    }
}

/// Levers fitted one at a time, those first that foretell the other drives best.
fn alone<E>(
    trial: &Trial<'_, E>,
    without: &[f64],
    levers: &[Lever],
    parts: &[usize],
) -> Result<Vec<Fitted>, E> {
    let mut singles = fitted(trial, (&Vec::new(), without), levers)?;
    sort_by_foretold(&mut singles, parts);
    Ok(singles)
}

fn sort_by_foretold(singles: &mut [Fitted], parts: &[usize]) {
    let foretold = |one: &Fitted| mean(&one.foretold(parts));
    singles.sort_by(|a, b| foretold(a).total_cmp(&foretold(b)));
}

/// Whether drives lie so far from what the simulator's own show that something is missing.
fn is_unknown(reference: &Reference, loss: f64) -> bool {
    loss > UNKNOWN_IN_NULLS * reference.loss
}

fn candidate(fitted: &Fitted, gain: Gain) -> SimulatorCandidate {
    SimulatorCandidate {
        name: fitted.lever.name().to_owned(),
        kind: fitted.lever.kind(),
        value: fitted.lever.value(fitted.place()),
        gain: gain.share,
        gain_standard_error: gain.standard_error,
    }
}

/// The best alone, or with the second that is clearly worth it beside it, both then fitted again; and the losses.
fn with_a_second<E>(
    trial: &Trial<'_, E>,
    (best, singles): (&Fitted, &[Fitted]),
    parts: &[usize],
) -> Result<(Setting, Vec<f64>), E> {
    let has_room = |best: &Fitted| (best.loss() / (LEAST_LOSS * trial.reference.loss)).ln() >= PRICE_OF_TWO;
    let best = if has_room(best) { &polished(trial, best)? } else { best };
    let alone = (vec![(best.lever.clone(), best.place())], best.losses().to_vec());
    if !has_room(best) {
        return Ok(alone);
    }
    let others: Vec<Lever> = singles[1..].iter().map(|other| other.lever.clone()).collect();
    let seconds = fitted(trial, (&alone.0, &alone.1), &others)?;
    let unit = best.loss().max(trial.reference.loss);
    let gain = |second: &Fitted| Gain::of(&alone.1, &second.foretold(parts), unit);
    let Some(second) = seconds.first().filter(|second| gain(second).is_clear(PRICE_OF_TWO)) else {
        return Ok(alone);
    };
    let first = refitted(trial, &vec![(second.lever.clone(), second.place())], (best, second.losses()))?;
    let known = vec![(first.lever.clone(), first.place())];
    let second = refitted(trial, &known, (second, first.losses()))?;
    let setting = known.into_iter().chain([(second.lever.clone(), second.place())]).collect();
    Ok((setting, second.losses().to_vec()))
}

/// What a cause leaves decides whether something unknown stands beside it, or in its place.
fn verdict(reference: &Reference, before: f64, after: f64) -> Verdict {
    let over = |loss: f64| (loss - reference.loss).max(0.0);
    let left = over(after) / over(before).max(1e-9);
    match is_unknown(reference, after) && left > UNKNOWN_SHARE {
        false => Verdict::Effects,
        true if 1.0 - left < WORTH_A_NAME => Verdict::Unknown,
        true => Verdict::EffectsAndUnknown,
    }
}
