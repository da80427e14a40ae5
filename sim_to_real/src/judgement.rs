//! From explanations to a verdict. What supports a single effect makes its logit over none (conditional logit, McFadden
//! 1974), a second effect adds to that of the first what it gains beyond its price; the most probable explanation wins.

use crate::answer::{Ranked, Support, Verdict};
use crate::attitude::AttitudeEvidence;
use crate::baseline::Null;
use crate::causes::{Explanation, candidates};
use bicycle::Effect;

/// Logit of a single effect over none where nothing supports it,
const UNSUPPORTED: f64 = -6.8;
/// and what supports it counts for: the root of its gain, the logarithms of one more than its strength and than that of
/// the weakest drive, and how much of it nominal drives ask for.
const SUPPORT: [f64; 4] = [7.9, 1.2, 1.8, -2.9];
/// How the body leans counts for what the drives ask for by so many standard deviations besides: springs that are not those of
/// the simulator lean as under a load.
const ASKED_FOR: f64 = 2.0;
/// An explanation is announced when it is this many times as probable as none.
const BEYOND_DOUBT: f64 = 2.0;
/// The names that are as good as the best hold the true one with this probability, if one of them is.
const CREDIBLE: f64 = 0.85;
/// Logarithmic gain in loss that a second effect must bring beyond chance: a wrong shape of the first one invites it.
pub(crate) const PRICE_OF_TWO: f64 = 0.12;
/// The same on top where both shape the answer to one command: two of them are the usual shape of a third that has no name.
const PRICE_OF_ONE_ANSWER: f64 = 0.18;
/// Effects that shape the answer to one command: of the yaw rate to the steering, of the speed to its own.
const ANSWERS: [&[&str]; 2] = [
    &["steer_lag", "steer_delay", "steer_rate", "backlash", "understeer"],
    &["speed_lag", "speed_delay", "accel_limit", "motor_deadband"],
];
/// Difference in energy that makes one explanation e times as probable as another.
pub(crate) const TEMPERATURE: f64 = 0.035;
/// Where the data tell nothing apart, this many names are enough to say so.
const MOST_NAMES: usize = 4;
/// What is left is unknown when its loss exceeds this many losses of the null and
pub(crate) const UNKNOWN_IN_NULLS: f64 = 1.7;
/// this share of what there was above it.
pub(crate) const UNKNOWN_SHARE: f64 = 0.45;
/// A second effect is sought where the best single leaves more than its price above so many losses of the null: what nominal
/// drives leave, easier drives undercut without one.
const PAIRS_ABOVE_NULLS: f64 = 0.9;
/// A second effect must take this share of the whole loss off what the best single leaves: the form of the first is true to
/// some hundredths of what it explains, and another effect mends the rest of it.
const SHARE_OF_A_SECOND: f64 = 0.02;
/// One of less is a second all the same where the body's attitude makes it so many times as probable (the logarithm of that):
/// no form of another effect leans on the springs.
const TOLD_BY_ATTITUDE: f64 = 3.0;

/// An effect alone.
pub(crate) struct Single {
    pub(crate) explanation: Explanation,
    pub(crate) support: Support,
}

impl Single {
    fn cause(&self) -> &'static str {
        self.explanation.causes[0].description().cause
    }
}

/// All explanations that were tried, singles and pairs of least energy first.
pub(crate) struct Weighed {
    pub(crate) none: Explanation,
    pub(crate) singles: Vec<Single>,
    pub(crate) pairs: Vec<Explanation>,
    /// Of the drives: [`crate::comparison::Comparison::numbers_ratio`].
    pub(crate) numbers_ratio: f64,
    pub(crate) attitude: AttitudeEvidence,
}

/// The verdict with what led to it.
pub(crate) struct Judgement {
    pub(crate) verdict: Verdict,
    pub(crate) announced: Vec<Effect>,
    pub(crate) ranking: Vec<Ranked>,
    pub(crate) credible_set: Vec<String>,
}

/// Logarithm of how many times as probable as none a single effect is.
fn logit(support: &Support) -> f64 {
    let Support { gain, strength, least_strength, nominal, attitude } = support;
    let features = [gain.max(0.0).sqrt(), strength.ln_1p(), least_strength.ln_1p(), *nominal];
    let leans = if *strength > ASKED_FOR { *attitude } else { 0.0 };
    UNSUPPORTED + leans + SUPPORT.iter().zip(features).map(|(weight, feature)| weight * feature).sum::<f64>()
}

/// Of two explanations with their logits, the likelier.
fn larger<'a>(a: (f64, &'a Explanation), b: (f64, &'a Explanation)) -> (f64, &'a Explanation) {
    if b.0 > a.0 { b } else { a }
}

/// What a second effect must gain to be believed.
fn price(pair: &Explanation, null: &Null) -> f64 {
    let ids = pair.ids();
    let is_one_answer = ANSWERS.iter().any(|own| ids.iter().all(|id| own.contains(id)));
    null.gain_of_two + PRICE_OF_TWO + if is_one_answer { PRICE_OF_ONE_ANSWER } else { 0.0 }
}

impl Weighed {
    /// Whether the best single leaves enough for a second effect.
    pub(crate) fn may_hold_pairs(&self, null: &Null) -> bool {
        let least = PAIRS_ABOVE_NULLS * null.loss;
        self.singles.first().is_some_and(|single| {
            let loss = single.explanation.loss;
            self.numbers_ratio * (loss / least).ln() > PRICE_OF_TWO
                && loss > SHARE_OF_A_SECOND * self.none.loss
        })
    }

