//! What may be said of shares, means and pairs.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

/// Standard normal quantile of 97.5 %: intervals cover 95 %.
pub const WILSON_Z: f64 = 1.959_963_984_540_054;

/// How often values are drawn again for an interval.
const N_DRAWS: usize = 2000;
const SEED: u64 = 17;

/// A mean with the ends of its 95 % interval (percentile bootstrap over the values).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Mean {
    /// Of at least one value.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let n = values.len();
        let mut draw = || (0..n).map(|_| values[rng.random_range(0..n)]).sum::<f64>() / n as f64;
        let mut means: Vec<f64> = (0..N_DRAWS).map(|_| draw()).collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[(share * (N_DRAWS - 1) as f64).round() as usize];
        Some(Self { value: values.iter().sum::<f64>() / n as f64, low: at(0.025), high: at(0.975) })
    }
}

/// Where 95 % of such intervals hold the true probability of what came `n_hit` times in `n` > 0 trials
/// (Wilson 1927): all probabilities that a score test at 5 % would not reject.
pub fn wilson_interval(n_hit: usize, n: usize) -> [f64; 2] {
    let (n, share) = (n as f64, n_hit as f64 / n as f64);
    let z_squared_over_n = WILSON_Z * WILSON_Z / n;
    let centre = share + 0.5 * z_squared_over_n;
    let half_width = (z_squared_over_n * (share * (1.0 - share) + 0.25 * z_squared_over_n)).sqrt();
    // At no hit or no miss one end is the bound itself, up to rounding.
    [centre - half_width, centre + half_width].map(|end| (end / (1.0 + z_squared_over_n)).clamp(0.0, 1.0))
}

/// Probability of a split at least as uneven as `n_one` to `n_other` if both were equally likely: the exact two-sided
/// test of pairs that differ (McNemar 1947). 1 where no pair differs.
pub fn mcnemar_p_value(n_one: usize, n_other: usize) -> f64 {
    let (n, fewer) = (n_one + n_other, n_one.min(n_other));
    // In logarithms: 2^-n leaves the range of numbers where n passes a thousand.
    let mut log_probability = n as f64 * 0.5_f64.ln();
    let mut tail = 0.0;
    for k in 0..=fewer {
        tail += log_probability.exp();
        log_probability += ((n - k) as f64 / (k + 1) as f64).ln();
    }
    (2.0 * tail).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_is_the_published_one() {
        // Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3; and 8 of 10.
        let published = [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
            (8, 10, [0.4902, 0.9433]),
        ];
        for (n_hit, n, expected) in published {
            let found = wilson_interval(n_hit, n);
            for end in 0..2 {
                assert!((found[end] - expected[end]).abs() < 5.1e-5, "{n_hit} of {n}: {found:?}");
            }
        }
    }

    #[test]
    fn ends_are_where_the_score_test_just_rejects() {
        for (n_hit, n) in [(1, 20), (8, 10), (13, 20), (19, 20)] {
            for end in wilson_interval(n_hit, n) {
                let off = n_hit as f64 - n as f64 * end;
                let score = off / (n as f64 * end * (1.0 - end)).sqrt();
                assert!((score.abs() - WILSON_Z).abs() < 1e-9, "{n_hit} of {n}: {score}");
            }
        }
    }

    #[test]
    fn hits_and_misses_mirror_each_other() {
        for n_hit in 0..=20 {
            let [low, high] = wilson_interval(n_hit, 20);
            let [mirrored_high, mirrored_low] = wilson_interval(20 - n_hit, 20).map(|end| 1.0 - end);
            assert!((low - mirrored_low).abs() < 1e-12 && (high - mirrored_high).abs() < 1e-12);
            assert!(0.0 <= low && low <= n_hit as f64 / 20.0 && n_hit as f64 / 20.0 <= high && high <= 1.0);
        }
    }

    #[test]
    fn pairs_that_differ_are_tested_exactly() {
        // Of 5 pairs all one way: 2 / 2^5. Of 9 and 1: 2 (1 + 10) / 2^10. Even splits say nothing.
        assert!((mcnemar_p_value(5, 0) - 0.0625).abs() < 1e-15);
        assert!((mcnemar_p_value(1, 9) - 22.0 / 1024.0).abs() < 1e-15);
        for even in [0, 4, 550] {
            assert_eq!(mcnemar_p_value(even, even), 1.0, "{even}");
        }
        // Many pairs are nearly normal: the two tails beyond (1060 - 1000 - 0.5) / sqrt(500), hence of 2.661.
        assert!((mcnemar_p_value(940, 1060) - 0.007_79).abs() < 1e-4, "{}", mcnemar_p_value(940, 1060));
    }

    #[test]
    fn a_mean_of_equal_values_is_certain_and_of_none_is_none() {
        assert_eq!(Mean::of(&[2.0; 7]), Some(Mean { value: 2.0, low: 2.0, high: 2.0 }));
        assert_eq!(Mean::of(&[]), None);
        // Values of variance 1/12 spread over (0, 1): the interval of 300 is 2 x 1.96 sqrt(1 / 12 / 300) wide.
        let even: Vec<f64> = (0..300).map(|k| (f64::from(k) + 0.5) / 300.0).collect();
        let mean = Mean::of(&even).unwrap();
        assert!((mean.value - 0.5).abs() < 1e-12 && mean.low < 0.5 && 0.5 < mean.high);
        assert!((mean.high - mean.low - 0.0653).abs() < 0.006, "{mean:?}");
    }
}
