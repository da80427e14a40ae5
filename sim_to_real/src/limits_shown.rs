//! Limits that nominal drives would have shown: one that they never came near may be the simulator's as well, and is no
//! sign of a gap.

use crate::calibration::is_limit;
use crate::causes::{Trial, candidates};
use bicycle::Effect;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Ratio of one value that is tried to the next.
const RATIO: f64 = 1.25;
/// How far beyond the values of the catalogue is tried.
const BEYOND: [f64; 2] = [0.5, 5.0];
/// A limit shows when nominal drives are foretold worse with it by this in the logarithm of their loss.
const SHOWS: f64 = 0.03;

/// For every effect that limits something, from which value on the nominal drives would have shown it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LimitsShown(BTreeMap<String, f64>);

#[cfg(test)]
impl<'a> FromIterator<(&'a str, f64)> for LimitsShown {
    fn from_iter<T: IntoIterator<Item = (&'a str, f64)>>(limits: T) -> Self {
        Self(limits.into_iter().map(|(id, limit)| (id.to_owned(), limit)).collect())
    }
}

impl LimitsShown {
    /// Of nominal drives under the model that was calibrated on them.
    pub(crate) fn of(nominal: &Trial<'_>) -> Self {
        let before = nominal.loss(&[]);
        let mut shown = BTreeMap::new();
        for description in candidates().filter(|own| is_limit(&own.parameters[0])) {
            let tried = description.parameters[0].tried;
            let (low, high) = (BEYOND[0] * tried[0], BEYOND[1] * tried[tried.len() - 1]);
            let neutral = description.parameters.iter().map(|parameter| parameter.neutral);
            let mut values: [f64; 4] = [0.0; 4];
            values.iter_mut().zip(neutral).for_each(|(value, neutral)| *value = neutral);
            let mut limit = high;
            while limit > low {
                values[0] = limit;
                let with = Effect::from_values(description.id, values);
                if with.is_some_and(|with| (nominal.loss(&[with]) / before).ln() > SHOWS) {
                    break;
                }
                limit /= RATIO;
            }
            shown.insert(description.id.to_owned(), limit);
        }
        Self(shown)
    }

    /// Whether nominal drives would have shown an effect: whatever limits nothing they would.
    pub(crate) fn would_show(&self, effect: &Effect) -> bool {
        self.0.get(effect.description().id).is_none_or(|limit| effect.values()[0] <= *limit)
    }
}
