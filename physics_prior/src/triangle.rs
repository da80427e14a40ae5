//! Angles that lie around an estimate.

use bicycle::lanes::{Lanes, Real};
use traversability::N_BINS;

/// Values of the attitude bins in units of their width.
pub(crate) const VALUES: [f32; N_BINS] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 11.5];

/// |X|, X distributed as triangles around a centre that is not negative. In units of attitude bins.
#[derive(Clone, Copy)]
pub(crate) struct Triangles<L: Lanes, const N: usize> {
    pub centre: Real<L>,
    pub around: [Triangle<L>; N],
}

/// How far a triangle reaches, and the probability that it holds.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<L: Lanes> {
    half_width: Real<L>,
    per_half_width: Real<L>,
    probability: Real<L>,
}

/// Expected excess E[(|X| - v)^+] over each of [`VALUES`], summed over triangles.
pub(crate) type Excess<L> = [Real<L>; N_BINS];

impl<L: Lanes> Triangle<L> {
    #[inline(always)]
    pub fn new(lanes: L, half_width: Real<L>, probability: Real<L>) -> Self {
        // No narrower than what keeps the division finite.
        let half_width = half_width.max(lanes.real(1e-3));
        Self { half_width, per_half_width: lanes.real(1.0) / half_width, probability }
    }

    /// What a value at a distance from the centre gets for the kink there being rounded off, over the sixth of the
    /// triangle's height.
    #[inline(always)]
    fn rounding(&self, lanes: L, away: Real<L>) -> Real<L> {
        let inside = (lanes.real(1.0) - away * self.per_half_width).max(lanes.real(0.0));
        inside * inside * inside
    }

    #[inline(always)]
    fn sixth(&self, lanes: L) -> Real<L> {
        self.probability * self.half_width * lanes.real(1.0 / 6.0)
    }
}

impl<L: Lanes, const N: usize> Triangles<L, N> {
    /// Triangles of no probability.
    #[inline(always)]
    pub fn nothing(lanes: L) -> Self {
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        Self {
            centre: zero,
            around: [Triangle { half_width: one, per_half_width: one, probability: zero }; N],
        }
    }

    /// Adds the expected excess: a kink at the centre, rounded off by a cubic on either side, once for each sign of X.
    #[inline(always)]
    pub fn add_excess(&self, lanes: L, excess: &mut Excess<L>) {
        let mut probability = self.around[0].probability;
        for triangle in &self.around[1..] {
            probability = probability + triangle.probability;
        }
        let mut sixths = [lanes.real(0.0); N];
        for n in 0..N {
            sixths[n] = self.around[n].sixth(lanes);
        }
        for k in 0..N_BINS {
            let over = self.centre - lanes.real_single(VALUES[k]);
            let mut sum = excess[k] + probability * over.max(lanes.real(0.0));
            for n in 0..N {
                sum = sum + sixths[n] * self.around[n].rounding(lanes, over.abs());
            }
            excess[k] = sum;
        }
        for n in 0..N {
            self.add_mirrored(lanes, &self.around[n], sixths[n], excess);
        }
    }

    /// The part of a triangle beyond zero.
    #[inline(always)]
    fn add_mirrored(&self, lanes: L, triangle: &Triangle<L>, sixth: Real<L>, excess: &mut Excess<L>) {
        for k in 0..N_BINS {
            let away = self.centre + lanes.real_single(VALUES[k]);
            let reaches = away.less(triangle.half_width);
            // Values ascend: what none of the lanes reaches, none reaches later.
            if !lanes.any(reaches) {
                return;
            }
            excess[k] = excess[k].add_where(reaches, sixth * triangle.rounding(lanes, away));
        }
    }
}

/// Probabilities by attitude bin of outcomes of total probability one, given by their expected excess.
///
/// Every outcome is split linearly between the neighbouring values, which keeps the mean (except where it is
/// cut off at the smallest and the largest value). The probability of lying above a value, up to the next, is
/// then the fall of the expected excess between them.
pub(crate) fn probabilities(excess: &[f64; N_BINS]) -> [f32; N_BINS] {
    let beyond = |k: usize| match k {
        0 => 1.0,
        k if k == N_BINS => 0.0,
        k => excess[k - 1] - excess[k],
    };
    // Rounding can leave a negative trace.
    std::array::from_fn(|k| (beyond(k) - beyond(k + 1)).max(0.0) as f32)
}

#[cfg(test)]
mod tests {
    use bicycle::lanes::Scalar;
    use proptest::prelude::*;

    use super::*;

    /// |X| by the midpoint rule over the triangle's quantiles, split between the values.
    fn by_quantiles(centre: f64, half_width: f64) -> [f64; N_BINS] {
        let n = 20_000;
        let mut probabilities = [0.0; N_BINS];
        for k in 0..n {
            let u = (k as f64 + 0.5) / n as f64;
            let off = if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() };
            let place = ((centre + half_width * off).abs() - 0.5).clamp(0.0, 11.0);
            let below = (place as usize).min(10);
            probabilities[below] += (below as f64 + 1.0 - place) / n as f64;
            probabilities[below + 1] += (place - below as f64) / n as f64;
        }
        probabilities
    }

    proptest! {
        #[test]
        fn probabilities_are_those_of_the_split_quantiles(centre in 0.0..14.0f64, half_width in 0.01..12.0f64) {
            let real = |value: f64| Real(Scalar, value);
            let around = [Triangle::new(Scalar, real(half_width), real(1.0))];
            let mut excess = [real(0.0); N_BINS];
            Triangles { centre: real(centre), around }.add_excess(Scalar, &mut excess);
            let found = probabilities(&excess.map(|excess| excess.1));
            for (found, expected) in found.iter().zip(by_quantiles(centre, half_width)) {
                prop_assert!((f64::from(*found) - expected).abs() < 2e-4, "{found} {expected}");
            }
        }
    }
}
