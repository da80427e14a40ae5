//! Angles that lie around an estimate.

use traversability::N_BINS;

/// Values of the attitude bins in units of their width.
pub(crate) const VALUES: [f32; N_BINS] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 11.5];

/// Shares of |X|, X distributed as a triangle around a centre that is not negative: one triangle per wheel
/// pair, the two of roll and the two of pitch. In units of attitude bins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangles {
    centre: [f32; 4],
    half_width: [f32; 4],
    per_half_width: [f32; 4],
    probability: [f32; 4],
}

/// Expected excess E[(|X| - v)^+] over each of [`VALUES`], summed over triangles.
pub(crate) type Excess = [f32; N_BINS];

impl Triangles {
    /// Nothing.
    pub const NONE: Self =
        Self { centre: [0.0; 4], half_width: [1.0; 4], per_half_width: [1.0; 4], probability: [0.0; 4] };

    /// One triangle per lane.
    #[inline(always)]
    pub fn new(centre: [f32; 4], mut half_width: [f32; 4], probability: [f32; 4]) -> Self {
        let mut per_half_width = [0.0; 4];
        for lane in 0..4 {
            // No narrower than what keeps the division finite.
            half_width[lane] = half_width[lane].max(1e-3);
            per_half_width[lane] = 1.0 / half_width[lane];
        }
        Self { centre, half_width, per_half_width, probability }
    }

    /// Adds one triangle's share of the expected excess: a kink at the centre, rounded off by a cubic on either
    /// side, once for each sign of X.
    #[inline(always)]
    pub fn add_excess(&self, lane: usize, excess: &mut Excess) {
        self.add_excess_around(self.centre[lane], lane, excess);
        let crosses_zero = self.centre[lane] + VALUES[0] < self.half_width[lane];
        if crosses_zero {
            self.add_excess_around(-self.centre[lane], lane, excess);
        }
    }

    #[inline(always)]
    fn add_excess_around(&self, centre: f32, lane: usize, excess: &mut Excess) {
        let (per_half_width, probability) = (self.per_half_width[lane], self.probability[lane]);
        let sixth = probability * self.half_width[lane] * (1.0 / 6.0);
        for k in 0..N_BINS {
            let over = centre - VALUES[k];
            let inside = (1.0 - over.abs() * per_half_width).max(0.0);
            excess[k] += probability * over.max(0.0) + sixth * (inside * inside * inside);
        }
    }
}

/// Probabilities by attitude bin of outcomes of total probability one, given by their expected excess.
///
/// Every outcome is split linearly between the neighbouring values, which keeps the mean (except where it is
/// cut off at the smallest and the largest value). The probability of lying above a value, up to the next, is
/// then the fall of the expected excess between them.
pub(crate) fn probabilities(excess: &Excess) -> [f32; N_BINS] {
    let beyond = |k: usize| match k {
        0 => 1.0,
        k if k == N_BINS => 0.0,
        k => excess[k - 1] - excess[k],
    };
    // Rounding can leave a negative trace.
    std::array::from_fn(|k| (beyond(k) - beyond(k + 1)).max(0.0))
}

#[cfg(test)]
mod tests {
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
            let mut excess = [0.0; N_BINS];
            Triangles::new([centre as f32; 4], [half_width as f32; 4], [1.0; 4]).add_excess(2, &mut excess);
            let found = probabilities(&excess);
            for (found, expected) in found.iter().zip(by_quantiles(centre, half_width)) {
                prop_assert!((f64::from(*found) - expected).abs() < 2e-4, "{found} {expected}");
            }
        }
    }
}
