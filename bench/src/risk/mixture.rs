//! How much traction a cover of the ground gives: normal distributions, mixed and cut off.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Bins of a distribution: an atom at 0, twenty of 0.05, an atom at 1, as in the planner's public code.
pub const N_BINS: usize = 22;

/// One normal distribution of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Of the draws, before what lies outside [0, 1] is drawn again.
    pub share: f64,
    /// Traction in the middle [-].
    pub mean: f64,
    /// Standard deviation [-].
    pub std: f64,
}

/// A mixture of normal distributions over traction. What is drawn outside [0, 1] is drawn again, component and all, so
/// that a component that often lies outside loses share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture(pub &'static [Component]);

impl Component {
    /// Probability of a draw of this component within (low, high], before the cut.
    fn between(&self, low: f64, high: f64) -> f64 {
        let below = |value: f64| {
            let deviations = (value - self.mean) / self.std;
            0.5 * libm::erfc(-deviations * std::f64::consts::FRAC_1_SQRT_2)
        };
        below(high) - below(low)
    }
}

impl Mixture {
    /// The value that stands for each bin: 0, 0.025, 0.075, ..., 0.975, 1.
    pub fn bin_values() -> [f32; N_BINS] {
        std::array::from_fn(|bin| match bin {
            0 => 0.0,
            21 => 1.0,
            inner => (0.05 * (inner as f64 - 0.5)) as f32,
        })
    }

    /// Probability of each bin. The atoms are empty: a cut normal distribution has none.
    pub fn bins(&self) -> [f32; N_BINS] {
        std::array::from_fn(|bin| match bin {
            0 | 21 => 0.0,
            inner => self.probability(0.05 * (inner - 1) as f64, 0.05 * inner as f64) as f32,
        })
    }

    /// Probability of traction within (low, high].
    pub fn probability(&self, low: f64, high: f64) -> f64 {
        self.before_cut(low, high) / self.before_cut(0.0, 1.0)
    }

    /// Share of one component in what is left after the cut.
    pub fn share(&self, component: usize) -> f64 {
        let Component { share, .. } = self.0[component];
        share * self.0[component].between(0.0, 1.0) / self.before_cut(0.0, 1.0)
    }

    fn before_cut(&self, low: f64, high: f64) -> f64 {
        self.0.iter().map(|component| component.share * component.between(low, high)).sum()
    }

    /// One draw.
    pub fn sample(&self, rng: &mut impl Rng) -> f64 {
        loop {
            let drawn = self.draw(rng);
            if (0.0..=1.0).contains(&drawn) {
                return drawn;
            }
        }
    }

    fn draw(&self, rng: &mut impl Rng) -> f64 {
        let mut left: f64 = rng.random();
        let chosen = self.0.iter().find(|component| {
            left -= component.share;
            left < 0.0
        });
        // Shares that sum to a hair less than one leave the last.
        chosen.or(self.0.last()).map_or(f64::NAN, |component| {
            component.mean + component.std * rng.sample::<f64, _>(StandardNormal)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::world::Cover;
    use super::*;
    use scenarios::stream;

    #[test]
    fn low_mode_loses_the_half_that_is_cut_off() {
        // 0.6 / 2 of the draws are kept of the low mode, and of the high one 0.4 times what lies within two deviations
        // above the mean, 0.977 249 87 of a normal distribution.
        let expected = 0.3 / (0.3 + 0.4 * 0.977_249_87);
        assert!((Cover::Bush.traction().share(0) - expected).abs() < 1e-8);
        assert!((expected - 0.434).abs() < 5e-4);
    }

    #[test]
    fn bins_are_the_distribution() {
        for cover in Cover::ALL {
            let bins = cover.traction().bins();
            assert!((bins.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert_eq!((bins[0], bins[21]), (0.0, 0.0));
        }
        // From the mean to half a deviation above it lies 0.191 462 46 of a normal distribution, of which 3.5
        // deviations above the mean cut 2.326e-4.
        let expected = 0.191_462_46 / (1.0 - 2.326_29e-4);
        assert!((f64::from(Cover::Dirt.traction().bins()[14]) - expected).abs() < 1e-7);
        let values = Mixture::bin_values();
        assert_eq!((values[1], values[14], values[20]), (0.025, 0.675, 0.975));
    }

    #[test]
    fn draws_follow_the_bins() {
        const N: usize = 40_000;
        let bush = Cover::Bush.traction();
        let mut rng = stream(1, &[]);
        let drawn: Vec<f64> = (0..N).map(|_| bush.sample(&mut rng)).collect();
        assert!(drawn.iter().all(|traction| (0.0..=1.0).contains(traction)));
        for bin in 0..20 {
            let [low, high] = [bin, bin + 1].map(|edge| 0.05 * f64::from(edge));
            let share = drawn.iter().filter(|&&value| value > low && value <= high).count() as f64 / N as f64;
            let expected = bush.probability(low, high);
            // Five standard deviations of a share.
            let tolerance = 5.0 * (expected * (1.0 - expected) / N as f64).sqrt();
            assert!((share - expected).abs() <= tolerance, "bin {bin}: {share}, {expected}");
        }
    }
}
