//! From explanations to a verdict: every explanation has an energy, the logarithm of its loss plus a price per effect;
//! the smallest energy wins, and energies become probabilities.

use crate::answer::{Ranked, Verdict};
use crate::baseline::Null;
use crate::causes::{Explanation, candidates};
use bicycle::Effect;

/// Logarithmic gain that an effect must bring beyond what it brings between nominal drives.
const PRICE_OF_ONE: f64 = 0.105;
/// The same for a second effect, which a wrong shape of the first one invites.
const PRICE_OF_TWO: f64 = 0.24;
/// The same for a second effect in the sensors, which no wrong shape of a motion looks like.
const PRICE_OF_A_SECOND_SENSOR: f64 = 0.15;
/// Difference in energy that makes one explanation e times as probable as another.
pub(crate) const TEMPERATURE: f64 = 0.035;
/// An effect is announced only when nothing at all is this much worse in energy.
const BEYOND_DOUBT: f64 = 0.06;
/// Explanations this much less probable than the best are told apart from it.
const TOLD_APART: f64 = 0.05;
/// Where the data tell nothing apart, this many names are enough to say so.
const MOST_NAMES: usize = 6;
/// What is left is unknown when its error exceeds this many floors and
const UNKNOWN_IN_FLOORS: f64 = 1.55;
/// this share of the gap.
const UNKNOWN_SHARE: f64 = 0.35;
/// The same beside friction, where a rest is no sign of anything else: how a vehicle slides is only outlined.
const UNKNOWN_SHARE_WHILE_SLIDING: f64 = 0.75;
/// An unknown rest beside less than this part of the squared gap makes a name worthless.
const WORTH_A_NAME: f64 = 0.25;
/// The loss that a drive may have at best, in losses of the null.
const LEAST_LOSS: f64 = 0.65;

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
    let own = |id: &&str| null.gains.get(*id).copied().unwrap_or(0.0);
    let nulls: f64 = explanation.ids().iter().map(own).sum();
    let has_sensor = explanation.causes.iter().any(Effect::acts_on_sensors);
    nulls
        + match explanation.causes.len() {
            0 => 0.0,
            1 => PRICE_OF_ONE,
            _ if has_sensor => PRICE_OF_ONE + PRICE_OF_A_SECOND_SENSOR,
            _ => PRICE_OF_ONE + PRICE_OF_TWO,
        }
}

impl Weighed {
    /// Whether what the best single leaves is more than a pair's price above what could be left at best.
    pub(crate) fn may_hold_pairs(&self, null: &Null) -> bool {
        let least = LEAST_LOSS * null.loss;
        self.singles.first().is_some_and(|single| (single.loss / least).ln() > PRICE_OF_A_SECOND_SENSOR)
    }

    pub(crate) fn judge(&self, null: &Null) -> Judgement {
        let explanations = std::iter::once(&self.none).chain(&self.singles).chain(&self.pairs);
        let mut all: Vec<(f64, &Explanation)> = explanations
            .map(|explanation| (explanation.energy() + price(explanation, null), explanation))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_beyond_doubt = all[0].0 + BEYOND_DOUBT < self.none.loss.ln();
        let best = if is_beyond_doubt { all[0].1 } else { &self.none };
        let (verdict, announced) = self.verdict(best, null);
        let credible_set = self.credible_set(best);
        Judgement { verdict, announced, ranking: ranking(&all), credible_set }
    }

    fn verdict(&self, best: &Explanation, null: &Null) -> (Verdict, Vec<Effect>) {
        let over = |loss: f64| (loss - null.loss).max(0.0);
        let left = over(best.loss) / over(self.none.loss).max(1e-9);
        let floors = (best.loss / null.loss).sqrt();
        let slides = best.causes.iter().any(|cause| matches!(cause, Effect::Friction(_)));
        let share = if slides { UNKNOWN_SHARE_WHILE_SLIDING } else { UNKNOWN_SHARE };
        let unknown = floors > UNKNOWN_IN_FLOORS && left.sqrt() > share;
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
