//! Which temperature gives the wanted effective sample size.

use libm::{logf, powf};

/// Halvings of what is searched, in the logarithm: the effective sample size is then met within one rollout in 1000.
const N_HALVINGS: usize = 14;
/// The search spans this factor around the last temperature.
const SEARCH_FACTOR: f32 = 1024.0;
/// Guesses by slope. Where they have not met by then what is left is halved, so that no shape of costs makes the search
/// long.
const N_GUESSES: usize = 8;
/// Exponents by which the sample size may follow the temperature: a slope beyond them is rounding, or an end of what is
/// possible.
const EXPONENTS: std::ops::RangeInclusive<f32> = 0.05..=20.0;

/// A temperature [s] and the effective sample size that it gave.
#[derive(Clone, Copy)]
struct Tried {
    temperature_s: f32,
    sample_size: f32,
}

/// The temperature at which the effective sample size is the wanted one [s].
///
/// It is the one that `N_HALVINGS` halvings find, to the bit, wherever the sample size grows with the temperature. Of the
/// halvings only those are tried that what was tried before does not decide, and where to go is guessed by slope, so that
/// some five are.
#[inline(always)]
pub(super) fn find(wanted: f32, last_s: f32, mut sample_size: impl FnMut(f32) -> f32) -> f32 {
    let mut bracket = Bracket { low_s: last_s / SEARCH_FACTOR, high_s: last_s * SEARCH_FACTOR };
    let span = bracket;
    let (mut guess_s, mut exponent, mut before) = (last_s, 1.0, None);
    for n_tried in 1.. {
        let halved = span.halved(&bracket, guess_s);
        let Some(temperature_s) =
            [halved.low_s, halved.high_s].into_iter().find(|&end_s| bracket.holds(end_s))
        else {
            return halved.middle_s();
        };
        let tried = Tried { temperature_s, sample_size: sample_size(temperature_s) };
        bracket.narrow(&tried, wanted);
        exponent = before.and_then(|before| slope(&before, &tried)).unwrap_or(exponent);
        before = Some(tried);
        let by_slope_s = temperature_s * powf(wanted / tried.sample_size, 1.0 / exponent);
        let is_credible = n_tried <= N_GUESSES && bracket.holds(by_slope_s);
        guess_s = if is_credible { by_slope_s } else { bracket.middle_s() };
    }
    guess_s
}

/// The exponent by which the sample size follows the temperature; `None` where it is none that can be believed.
fn slope(one: &Tried, other: &Tried) -> Option<f32> {
    let exponent = logf(other.sample_size / one.sample_size) / logf(other.temperature_s / one.temperature_s);
    EXPONENTS.contains(&exponent).then_some(exponent)
}

/// Temperatures that give too few and enough [s].
#[derive(Clone, Copy)]
struct Bracket {
    low_s: f32,
    high_s: f32,
}

impl Bracket {
    /// In the logarithm.
    fn middle_s(&self) -> f32 {
        (self.low_s * self.high_s).sqrt()
    }

    /// Whether it is not known yet what a temperature gives.
    fn holds(&self, temperature_s: f32) -> bool {
        self.low_s < temperature_s && temperature_s < self.high_s
    }

    fn narrow(&mut self, tried: &Tried, wanted: f32) {
        if tried.sample_size < wanted {
            self.low_s = tried.temperature_s;
        } else {
            self.high_s = tried.temperature_s;
        }
    }

    /// What the halvings leave, where `known` and, within it, `guess_s` decide them.
    fn halved(mut self, known: &Self, guess_s: f32) -> Self {
        for _ in 0..N_HALVINGS {
            let middle_s = self.middle_s();
            let is_low = if known.holds(middle_s) { middle_s < guess_s } else { middle_s <= known.low_s };
            if is_low {
                self.low_s = middle_s;
            } else {
                self.high_s = middle_s;
            }
        }
        self
    }
}

#[cfg(test)]
mod tests;