    /// Causes that the body's attitude tells alone.
    pub(crate) fn told_by_attitude(&self) -> Vec<&'static str> {
        let told = self.singles.iter().filter(|single| single.support.attitude > TOLD_BY_ATTITUDE);
        told.map(Single::cause).collect()
    }

    pub(crate) fn judge(&self, null: &Null) -> Judgement {
        let all = self.by_logit(null);
        let best = self.told(&all, null);
        let (verdict, announced) = self.verdict(best, null);
        Judgement { verdict, announced, ranking: self.ranking(&all), credible_set: self.credible_set(best) }
    }

    /// The likeliest explanation where it is beyond doubt. In place of a pair with a limit that nominal drives never came
    /// near, which they may have too, its other effect alone.
    fn told<'a>(&'a self, all: &[(f64, &'a Explanation)], null: &Null) -> &'a Explanation {
        let likeliest = all[0].1.ids();
        let is_part = |own: &Explanation| own.ids().iter().all(|id| likeliest.contains(id));
        let would_show = |own: &Explanation| own.causes.iter().all(|own| null.limits_shown.would_show(own));
        let told = all.iter().find(|(_, own)| is_part(own) && would_show(own));
        told.filter(|(logit, _)| *logit > BEYOND_DOUBT.ln()).map_or(&self.none, |(_, told)| told)
    }

    /// Every explanation with its logit over none, the largest first.
    fn by_logit(&self, null: &Null) -> Vec<(f64, &Explanation)> {
        let singles = self.singles.iter().map(|single| (logit(&single.support), &single.explanation));
        let mut all: Vec<(f64, &Explanation)> = singles.collect();
        if let Some(first) = self.singles.first() {
            let (of_one, likeliest) = all.iter().copied().fold((f64::NEG_INFINITY, &self.none), larger);
            let leans = |pair: &Explanation| {
                self.attitude.support(&pair.causes) - self.attitude.support(&likeliest.causes)
            };
            let of_two = |pair: &Explanation| {
                let gain = self.numbers_ratio * (first.explanation.energy() - pair.energy());
                of_one + (gain - price(pair, null)) / TEMPERATURE + leans(pair)
            };
            let pairs =
                self.pairs.iter().filter(|pair| self.takes_its_share(pair) || leans(pair) > TOLD_BY_ATTITUDE);
            all.extend(pairs.map(|pair| (of_two(pair), pair)));
        }
        all.push((0.0, &self.none));
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all
    }

    fn takes_its_share(&self, pair: &Explanation) -> bool {
        let energy = |single: &Single| single.explanation.energy();
        let single = self.singles.iter().map(energy).fold(f64::INFINITY, f64::min);
        single.exp() - pair.energy().exp() > SHARE_OF_A_SECOND * self.none.loss
    }

    fn verdict(&self, best: &Explanation, null: &Null) -> (Verdict, Vec<Effect>) {
        let over = |loss: f64| (loss - null.loss).max(0.0);
        let left = over(best.loss) / over(self.none.loss).max(1e-9);
        let nulls = (best.loss / null.loss).powf(self.numbers_ratio);
        let unknown = nulls > UNKNOWN_IN_NULLS && left > UNKNOWN_SHARE;
        match (best.causes.is_empty(), unknown) {
            (true, false) => (Verdict::None, Vec::new()),
            (true, true) => (Verdict::Unknown, Vec::new()),
            (false, false) => (Verdict::Effects, self.likeliest_first(best)),
            (false, true) => (Verdict::EffectsAndUnknown, self.likeliest_first(best)),
        }
    }

    /// The causes of an explanation by how probable each is alone.
    fn likeliest_first(&self, explanation: &Explanation) -> Vec<Effect> {
        let alone = |cause: &Effect| {
            let own = self.singles.iter().find(|single| single.cause() == cause.description().cause);
            own.map_or(f64::NEG_INFINITY, |single| logit(&single.support))
        };
        let mut causes = explanation.causes.clone();
        causes.sort_by(|a, b| alone(b).total_cmp(&alone(a)));
        causes
    }

    /// The likeliest singles that hold the true one with some probability, if one of them is; of a pair, its members.
    fn credible_set(&self, best: &Explanation) -> Vec<String> {
        if best.causes.len() > 1 {
            return best.ids().into_iter().map(str::to_owned).collect();
        }
        let mut singles: Vec<(f64, &str)> =
            self.singles.iter().map(|single| (logit(&single.support).exp(), single.cause())).collect();
        singles.sort_by(|a, b| b.0.total_cmp(&a.0));
        let all: f64 = singles.iter().map(|(odds, _)| odds).sum();
        let held = singles.iter().scan(0.0, |held, (odds, _)| Some(std::mem::replace(held, *held + odds)));
        let needed = held.take_while(|held| *held < CREDIBLE * all).count().min(MOST_NAMES);
        singles[..needed].iter().map(|(_, id)| (*id).to_owned()).collect()
    }

    /// The probability of every effect to be in the true explanation.
    fn ranking(&self, all: &[(f64, &Explanation)]) -> Vec<Ranked> {
        let odds = |logit: f64| (logit - all[0].0).exp();
        let total: f64 = all.iter().map(|(logit, _)| odds(*logit)).sum();
        let of = |id: &str| {
            let holds = all.iter().filter(|(_, explanation)| explanation.ids().contains(&id));
            holds.map(|(logit, _)| odds(*logit)).sum::<f64>() / total
        };
        let support =
            |id: &str| self.singles.iter().find(|single| single.cause() == id).map(|single| single.support);
        let ranked = |id: &'static str| Ranked { id: id.to_owned(), score: of(id), support: support(id) };
        let causes = candidates().filter(|description| description.id == description.cause);
        let mut ranking: Vec<Ranked> = causes.map(|description| ranked(description.id)).collect();
        ranking.sort_by(|a, b| b.score.total_cmp(&a.score));
        ranking
    }
}
