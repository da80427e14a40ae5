//! Limits that nominal drives would have shown: one that they never came near may be the simulator's as well, and is no
//! sign of a gap.

use crate::calibration::is_limit;
use crate::causes::{Trial, candidates, tried};
use bicycle::Effect;
use bicycle::effect::Description;
use serde::{Deserialize, Serialize};

/// Ratio of one value that is tried to the next.
const RATIO: f64 = 1.25;
/// How far beyond the values of the catalogue is tried.
const BEYOND: [f64; 2] = [0.5, 5.0];
/// A limit shows when nominal drives are foretold worse with it by this in the logarithm of their loss.
const SHOWS: f64 = 0.03;

/// Of every effect that limits something the weakest that nominal drives would have shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LimitsShown(Vec<Effect>);

#[cfg(test)]
impl FromIterator<Effect> for LimitsShown {
    fn from_iter<T: IntoIterator<Item = Effect>>(limits: T) -> Self {
        Self(limits.into_iter().collect())
    }
}

impl LimitsShown {
    /// Of nominal drives under the model that was calibrated on them.
    pub(crate) fn of(nominal: &Trial<'_>) -> Self {
        let before = nominal.loss(&[]);
        let shows = |limit: &Effect| (nominal.loss(&[*limit]) / before).ln() > SHOWS;
        let limits = candidates().filter(|description| is_limit(&description.parameters[0]));
        Self(limits.flat_map(|description| weakest(description, shows)).collect())
    }

    /// Whether nominal drives would have shown an effect, being at least as strong in everything as one that they would:
    /// whatever limits nothing they would.
    pub(crate) fn would_show(&self, effect: &Effect) -> bool {
        let Description { id, parameters, .. } = effect.description();
        let is_as_strong = |shown: &Effect| {
            let both = effect.values().into_iter().zip(shown.values());
            both.take(parameters.len()).all(|(own, shown)| own <= shown)
        };
        let mut of_kind = self.0.iter().filter(|shown| shown.description().id == id).peekable();
        of_kind.peek().is_none() || of_kind.any(is_as_strong)
    }
}

/// With every choice of the other parameters the weakest limit that shows, or the strongest that is tried.
fn weakest(description: &Description, shows: impl Fn(&Effect) -> bool) -> Vec<Effect> {
    let mut others: Vec<[f64; 4]> = Vec::new();
    for effect in tried(description) {
        let mut values = effect.values();
        values[0] = description.parameters[0].neutral;
        if !others.contains(&values) {
            others.push(values);
        }
    }
    let first = description.parameters[0].tried;
    let (low, high) = (BEYOND[0] * first[0], BEYOND[1] * first[first.len() - 1]);
    let limit = |values: [f64; 4], own: f64| {
        let [_, rest @ ..] = values;
        Effect::from_values(description.id, [own, rest[0], rest[1], rest[2]])
    };
    let finest = |values: [f64; 4]| {
        let mut own = high;
        while own > low && !limit(values, own).as_ref().is_some_and(&shows) {
            own /= RATIO;
        }
        limit(values, own)
    };
    others.into_iter().filter_map(finest).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::engine_tests::effect;

    fn slide(mu: f64, driven_share: f64) -> Effect {
        Effect::from_values("tyre_slide", [mu, driven_share, 0.0, 0.0]).unwrap()
    }

    /// Nominal drives that ask for 2 m/s2 ahead and aside show a friction of 0.2, and one of 0.4 where half of the weight is
    /// on driven wheels.
    #[test]
    fn the_weakest_limit_depends_on_what_else_there_is() {
        let description = candidates().find(|own| own.id == "tyre_slide").unwrap();
        let shows = |limit: &Effect| {
            let [mu, driven_share, ..] = limit.values();
            9.8 * mu < 2.0 || 9.8 * mu * driven_share < 2.0
        };
        let limits = LimitsShown(weakest(description, shows));
        let shown = |mu, driven_share| limits.would_show(&slide(mu, driven_share));
        assert!(shown(0.16, 1.0) && !shown(0.21, 1.0));
        assert!(shown(0.32, 0.5) && shown(0.32, 0.4) && !shown(0.42, 0.5) && !shown(0.32, 0.6));
        // What limits nothing they would.
        assert!(limits.would_show(&effect("steer_gain", 1.1)));
    }
}
