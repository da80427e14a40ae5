//! From explanations to a verdict: every explanation has an energy, the logarithm of its loss plus a price per effect;
//! the smallest energy wins, and energies become probabilities.

use crate::answer::{Ranked, Verdict};
use crate::baseline::Null;
use crate::causes::{Explanation, candidates};
use bicycle::Effect;

/// Logarithmic gain that an effect must bring beyond what it brings between nominal drives.
const PRICE_OF_ONE: f64 = 0.05;
/// The same for a second effect, which a wrong shape of the first one invites.
pub(crate) const PRICE_OF_TWO: f64 = 0.12;
/// The same on top where both are in one actuator: two of them are the usual shape of a third that has no name.
const PRICE_OF_ONE_ACTUATOR: f64 = 0.18;
/// Effects of one actuator.
const ACTUATORS: [&[&str]; 2] = [
    &["steer_lag", "steer_delay", "steer_rate", "backlash"],
    &["speed_lag", "speed_delay", "accel_limit", "motor_deadband"],
];
/// Difference in energy that makes one explanation e times as probable as another.
pub(crate) const TEMPERATURE: f64 = 0.035;
/// An effect is announced only when it takes this share off the loss, or off the null's where that is larger, beyond what it
/// takes off between nominal drives.
const BEYOND_DOUBT: f64 = 0.1;
/// Explanations this much less probable than the best are told apart from it.
const TOLD_APART: f64 = 0.25;
/// Where the data tell nothing apart, this many names are enough to say so.
const MOST_NAMES: usize = 6;
/// What is left is unknown when its loss exceeds this many losses of the null and
pub(crate) const UNKNOWN_IN_NULLS: f64 = 1.7;
/// this share of what there was above it.
pub(crate) const UNKNOWN_SHARE: f64 = 0.45;
/// An unknown rest beside less than this part of the squared gap makes a name worthless.
pub(crate) const WORTH_A_NAME: f64 = 0.45;
/// A second effect is sought where the best single leaves more than its price above so many losses of the null: what nominal
/// drives leave, easier drives undercut without one.
const PAIRS_ABOVE_NULLS: f64 = 0.9;
/// A second effect must take this share of the whole loss off what the best single leaves: the form of the first is true to
/// some hundredths of what it explains, and another effect mends the rest of it.
const SHARE_OF_A_SECOND: f64 = 0.02;

/// All explanations that were tried, singles and pairs best first.
pub(crate) struct Weighed {
    pub(crate) none: Explanation,
    pub(crate) singles: Vec<Explanation>,
    pub(crate) pairs: Vec<Explanation>,
}

/// The verdict with what led to it.
pub(crate) struct Judgement {
    pub(crate) verdict: Verdict,
    pub(crate) announced: Vec<Effect>,
    pub(crate) ranking: Vec<Ranked>,
    pub(crate) credible_set: Vec<String>,
}

/// What an explanation must gain to be believed.
fn price(explanation: &Explanation, null: &Null) -> f64 {
    let nulls = chance_gain(explanation, null);
    let ids = explanation.ids();
    let is_one_actuator = |own: &&&[&str]| ids.iter().all(|id| own.contains(id));
    nulls
        + match ids.len() {
            0 => 0.0,
            1 => PRICE_OF_ONE,
            _ if ACTUATORS.iter().any(|own| is_one_actuator(&own)) => {
                PRICE_OF_ONE + PRICE_OF_TWO + PRICE_OF_ONE_ACTUATOR
            }
            _ => PRICE_OF_ONE + PRICE_OF_TWO,
        }
}

/// What an explanation gains between nominal drives: of a pair what its likelier member does, and a second one.
fn chance_gain(explanation: &Explanation, null: &Null) -> f64 {
    let own = |id: &&str| null.gains.get(*id).copied().unwrap_or(0.0);
    let gains = explanation.ids().iter().map(own).fold(0.0, f64::max);
    if explanation.causes.len() > 1 { gains + null.gain_of_two } else { gains }
}

