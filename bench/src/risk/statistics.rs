//! How far apart two shares are, and whether by luck.

use serde::Serialize;

use crate::navigation::wilson_interval;

/// Tables whose probability is the observed one up to rounding count as equally rare.
const ROUNDING: f64 = 1.0 + 1e-9;

/// So many hits in so many trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Count {
    /// Hits.
    pub n_hit: usize,
    /// Trials; at least one.
    pub n: usize,
}

impl Count {
    /// Hits over trials.
    pub fn share(self) -> f64 {
        self.n_hit as f64 / self.n as f64
    }
}

/// Where 95 % of such intervals hold the true difference of two independent shares, the first less the second
/// (Newcombe, Statistics in Medicine 17 (1998) 873, method 10): Wilson's intervals, squared and added.
pub fn newcombe_interval(first: Count, second: Count) -> [f64; 2] {
    let difference = first.share() - second.share();
    let [[low, high], [other_low, other_high]] =
        [first, second].map(|count| wilson_interval(count.n_hit, count.n));
    let below = (first.share() - low).hypot(other_high - second.share());
    let above = (high - first.share()).hypot(second.share() - other_low);
    [difference - below, difference + above]
}

/// Probability, were two independent shares the same, of hits as unevenly shared out as these or more so (Fisher's exact
/// test, two-sided: all that is no more probable than what was seen).
pub fn fisher_exact(first: Count, second: Count) -> f64 {
    let n_hit = first.n_hit + second.n_hit;
    let least = n_hit.saturating_sub(second.n);
    let ln_weight = |k: usize| ln_choose(first.n, k) + ln_choose(second.n, n_hit - k);
    let total = ln_choose(first.n + second.n, n_hit);
    let probability = |k: usize| libm::exp(ln_weight(k) - total);
    let seen = probability(first.n_hit) * ROUNDING;
    let rare = (least..=n_hit.min(first.n)).map(probability).filter(|&probability| probability <= seen);
    rare.sum::<f64>().min(1.0)
}

/// Probability, were either side as likely, of pairs that differ to fall as unevenly as these or more so (McNemar's test
/// in its exact form, which is the sign test, two-sided).
pub fn sign_test(n_more: usize, n_less: usize) -> f64 {
    let n = n_more + n_less;
    let ln_all = n as f64 * std::f64::consts::LN_2;
    let tail: f64 = (0..=n_more.min(n_less)).map(|k| libm::exp(ln_choose(n, k) - ln_all)).sum();
    (2.0 * tail).min(1.0)
}

/// Probabilities made larger so that one of them all falls below a bound by luck no more often than the bound says
/// (Holm, Scandinavian Journal of Statistics 6 (1979) 65), however they depend on each other.
pub fn holm(probabilities: &[f64]) -> Vec<f64> {
    let n = probabilities.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
    let (mut adjusted, mut largest) = (vec![0.0; n], 0.0_f64);
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((n - rank) as f64 * probabilities[index]).min(1.0);
        adjusted[index] = largest;
    }
    adjusted
}

fn ln_choose(n: usize, k: usize) -> f64 {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(n_hit: usize, n: usize) -> Count {
        Count { n_hit, n }
    }

    #[test]
    fn difference_interval_is_the_published_one() {
        // Newcombe, Statistics in Medicine 17 (1998) 873, table II, method 10.
        let published = [
            (count(56, 70), count(48, 80), [0.0524, 0.3339]),
            (count(9, 10), count(3, 10), [0.1705, 0.8090]),
            (count(6, 7), count(2, 7), [0.0582, 0.8062]),
            (count(5, 56), count(0, 29), [-0.0381, 0.1926]),
            (count(0, 10), count(0, 20), [-0.1611, 0.2775]),
        ];
        for (first, second, expected) in published {
            let found = newcombe_interval(first, second);
            for end in 0..2 {
                assert!((found[end] - expected[end]).abs() < 5.1e-5, "{first:?}, {second:?}: {found:?}");
            }
        }
    }

    #[test]
    fn fishers_test_is_his_own() {
        // The lady who tasted tea, three of four right: (1 + 16 + 16 + 1) / 70.
        assert!((fisher_exact(count(3, 4), count(1, 4)) - 34.0 / 70.0).abs() < 1e-12);
        // Convicted twins of criminals, ten of thirteen and two of seventeen.
        assert!((fisher_exact(count(10, 13), count(2, 17)) - 5.367e-4).abs() < 5e-8);
        assert!((fisher_exact(count(5, 5), count(5, 5)) - 1.0).abs() < 1e-12);
        // All against none of 200: two of C(400, 200) tables, of 4^200 / sqrt(200 pi) to one part in 1600.
        let rarest = 2.0 * (200.0 * std::f64::consts::PI).sqrt() * 4.0_f64.powi(-200);
        assert!((fisher_exact(count(200, 200), count(0, 200)) / rarest - 1.0).abs() < 1e-3);
    }

    #[test]
    fn sign_test_is_a_fair_coin() {
        // At most one head in six throws: 7 of 64, and as many the other way round.
        assert!((sign_test(5, 1) - 14.0 / 64.0).abs() < 1e-12);
        assert!((sign_test(0, 10) - 2.0 / 1024.0).abs() < 1e-12);
        assert_eq!((sign_test(0, 0), sign_test(4, 4)), (1.0, 1.0));
    }

    #[test]
    fn holm_multiplies_by_what_is_left_and_keeps_the_order() {
        // 4 x 0.005, 3 x 0.01, 2 x 0.03, and no less for 0.04.
        for (found, expected) in holm(&[0.01, 0.04, 0.03, 0.005]).into_iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        assert_eq!((holm(&[0.7, 0.9]), holm(&[])), (vec![1.0, 1.0], vec![]));
    }
}