impl Weighed {
    /// Whether the best single leaves enough for a second effect.
    pub(crate) fn may_hold_pairs(&self, null: &Null) -> bool {
        let least = PAIRS_ABOVE_NULLS * null.loss;
        self.singles.first().is_some_and(|single| {
            (single.loss / least).ln() > PRICE_OF_TWO && single.loss > SHARE_OF_A_SECOND * self.none.loss
        })
    }

    pub(crate) fn judge(&self, null: &Null) -> Judgement {
        let pairs = self.pairs.iter().filter(|pair| self.takes_its_share(pair));
        let explanations = std::iter::once(&self.none).chain(&self.singles).chain(pairs);
        let mut all: Vec<(f64, &Explanation)> = explanations
            .map(|explanation| (explanation.energy() + price(explanation, null), explanation))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = if self.is_beyond_doubt(all[0].1, null) { all[0].1 } else { &self.none };
        let (verdict, announced) = self.verdict(best, null);
        let credible_set = self.credible_set(best);
        Judgement { verdict, announced, ranking: ranking(&all), credible_set }
    }

    fn takes_its_share(&self, pair: &Explanation) -> bool {
        let single = self.singles.iter().map(Explanation::energy).fold(f64::INFINITY, f64::min);
        single.exp() - pair.energy().exp() > SHARE_OF_A_SECOND * self.none.loss
    }

    fn is_beyond_doubt(&self, best: &Explanation, null: &Null) -> bool {
        let gain = (self.none.loss - best.energy().exp()) / self.none.loss.max(null.loss);
        let would_show = best.causes.iter().all(|own| null.limits_shown.would_show(own));
        would_show && gain - chance_gain(best, null) > BEYOND_DOUBT
    }

    fn verdict(&self, best: &Explanation, null: &Null) -> (Verdict, Vec<Effect>) {
        let over = |loss: f64| (loss - null.loss).max(0.0);
        let left = over(best.loss) / over(self.none.loss).max(1e-9);
        let unknown = best.loss / null.loss > UNKNOWN_IN_NULLS && left > UNKNOWN_SHARE;
        match (best.causes.is_empty(), unknown) {
            (true, false) => (Verdict::None, Vec::new()),
            (true, true) => (Verdict::Unknown, Vec::new()),
            (false, false) => (Verdict::Effects, best.causes.clone()),
            (false, true) if 1.0 - left < WORTH_A_NAME => (Verdict::Unknown, Vec::new()),
            (false, true) => (Verdict::EffectsAndUnknown, best.causes.clone()),
        }
    }

    /// Singles that the data cannot tell apart from the best single; of a pair, its members.
    fn credible_set(&self, best: &Explanation) -> Vec<String> {
        let reach = -TEMPERATURE * TOLD_APART.ln();
        let Some(first) = self.singles.first() else { return Vec::new() };
        let near = self.singles.iter().take_while(|single| single.energy() - first.energy() < reach);
        let mut ids: Vec<String> = match best.causes.len() {
            2.. => best.ids().iter().map(|id| (*id).to_owned()).collect(),
            _ => near.flat_map(Explanation::ids).map(str::to_owned).collect(),
        };
        ids.dedup();
        ids.truncate(MOST_NAMES);
        ids
    }
}

/// The probability of every effect to be in the true explanation.
fn ranking(all: &[(f64, &Explanation)]) -> Vec<Ranked> {
    let least = all[0].0;
    let weight = |energy: f64| (-(energy - least) / TEMPERATURE).exp();
    let total: f64 = all.iter().map(|(energy, _)| weight(*energy)).sum();
    let of = |id: &str| {
        let holds = all.iter().filter(|(_, explanation)| explanation.ids().contains(&id));
        holds.map(|(energy, _)| weight(*energy)).sum::<f64>() / total
    };
    let mut ranking: Vec<Ranked> = candidates()
        .filter(|description| description.id == description.cause)
        .map(|description| Ranked { id: description.id.to_owned(), score: of(description.id) })
        .collect();
    ranking.sort_by(|a, b| b.score.total_cmp(&a.score));
    ranking
}
